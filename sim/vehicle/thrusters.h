#pragma once
// From command voltage to thrust: static curve, lag, rate limit, loss with inflow, faults.

#include <array>
#include <string>
#include <vector>

#include "sim/base/fields.h"
#include "sim/base/thruster_command.h"

namespace turbidock::vehicle {

// Newtons along each thruster's axis (forward, left, up), in the order of ThrusterCommand.
using ThrusterForces = std::array<double, kThrusterCount>;

// What faults leave of each thruster's thrust; below 0 it is driven the wrong way round.
using ThrusterFactors = std::array<double, kThrusterCount>;
inline constexpr ThrusterFactors kSoundThrusters{1, 1, 1, 1};

// One kind of thruster; the vehicle carries four. Sources of the numbers: models/vehicle.yaml.
struct ThrusterParams {
  double max_thrust_newton = 4.9;
  double reverse_ratio = 0.9;
  double dead_band_volts = 0.19;
  double curve_exponent = 1;
  std::vector<double> table_volts;          // a measured curve instead of the four numbers above
  std::vector<double> table_thrust_newton;  // same length
  double lag_s = 0.08;
  double rate_limit_newton_per_s = 0;
  double inflow_loss_s_per_m = 0.3;
  std::array<double, kThrusterCount> effectiveness{1, 1, 1, 1};

  static void Fields(auto& self, auto&& field) {
    field("max_thrust_newton", self.max_thrust_newton, InRange(0, 1e4),
          "thrust at full forward voltage, in still water");
    field("reverse_ratio", self.reverse_ratio, InRange(0, 1), "full reverse over full forward");
    field("dead_band_volts", self.dead_band_volts, InRange(0, 2.4),
          "no thrust within this distance of the neutral voltage");
    field("curve_exponent", self.curve_exponent, InRange(0.5, 4),
          "thrust grows as this power of the voltage beyond the dead band");
    field("table_volts", self.table_volts, InRange(0, kMaxVolts),
          "measured curve, increasing voltages; replaces the four values above when given");
    field("table_thrust_newton", self.table_thrust_newton, Finite(),
          "thrust at each voltage of the table");
    field("lag_s", self.lag_s, InRange(0, 10), "time constant of the first-order lag, 0: none");
    field("rate_limit_newton_per_s", self.rate_limit_newton_per_s, AtLeast(0),
          "fastest change of thrust, 0: no limit");
    field("inflow_loss_s_per_m", self.inflow_loss_s_per_m, InRange(0, 10),
          "share of the thrust lost per m/s of water entering the propeller");
    field("effectiveness", self.effectiveness, InRange(0, 1),
          "share of its thrust that each thruster still gives: 1 sound, 0 failed");
  }

  void Check(const std::string& path) const;  // the table's shape
};

// Thrust that `volts` settles to in still water, before a fault. Voltages outside 0..5 saturate.
double StaticThrust(const ThrusterParams& params, double volts);

// The state of the thruster group.
class Thrusters {
 public:
  explicit Thrusters(const ThrusterParams& params) : params_(params) {}

  void Reset();

  // Advances by dt_s under a constant command; exact for any step size. `inflow_mps` is the
  // velocity of each thruster through the water, along its axis. Returns thrust_newton().
  const ThrusterForces& Step(const ThrusterCommand& command, const ThrusterForces& inflow_mps,
                             double dt_s, const ThrusterFactors& factors = kSoundThrusters);

  const ThrusterForces& thrust_newton() const { return thrust_newton_; }

 private:
  ThrusterParams params_;
  ThrusterForces lagged_newton_{};  // what the propellers would give in still water
  ThrusterForces thrust_newton_{};
};

}  // namespace turbidock::vehicle
