#include "experiments/media/canvas.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/base/check.h"

namespace turbidock::media {
namespace {

constexpr double kHalf = 0.5;  // cairo counts from the corner of the top-left pixel
constexpr double kCircle = 2 * std::numbers::pi;

// From three bytes a pixel to cairo's four or back, the order of red, green and blue turned round.
void CopyPixels(const uint8_t* from, int from_bytes, uint8_t* to, int to_bytes, size_t pixels) {
  for (size_t i = 0; i < pixels; ++i, from += from_bytes, to += to_bytes)
    std::reverse_copy(from, from + 3, to);
}

}  // namespace

Canvas::Canvas(int width_px, int height_px)
    : width_px_(width_px),
      height_px_(height_px),
      surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width_px, height_px),
               cairo_surface_destroy),
      cairo_(cairo_create(surface_.get()), cairo_destroy) {
  TD_CHECK(cairo_status(cairo_.get()) == CAIRO_STATUS_SUCCESS, "a canvas of usable size");
  TD_CHECK(cairo_image_surface_get_stride(surface_.get()) == 4 * width_px, "rows without padding");
}

const uint8_t* Canvas::data() const {
  cairo_surface_flush(surface_.get());
  return cairo_image_surface_get_data(surface_.get());
}

Image3u8 Canvas::ToImage() const {
  Image3u8 image(width_px_, height_px_);
  CopyPixels(data(), 4, image.data(), 3, image.pixels());
  return image;
}

void Canvas::FillRect(const PixelRect& rect, Rgb color, double alpha) {
  SetColor(color, alpha);
  cairo_rectangle(cairo_.get(), rect.x, rect.y, rect.width, rect.height);
  cairo_fill(cairo_.get());
}

void Canvas::Line(const Eigen::Vector2d& from_px, const Eigen::Vector2d& to_px, double width_px,
                  Rgb color, double alpha, bool round_ends) {
  SetColor(color, alpha);
  cairo_set_line_width(cairo_.get(), width_px);
  cairo_set_line_cap(cairo_.get(), round_ends ? CAIRO_LINE_CAP_ROUND : CAIRO_LINE_CAP_BUTT);
  cairo_move_to(cairo_.get(), from_px.x() + kHalf, from_px.y() + kHalf);
  cairo_line_to(cairo_.get(), to_px.x() + kHalf, to_px.y() + kHalf);
  cairo_stroke(cairo_.get());
}

void Canvas::Circle(const Eigen::Vector2d& center_px, double radius_px, double width_px, Rgb color,
                    double alpha) {
  SetColor(color, alpha);
  cairo_set_line_width(cairo_.get(), width_px);
  AddCircle(center_px, radius_px);
  cairo_stroke(cairo_.get());
}

void Canvas::DottedCircle(const Eigen::Vector2d& center_px, double radius_px, int dots,
                          double diameter_px, Rgb color, double alpha) {
  SetColor(color, alpha);
  for (int i = 0; i < dots; ++i) {
    const double angle_rad = kCircle * i / dots;
    AddCircle(center_px + radius_px * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad)),
              diameter_px / 2);
  }
  cairo_fill(cairo_.get());
}

void Canvas::Text(const Eigen::Vector2d& at_px, const std::string& text, double size_px, Rgb color,
                  Align align, bool bold) {
  double x = at_px.x();
  if (align != Align::kLeft)
    x -= TextWidth(text, size_px, bold) * (align == Align::kCenter ? 0.5 : 1.0);
  SetFont(size_px, bold);
  SetColor(color, 1);
  // glyphs are sharpest on whole pixels
  cairo_move_to(cairo_.get(), std::round(x), std::round(at_px.y()));
  cairo_show_text(cairo_.get(), text.c_str());
}

double Canvas::TextWidth(const std::string& text, double size_px, bool bold) {
  SetFont(size_px, bold);
  cairo_text_extents_t extents;
  cairo_text_extents(cairo_.get(), text.c_str(), &extents);
  return extents.x_advance;
}

PixelRect Canvas::DrawImage(const Image3u8& image, const PixelRect& into) {
  TD_CHECK(!image.empty(), "an image to draw");
  const Canvas scratch(image.width(), image.height());  // in cairo's pixel format
  scratch.data();                                       // before it is written from outside
  CopyPixels(image.data(), 3, cairo_image_surface_get_data(scratch.surface_.get()), 4,
             image.pixels());
  cairo_surface_mark_dirty(scratch.surface_.get());

  const double scale = std::min(static_cast<double>(into.width) / image.width(),
                                static_cast<double>(into.height) / image.height());
  const int width = std::clamp(static_cast<int>(std::lround(scale * image.width())), 1, into.width);
  const int height =
      std::clamp(static_cast<int>(std::lround(scale * image.height())), 1, into.height);
  const PixelRect filled{into.x + (into.width - width) / 2, into.y + (into.height - height) / 2,
                         width, height};
  cairo_save(cairo_.get());
  Clip(filled);
  cairo_translate(cairo_.get(), filled.x, filled.y);
  cairo_scale(cairo_.get(), static_cast<double>(width) / image.width(),
              static_cast<double>(height) / image.height());
  cairo_set_source_surface(cairo_.get(), scratch.surface_.get(), 0, 0);
  cairo_pattern_set_extend(cairo_get_source(cairo_.get()), CAIRO_EXTEND_PAD);
  cairo_paint(cairo_.get());
  cairo_restore(cairo_.get());
  return filled;
}

void Canvas::DrawCanvas(const Canvas& other, int x, int y) {
  cairo_set_source_surface(cairo_.get(), other.surface_.get(), x, y);
  cairo_rectangle(cairo_.get(), x, y, other.width_px_, other.height_px_);
  cairo_fill(cairo_.get());
}

void Canvas::Clip(const PixelRect& rect) {
  cairo_rectangle(cairo_.get(), rect.x, rect.y, rect.width, rect.height);
  cairo_clip(cairo_.get());
}

void Canvas::Unclip() { cairo_reset_clip(cairo_.get()); }

void Canvas::AddCircle(const Eigen::Vector2d& center_px, double radius_px) {
  cairo_new_sub_path(cairo_.get());
  cairo_arc(cairo_.get(), center_px.x() + kHalf, center_px.y() + kHalf, radius_px, 0, kCircle);
}

void Canvas::SetColor(Rgb color, double alpha) {
  cairo_set_source_rgba(cairo_.get(), color[0] / 255.0, color[1] / 255.0, color[2] / 255.0, alpha);
}

void Canvas::SetFont(double size_px, bool bold) {
  cairo_select_font_face(cairo_.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cairo_.get(), size_px);
}

}  // namespace turbidock::media
