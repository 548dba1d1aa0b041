#pragma once
// The part of a ray that a box hides from a light, bound by bound in double precision.

#include <algorithm>

#include "sim/light/surfaces.h"

namespace turbidock::testing {

// The hidden part of a stretch along the unit vector u.
inline light::Stretch HiddenBy(const light::BoxShadow& shadow, const Eigen::Vector3d& u,
                               const light::Stretch& stretch) {
  light::Stretch hidden = stretch;
  for (int i = 0; i < shadow.count; ++i) {
    const auto& [constant, gradient] = shadow.bounds[static_cast<size_t>(i)];
    const double slope = gradient.dot(u), t_m = -constant / slope;
    if (slope > 0) hidden.t1_m = std::min(hidden.t1_m, t_m);
    if (slope < 0) hidden.t0_m = std::max(hidden.t0_m, t_m);
    if (slope == 0 && constant > 0) return {};
  }
  constexpr double kTouch_m = 1e-4;  // less is where the ray ends on the box
  return hidden.t1_m - hidden.t0_m > kTouch_m ? hidden : light::Stretch{};
}

}  // namespace turbidock::testing
