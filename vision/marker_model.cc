#include "vision/marker_model.h"

#include <cmath>

namespace turbidock::vision {

void MarkerParams::Check(const std::string& path) const {
  const std::string key = JoinKey(path, "balls");
  if (balls.empty()) throw ConfigError(key, "a marker needs at least one ball");
  if (balls.size() > kMaxBalls)
    throw ConfigError(
        key, std::to_string(balls.size()) + " balls, must be at most " + std::to_string(kMaxBalls));
}

SamplePoints::SamplePoints(const MarkerParams& marker) {
  int next = 0;
  const auto add_ring = [&](int points, double ratio) {
    for (int i = 0; i < points; ++i, ++next) {
      const double angle_rad = 2 * std::numbers::pi * i / points;
      u[next] = static_cast<float>(ratio * std::cos(angle_rad));
      v[next] = static_cast<float>(ratio * std::sin(angle_rad));
    }
  };
  add_ring(6, marker.inner_ring_ratios[0]);
  add_ring(12, marker.inner_ring_ratios[1]);
  add_ring(18, marker.inner_ring_ratios[2]);
  add_ring(kOuterPoints, marker.outer_ring_ratio);
}

}  // namespace turbidock::vision
