#pragma once
// From voltages by axis to voltages by thruster.

#include "control/axis_volts.h"
#include "sim/base/fields.h"
#include "sim/base/thruster_command.h"

namespace turbidock::control {

// Inverse of the thrusters' static curve, so that a demand gives thrust in proportion: over the
// dead band, then as the root of what the curve raises. It belongs here and not in a control law
// because the curve is each thruster's own: surge and yaw share two of them. Published is none of
// it (0 and 1).
struct AllocationParams {
  double dead_band_v = 0;
  double curve_exponent = 1;
  double ramp_v = 0.05;  // guess; several times the command's noise, so that it cannot chatter

  static void Fields(auto& self, auto&& field) {
    field("dead_band_v", self.dead_band_v, InRange(0, 1),
          "voltage added to every thruster's demand to cross its dead band; 0 as published");
    field("curve_exponent", self.curve_exponent, InRange(1, 4),
          "power of the voltage with which the thrusters' force grows; 1 as published");
    field("ramp_v", self.ramp_v, InRange(0.001, 1),
          "demand below which the voltage is proportional to the demand");
  }
};

// The part of a demand that the thrusters can give. Where surge and yaw, which share two thrusters,
// together ask for more than there is, yaw is kept first and surge gets what remains: a vehicle
// that loses its heading loses the marker. Allocate gives the same command for the demand and its
// part.
AxisVolts Attainable(const AllocationParams& params, const AxisVolts& axes);

// Surge thrusters: left = surge - yaw, right = surge + yaw; sway and heave have one thruster each.
// Every voltage of the result is in [0, 5].
ThrusterCommand Allocate(const AllocationParams& params, const AxisVolts& axes);

}  // namespace turbidock::control
