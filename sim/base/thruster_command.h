#pragma once
// What the control side says to the vehicle.

#include <boost/container/static_vector.hpp>

namespace turbidock {

inline constexpr int kMaxThrusters = 16;
inline constexpr double kNeutralVolts = 2.5;
inline constexpr double kMaxVolts = 5;

// A number for each of the vehicle's thrusters, in the order of the motors in its MJCF. The
// published vehicle's: surge left, surge right, sway, heave.
using PerThruster = boost::container::static_vector<double, kMaxThrusters>;

// Command voltages, 0..5 V; above neutral pushes along the thruster's axis. Empty: all neutral.
struct ThrusterCommand {
  PerThruster volts{};

  static ThrusterCommand Neutral(size_t thrusters) {
    return {.volts = PerThruster(thrusters, kNeutralVolts)};
  }
};

}  // namespace turbidock
