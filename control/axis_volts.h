#pragma once
// What a controller says before it is shared out to the thrusters.

#include <cmath>

namespace turbidock::control {

// Voltages by axis of the vehicle, as deviations from neutral: positive surges forward, sways left,
// heaves up, and yaws counter-clockwise seen from above. Zero lets the vehicle drift.
struct AxisVolts {
  double surge_v = 0, sway_v = 0, heave_v = 0, yaw_v = 0;

  bool IsFinite() const {
    return std::isfinite(surge_v) && std::isfinite(sway_v) && std::isfinite(heave_v) &&
           std::isfinite(yaw_v);
  }
  bool operator==(const AxisVolts&) const = default;
};

inline AxisVolts operator+(const AxisVolts& a, const AxisVolts& b) {
  return {a.surge_v + b.surge_v, a.sway_v + b.sway_v, a.heave_v + b.heave_v, a.yaw_v + b.yaw_v};
}
inline AxisVolts operator-(const AxisVolts& a, const AxisVolts& b) {
  return {a.surge_v - b.surge_v, a.sway_v - b.sway_v, a.heave_v - b.heave_v, a.yaw_v - b.yaw_v};
}

}  // namespace turbidock::control
