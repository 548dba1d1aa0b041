#include "experiments/studies/recognition/look.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace turbidock::recognition {
namespace {

constexpr double kDisc = 0.9, kRing[] = {1.3, 1.7};  // in radii of the ball

struct MeanColor {
  Eigen::Array3d sum = Eigen::Array3d::Zero();
  int count = 0;

  void Add(const uint8_t* rgb) {
    sum += Eigen::Array3d(rgb[0], rgb[1], rgb[2]);
    ++count;
  }
  Eigen::Array3d value() const { return sum / std::max(count, 1); }
};

// How much more of one channel there is than of the others.
double Excess(const Eigen::Array3d& color, int channel) {
  return color[channel] - 0.5 * (color.sum() - color[channel]);
}

double BallDn(const Image3u8& image, const vision::BallCircle& circle, int channel) {
  MeanColor disc, ring;
  const double reach = kRing[1] * circle.radius_px;
  const auto first = [&](double x) { return std::max(0, static_cast<int>(std::ceil(x - reach))); };
  const auto last = [&](double x, int size) {
    return std::min(size - 1, static_cast<int>(std::floor(x + reach)));
  };
  for (int v = first(circle.v_px); v <= last(circle.v_px, image.height()); ++v)
    for (int u = first(circle.u_px); u <= last(circle.u_px, image.width()); ++u) {
      const double radii = std::hypot(u - circle.u_px, v - circle.v_px) / circle.radius_px;
      if (radii < kDisc)
        disc.Add(image.at(u, v));
      else if (radii > kRing[0] && radii < kRing[1])
        ring.Add(image.at(u, v));
    }
  return Excess(disc.value(), channel) - Excess(ring.value(), channel);
}

}  // namespace

Look LookOf(const Image3u8& image, const MountedCamera& camera, const vision::MarkerParams& marker,
            const Pose& X_HM) {
  Look look{.ball_dn = std::numeric_limits<double>::infinity()};
  for (const vision::BallParams& ball : marker.balls) {
    const Eigen::Vector3d p_CQ = camera.X_HC.Inverse() * (X_HM * ball.p_MQ_m);
    const auto channel = static_cast<int>(std::lround(ball.hue_rad / (2 * std::numbers::pi / 3)));
    look.ball_dn = std::min(
        look.ball_dn, BallDn(image, vision::ProjectBall(camera, p_CQ, ball.radius_m), channel % 3));
  }
  MeanColor mean;
  for (size_t i = 0; i < image.pixels(); ++i) mean.Add(image.data() + 3 * i);
  const double low = mean.value().minCoeff();
  look.brightness_dn = mean.value().maxCoeff();
  look.saturation = look.brightness_dn > 0 ? (look.brightness_dn - low) / look.brightness_dn : 0;
  return look;
}

}  // namespace turbidock::recognition
