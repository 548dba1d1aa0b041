#pragma once
// What the control side says to the vehicle.

#include <array>

namespace turbidock {

// Order everywhere: surge left, surge right, sway, heave.
inline constexpr int kThrusterCount = 4;
inline constexpr double kNeutralVolts = 2.5;
inline constexpr double kMaxVolts = 5;

// Command voltages, 0..5 V; above neutral pushes along the thruster's axis (forward, left, up).
struct ThrusterCommand {
  std::array<double, kThrusterCount> volts{kNeutralVolts, kNeutralVolts, kNeutralVolts,
                                           kNeutralVolts};
};

}  // namespace turbidock
