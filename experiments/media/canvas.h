#pragma once
// A picture to draw on, by cairo: anti-aliased lines, text, images.

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>

#include "sim/base/image.h"

// Cairo's own names, so that its header stays out of this one.
struct _cairo;          // NOLINT(bugprone-reserved-identifier)
struct _cairo_surface;  // NOLINT(bugprone-reserved-identifier)

namespace turbidock::media {

// A rectangle of whole pixels: left column, top row, size.
struct PixelRect {
  int x = 0, y = 0, width = 0, height = 0;

  int right() const { return x + width; }
  int bottom() const { return y + height; }
};

enum class Align { kLeft, kCenter, kRight };

// Points are in pixels with (0, 0) in the centre of the top-left pixel, as in the cameras, so a
// line of width 1 along a whole row fills exactly that row. `alpha` is opacity in [0, 1].
class Canvas {
 public:
  Canvas(int width_px, int height_px);  // black

  int width() const { return width_px_; }
  int height() const { return height_px_; }
  PixelRect area() const { return {0, 0, width_px_, height_px_}; }

  // Four bytes a pixel (blue, green, red, unused), rows without padding, top row first.
  const uint8_t* data() const;
  size_t bytes() const { return 4 * static_cast<size_t>(width_px_) * height_px_; }
  Image3u8 ToImage() const;

  void FillRect(const PixelRect& rect, Rgb color, double alpha = 1);
  void Line(const Eigen::Vector2d& from_px, const Eigen::Vector2d& to_px, double width_px,
            Rgb color, double alpha = 1, bool round_ends = false);
  void Circle(const Eigen::Vector2d& center_px, double radius_px, double width_px, Rgb color,
              double alpha = 1);
  // `dots` round dots of the given diameter, evenly spaced, the first one to the right.
  void DottedCircle(const Eigen::Vector2d& center_px, double radius_px, int dots,
                    double diameter_px, Rgb color, double alpha = 1);

  // `at` is on the base line, at the left end, middle or right end of the text.
  void Text(const Eigen::Vector2d& at_px, const std::string& text, double size_px, Rgb color,
            Align align = Align::kLeft, bool bold = false);
  double TextWidth(const std::string& text, double size_px, bool bold = false);

  // The image fitted into the rectangle, centred, its shape kept. Returns the rectangle it fills.
  PixelRect DrawImage(const Image3u8& image, const PixelRect& into);
  void DrawCanvas(const Canvas& other, int x, int y);

  // Confines what follows to the rectangle.
  void Clip(const PixelRect& rect);
  void Unclip();

 private:
  void AddCircle(const Eigen::Vector2d& center_px, double radius_px);  // to the path
  void SetColor(Rgb color, double alpha);
  void SetFont(double size_px, bool bold);

  int width_px_, height_px_;
  std::unique_ptr<_cairo_surface, void (*)(_cairo_surface*)> surface_;
  std::unique_ptr<_cairo, void (*)(_cairo*)> cairo_;
};

}  // namespace turbidock::media
