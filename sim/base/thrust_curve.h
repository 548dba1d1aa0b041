#pragma once
// A thruster's static curve, from command voltage to thrust in still water, and its inverse: the
// vehicle has it, and its controller is told of it.

#include <string>
#include <vector>

#include "sim/base/fields.h"
#include "sim/base/thruster_command.h"

namespace turbidock {

// Thrust grows from a dead band about the neutral voltage as a power of the voltage, or as a
// measured table says. The defaults are the published vehicle's; sources: models/vehicle.yaml.
struct ThrustCurve {
  double max_thrust_newton = 4.9;
  double reverse_ratio = 0.9;
  double dead_band_volts = 0.19;
  double curve_exponent = 1;
  std::vector<double> table_volts;          // a measured curve instead of the four numbers above
  std::vector<double> table_thrust_newton;  // same length

  static void Fields(auto& self, auto&& field) {
    field("max_thrust_newton", self.max_thrust_newton, InRange(0, 1e4),
          "thruster: thrust at full forward voltage, in still water");
    field("reverse_ratio", self.reverse_ratio, InRange(0, 1),
          "thruster: ratio of the thrust at full reverse to that at full forward");
    field("dead_band_volts", self.dead_band_volts, InRange(0, 2.4),
          "thruster: deviation from the neutral voltage up to which it gives no thrust");
    field("curve_exponent", self.curve_exponent, InRange(0.5, 4),
          "thruster: exponent n of its thrust, which grows as the n-th power of the voltage beyond "
          "the dead band");
    field("table_volts", self.table_volts, InRange(0, kMaxVolts),
          "thruster: increasing voltages of a measured thrust curve, which replaces "
          "max_thrust_newton, reverse_ratio, dead_band_volts and curve_exponent");
    field("table_thrust_newton", self.table_thrust_newton, Finite(),
          "thruster: measured thrust at each of table_volts");
  }
  void Check(const std::string& path) const;  // the table's shape

  // What `volts` settles to. Voltages outside 0..5 saturate.
  double Thrust(double volts) const;
  // The voltage nearest to neutral that settles to this thrust, 0 or 5 where there is none; neutral
  // for no thrust.
  double Volts(double thrust_newton) const;
  double FullForward() const { return Thrust(kMaxVolts); }
  double FullReverse() const { return Thrust(0); }  // negative
};

}  // namespace turbidock
