#include "tests/support/paint_marker.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace turbidock::testing {
namespace {

struct Disc {
  double u_px, v_px, radius_px, depth_m;
  Eigen::Vector3d rgb;
};

// Share of a pixel inside a disc, from 4 x 4 samples.
double Coverage(const Disc& disc, int u, int v) {
  int inside = 0;
  for (int i = 0; i < 16; ++i) {
    const double du = u + (i % 4 - 1.5) / 4 - disc.u_px, dv = v + (i / 4 - 1.5) / 4 - disc.v_px;
    inside += du * du + dv * dv <= disc.radius_px * disc.radius_px;
  }
  return inside / 16.0;
}

Image3u8 PaintView(const vision::MarkerParams& marker, const CameraIntrinsics& camera,
                   const Pose& X_CM, const PaintOptions& options, Rng* rng) {
  std::vector<Disc> discs;
  for (const vision::BallParams& ball : marker.balls) {
    const Eigen::Vector3d p_CQ = X_CM.q * ball.p_MQ_m + X_CM.p;
    if (p_CQ.z() <= 0.01) continue;
    discs.push_back({camera.cx_px + camera.fx_px * p_CQ.x() / p_CQ.z(),
                     camera.cy_px + camera.fy_px * p_CQ.y() / p_CQ.z(),
                     camera.fx_px * ball.radius_m / p_CQ.z(), p_CQ.z(),
                     RgbOfHue(ball.hue_rad, options.saturation, options.value_dn)});
  }
  std::stable_sort(discs.begin(), discs.end(),
                   [](const Disc& a, const Disc& b) { return a.depth_m > b.depth_m; });

  Image3f canvas(camera.width_px, camera.height_px, static_cast<float>(options.background_dn));
  for (const Disc& disc : discs) {
    const int u_first = std::max(0, static_cast<int>(disc.u_px - disc.radius_px) - 1);
    const int v_first = std::max(0, static_cast<int>(disc.v_px - disc.radius_px) - 1);
    const int u_last =
        std::min(canvas.width() - 1, static_cast<int>(disc.u_px + disc.radius_px) + 2);
    const int v_last =
        std::min(canvas.height() - 1, static_cast<int>(disc.v_px + disc.radius_px) + 2);
    for (int v = v_first; v <= v_last; ++v)
      for (int u = u_first; u <= u_last; ++u) {
        const double share = Coverage(disc, u, v);
        for (int k = 0; k < 3; ++k) {
          float& value = canvas.at(u, v)[k];
          value = static_cast<float>((1 - share) * value + share * disc.rgb[k]);
        }
      }
  }

  Image3u8 image(canvas.width(), canvas.height());
  for (size_t i = 0; i < 3 * image.pixels(); ++i) {
    const double noise_dn = options.noise_dn > 0 ? options.noise_dn * rng->Normal() : 0;
    image.data()[i] =
        static_cast<uint8_t>(std::lround(std::clamp(canvas.data()[i] + noise_dn, 0.0, 255.0)));
  }
  return image;
}

}  // namespace

Eigen::Vector3d RgbOfHue(double hue_rad, double saturation, double value_dn) {
  Eigen::Vector3d rgb;
  for (int k = 0; k < 3; ++k) {
    // Each channel is a trapezium of the hue: full within 60 degrees of its own, nothing beyond
    // 120.
    const double own_rad = 2 * std::numbers::pi * k / 3;
    const double apart_rad = std::abs(std::remainder(hue_rad - own_rad, 2 * std::numbers::pi));
    const double level = std::clamp(2 - apart_rad / (std::numbers::pi / 3), 0.0, 1.0);
    rgb[k] = value_dn * (1 - saturation * (1 - level));
  }
  return rgb;
}

StereoImage PaintMarker(const vision::MarkerParams& marker, const StereoRig& rig, const Pose& X_HM,
                        const PaintOptions& options, Rng* rng) {
  StereoImage seen;
  seen.left = PaintView(marker, rig.left, rig.left.X_HC.Inverse() * X_HM, options, rng);
  seen.right = PaintView(marker, rig.right, rig.right.X_HC.Inverse() * X_HM, options, rng);
  return seen;
}

}  // namespace turbidock::testing
