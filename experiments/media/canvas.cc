#include "experiments/media/canvas.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "sim/base/check.h"

namespace turbidock::media {
namespace {

// cairo counts from the corner of the top-left pixel
constexpr double kHalf = 0.5;

}  // namespace

Canvas::Canvas(int width_px, int height_px, bool transparent)
    : width_px_(width_px),
      height_px_(height_px),
      surface_(cairo_image_surface_create(transparent ? CAIRO_FORMAT_ARGB32 : CAIRO_FORMAT_RGB24,
                                          width_px, height_px)),
      cairo_(cairo_create(surface_)) {
  TD_CHECK(cairo_status(cairo_) == CAIRO_STATUS_SUCCESS, "a canvas of usable size");
  TD_CHECK(cairo_image_surface_get_stride(surface_) == 4 * width_px, "rows without padding");
}

Canvas::~Canvas() {
  cairo_destroy(cairo_);
  cairo_surface_destroy(surface_);
}

Canvas::Canvas(Canvas&& other) noexcept
    : width_px_(other.width_px_),
      height_px_(other.height_px_),
      surface_(std::exchange(other.surface_, nullptr)),
      cairo_(std::exchange(other.cairo_, nullptr)) {}

const uint8_t* Canvas::data() const {
  cairo_surface_flush(surface_);
  return cairo_image_surface_get_data(surface_);
}

Image3u8 Canvas::ToImage() const {
  Image3u8 image(width_px_, height_px_);
  const uint8_t* from = data();
  uint8_t* to = image.data();
  for (size_t i = 0; i < image.pixels(); ++i, from += 4, to += 3) {
    to[0] = from[2];
    to[1] = from[1];
    to[2] = from[0];
  }
  return image;
}

void Canvas::Clear() {
  cairo_set_operator(cairo_, CAIRO_OPERATOR_CLEAR);
  cairo_paint(cairo_);
  cairo_set_operator(cairo_, CAIRO_OPERATOR_OVER);
}

void Canvas::FillRect(const PixelRect& rect, Rgb color, double alpha) {
  SetColor(color, alpha);
  cairo_rectangle(cairo_, rect.x, rect.y, rect.width, rect.height);
  cairo_fill(cairo_);
}

void Canvas::FillRounded(const PixelRect& rect, double radius_px, Rgb color, double alpha) {
  constexpr double kQuarter = std::numbers::pi / 2;
  SetColor(color, alpha);
  cairo_new_path(cairo_);
  cairo_arc(cairo_, rect.right() - radius_px, rect.y + radius_px, radius_px, -kQuarter, 0);
  cairo_arc(cairo_, rect.right() - radius_px, rect.bottom() - radius_px, radius_px, 0, kQuarter);
  cairo_arc(cairo_, rect.x + radius_px, rect.bottom() - radius_px, radius_px, kQuarter,
            2 * kQuarter);
  cairo_arc(cairo_, rect.x + radius_px, rect.y + radius_px, radius_px, 2 * kQuarter, 3 * kQuarter);
  cairo_close_path(cairo_);
  cairo_fill(cairo_);
}

void Canvas::FillTile(std::span<const Eigen::Vector2d> outline_px, Rgb color, double alpha) {
  SetColor(color, alpha);
  cairo_set_antialias(cairo_, CAIRO_ANTIALIAS_NONE);
  cairo_new_path(cairo_);
  for (const Eigen::Vector2d& p : outline_px) cairo_line_to(cairo_, p.x() + kHalf, p.y() + kHalf);
  cairo_fill(cairo_);
  cairo_set_antialias(cairo_, CAIRO_ANTIALIAS_DEFAULT);
}

void Canvas::Line(const Eigen::Vector2d& from_px, const Eigen::Vector2d& to_px, double width_px,
                  Rgb color, double alpha, bool round_ends) {
  SetColor(color, alpha);
  cairo_set_line_width(cairo_, width_px);
  cairo_set_line_cap(cairo_, round_ends ? CAIRO_LINE_CAP_ROUND : CAIRO_LINE_CAP_BUTT);
  cairo_move_to(cairo_, from_px.x() + kHalf, from_px.y() + kHalf);
  cairo_line_to(cairo_, to_px.x() + kHalf, to_px.y() + kHalf);
  cairo_stroke(cairo_);
}

void Canvas::Circle(const Eigen::Vector2d& center_px, double radius_px, double width_px, Rgb color,
                    double alpha) {
  SetColor(color, alpha);
  cairo_set_line_width(cairo_, width_px);
  cairo_new_path(cairo_);
  cairo_arc(cairo_, center_px.x() + kHalf, center_px.y() + kHalf, radius_px, 0,
            2 * std::numbers::pi);
  cairo_stroke(cairo_);
}

void Canvas::DottedCircle(const Eigen::Vector2d& center_px, double radius_px, int dots,
                          double diameter_px, Rgb color, double alpha) {
  SetColor(color, alpha);
  cairo_new_path(cairo_);
  for (int i = 0; i < dots; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / dots;
    const double x = center_px.x() + radius_px * std::cos(angle_rad) + kHalf;
    const double y = center_px.y() + radius_px * std::sin(angle_rad) + kHalf;
    cairo_new_sub_path(cairo_);
    cairo_arc(cairo_, x, y, diameter_px / 2, 0, 2 * std::numbers::pi);
  }
  cairo_fill(cairo_);
}

void Canvas::Text(const Eigen::Vector2d& at_px, std::string_view text, double size_px, Rgb color,
                  Align align, bool bold) {
  double x = at_px.x();
  if (align != Align::kLeft)
    x -= TextWidth(text, size_px, bold) * (align == Align::kCenter ? 0.5 : 1.0);
  SetFont(size_px, bold);
  SetColor(color, 1);
  text_[text.copy(text_, sizeof text_ - 1)] = '\0';
  // glyphs are sharpest on whole pixels
  cairo_move_to(cairo_, std::round(x), std::round(at_px.y()));
  cairo_show_text(cairo_, text_);
}

double Canvas::TextWidth(std::string_view text, double size_px, bool bold) {
  SetFont(size_px, bold);
  text_[text.copy(text_, sizeof text_ - 1)] = '\0';
  cairo_text_extents_t extents;
  cairo_text_extents(cairo_, text_, &extents);
  return extents.x_advance;
}

PixelRect Canvas::DrawImage(const Image3u8& image, const PixelRect& into) {
  TD_CHECK(!image.empty(), "an image to draw");
  const Canvas scratch(image.width(), image.height());  // in cairo's pixel format
  cairo_surface_flush(scratch.surface_);
  const uint8_t* from = image.data();
  uint8_t* to = cairo_image_surface_get_data(scratch.surface_);
  for (size_t i = 0; i < image.pixels(); ++i, from += 3, to += 4) {
    to[0] = from[2];
    to[1] = from[1];
    to[2] = from[0];
  }
  cairo_surface_mark_dirty(scratch.surface_);

  const double scale = std::min(static_cast<double>(into.width) / image.width(),
                                static_cast<double>(into.height) / image.height());
  const int width = std::clamp(static_cast<int>(std::lround(scale * image.width())), 1, into.width);
  const int height =
      std::clamp(static_cast<int>(std::lround(scale * image.height())), 1, into.height);
  const PixelRect filled{into.x + (into.width - width) / 2, into.y + (into.height - height) / 2,
                         width, height};
  cairo_save(cairo_);
  cairo_rectangle(cairo_, filled.x, filled.y, filled.width, filled.height);
  cairo_clip(cairo_);
  cairo_translate(cairo_, filled.x, filled.y);
  cairo_scale(cairo_, static_cast<double>(width) / image.width(),
              static_cast<double>(height) / image.height());
  cairo_set_source_surface(cairo_, scratch.surface_, 0, 0);
  cairo_pattern_set_extend(cairo_get_source(cairo_), CAIRO_EXTEND_PAD);
  cairo_paint(cairo_);
  cairo_restore(cairo_);
  return filled;
}

void Canvas::DrawCanvas(const Canvas& other, int x, int y) {
  cairo_set_source_surface(cairo_, other.surface_, x, y);
  cairo_rectangle(cairo_, x, y, other.width_px_, other.height_px_);
  cairo_fill(cairo_);
}

void Canvas::Clip(const PixelRect& rect) {
  cairo_rectangle(cairo_, rect.x, rect.y, rect.width, rect.height);
  cairo_clip(cairo_);
}

void Canvas::Unclip() { cairo_reset_clip(cairo_); }

void Canvas::SetColor(Rgb color, double alpha) {
  cairo_set_source_rgba(cairo_, color[0] / 255.0, color[1] / 255.0, color[2] / 255.0, alpha);
}

void Canvas::SetFont(double size_px, bool bold) {
  cairo_select_font_face(cairo_, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cairo_, size_px);
}

}  // namespace turbidock::media
