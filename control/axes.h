#pragma once
// The four controlled axes as one vector.

#include <Eigen/Core>

#include "control/axis_volts.h"
#include "sim/base/axes_pose.h"

namespace turbidock::control {

// Order everywhere: surge (x), sway (y), heave (z), yaw. Metres and radians, their rates, forces
// and moments, or volts.
using Axes = Eigen::Vector4d;
enum Axis { kSurge, kSway, kHeave, kYaw };
inline constexpr int kAxisCount = 4;

inline Axes ToAxes(const AxisVolts& v) { return {v.surge_v, v.sway_v, v.heave_v, v.yaw_v}; }
inline Axes ToAxes(const AxesPose& pose) { return {pose.x_m, pose.y_m, pose.z_m, pose.yaw_rad}; }
inline Axes ToAxes(const Pose& X_HM) { return ToAxes(AxesPose::Of(X_HM)); }
inline AxesPose ToAxesPose(const Axes& a) { return {a[kSurge], a[kSway], a[kHeave], a[kYaw]}; }
inline AxisVolts ToAxisVolts(const Axes& volts) {
  return {.surge_v = volts[kSurge],
          .sway_v = volts[kSway],
          .heave_v = volts[kHeave],
          .yaw_v = volts[kYaw]};
}

// a - b, the heading by the shorter way round.
inline Axes Difference(const Axes& a, const Axes& b) {
  Axes d = a - b;
  d[kYaw] = WrapAngle(d[kYaw]);
  return d;
}

}  // namespace turbidock::control
