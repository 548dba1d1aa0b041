#pragma once
// A pose as the docking vehicle can change it: in four axes.

#include <cmath>

#include "sim/base/fields.h"
#include "sim/base/pose.h"

namespace turbidock {

// Position and heading of one thing in another, or the difference of two such.
struct AxesPose {
  double x_m = 0, y_m = 0, z_m = 0, yaw_rad = 0;

  static AxesPose Of(const Pose& X) { return {X.p.x(), X.p.y(), X.p.z(), YawOf(X.q)}; }
  double distance_m() const { return std::hypot(x_m, y_m, z_m); }
  bool operator==(const AxesPose&) const = default;

  static void Fields(auto& self, auto&& field) {
    field("x_m", self.x_m, Finite(), "x, forward");
    field("y_m", self.y_m, Finite(), "y, to the left");
    field("z_m", self.z_m, Finite(), "z, up");
    field("yaw_rad", self.yaw_rad, Finite(), "heading, positive to the left");
  }
};

// The heading by the shorter way round.
inline AxesPose operator-(const AxesPose& a, const AxesPose& b) {
  return {a.x_m - b.x_m, a.y_m - b.y_m, a.z_m - b.z_m, WrapAngle(a.yaw_rad - b.yaw_rad)};
}

// Of B in A, where `pose` is of A in B, both level.
inline AxesPose Inverse(const AxesPose& pose) {
  const double c = std::cos(pose.yaw_rad), s = std::sin(pose.yaw_rad);
  return {-c * pose.x_m - s * pose.y_m, s * pose.x_m - c * pose.y_m, -pose.z_m, -pose.yaw_rad};
}

}  // namespace turbidock
