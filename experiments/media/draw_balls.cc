#include "experiments/media/draw_balls.h"

#include <algorithm>
#include <numbers>

namespace turbidock::media {

void DrawBalls(const Image3u8& image, const std::vector<vision::ProjectedBall>& balls,
               bool is_detected, double envelope_ratio, const PixelRect& panel, Canvas* canvas) {
  constexpr Rgb kBlack = {0, 0, 0}, kWhite = {255, 255, 255};
  const PixelRect shown = canvas->DrawImage(image, panel);
  const double scale = static_cast<double>(shown.width) / image.width();
  const double alpha = is_detected ? 1 : 0.4;
  canvas->Clip(shown);
  for (const vision::ProjectedBall& ball : balls) {
    if (!ball.center_px.allFinite() || !(ball.radius_px > 0)) continue;
    // pixel centres to pixel centres: the corner of the image is half a pixel before the first one
    const Eigen::Vector2d center =
        ((ball.center_px.array() + 0.5) * scale - 0.5).matrix() + Eigen::Vector2d(shown.x, shown.y);
    const double radius = scale * ball.radius_px;
    const double envelope = envelope_ratio * radius;
    canvas->Circle(center, envelope, 2.4, kBlack, 0.45 * alpha);
    canvas->Circle(center, envelope, 1.1, kWhite, 0.85 * alpha);
    // dots in the ball's colour, edged white and black: one of the three shows on any ground
    const int dots = std::clamp(static_cast<int>(2 * std::numbers::pi * radius / 9), 8, 36);
    canvas->DottedCircle(center, radius, dots, 6.4, kBlack, 0.6 * alpha);
    canvas->DottedCircle(center, radius, dots, 5.0, kWhite, alpha);
    canvas->DottedCircle(center, radius, dots, 3.2, ball.rgb, alpha);
  }
  canvas->Unclip();
}

}  // namespace turbidock::media
