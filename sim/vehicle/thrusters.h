#pragma once
// From command voltage to thrust: dead time, static curve, lag, rate limit, loss with inflow,
// faults.

#include <deque>
#include <string>
#include <vector>

#include "sim/base/fields.h"
#include "sim/base/thrust_curve.h"
#include "sim/base/thruster_command.h"

namespace turbidock::vehicle {

// Newtons along each thruster's axis.
using ThrusterForces = PerThruster;

// What faults leave of each thruster's thrust; below 0 it is driven the wrong way round. Empty: all
// are sound.
using ThrusterFactors = PerThruster;

// What a thruster is like. Sources of the numbers: models/vehicle.yaml. At rest a propeller's
// thrust is K_T rho D^4 |n| n at n turns a second (Fossen, Handbook of Marine Craft, 2011).
struct ThrusterKind : ThrustCurve {
  double lag_s = 0.08;
  double lag_power = 1;
  double dead_time_s = 0;
  double rate_limit_newton_per_s = 0;
  double inflow_loss_s_per_m = 0.3;

  static void Fields(auto& self, auto&& field) {
    ThrustCurve::Fields(self, field);
    field("lag_s", self.lag_s, InRange(0, 10),
          "thruster: time constant of the thrust's first-order lag; 0: none");
    field("lag_power", self.lag_power, InRange(0.5, 4),
          "thruster: exponent n of the lag, which acts on the n-th root of the thrust: 1 the "
          "thrust itself, 2 the propeller's speed, whose square the thrust is");
    field("dead_time_s", self.dead_time_s, InRange(0, 1),
          "thruster: dead time from a command until the thrust follows");
    field("rate_limit_newton_per_s", self.rate_limit_newton_per_s, AtLeast(0),
          "thruster: fastest change of thrust; 0: no limit");
    field("inflow_loss_s_per_m", self.inflow_loss_s_per_m, InRange(0, 10),
          "thruster: share of the thrust lost per m/s of water entering the propeller");
  }
};

// One that is not like the others; all of it is given.
struct IndividualThruster : ThrusterKind {
  std::string thruster;

  static void Fields(auto& self, auto&& field) {
    field("thruster", self.thruster, Finite(),
          "name of the thruster that differs: its motor's in the vehicle's MJCF");
    ThrusterKind::Fields(self, field);
  }
};

// The vehicle's thrusters: their kind, and those that differ.
struct ThrusterParams : ThrusterKind {
  std::vector<double> effectiveness;  // empty: all are sound
  std::vector<IndividualThruster> individual;

  static void Fields(auto& self, auto&& field) {
    ThrusterKind::Fields(self, field);
    field("effectiveness", self.effectiveness, InRange(0, 1),
          "share of its thrust that each thruster still gives, in the order of the motors in the "
          "MJCF: 1 sound, 0 failed; empty: all sound");
    field("individual", self.individual, Finite(),
          "thrusters that differ from the others; a key left out has the default of this list, not "
          "the others' value");
  }

  // What the thrusters of these names are, in their order. ConfigError below `path` for one that is
  // named here only, and where there are not as many values as thrusters.
  std::vector<ThrusterKind> Of(const std::vector<std::string>& names,
                               const std::string& path) const;
  // How effective they are; Of must have passed.
  PerThruster Effectiveness(size_t thrusters) const;
};

// Names in a sentence: "sway, heave".
std::string Listed(const std::vector<std::string>& names);

// The state of the thruster group.
class Thrusters {
 public:
  // One of each kind. As many effectivenesses.
  Thrusters(std::vector<ThrusterKind> kinds, const PerThruster& effectiveness);

  void Reset();

  // Advances by dt_s under a constant command; exact for any step size that divides the dead time.
  // `inflow_mps` is the velocity of each thruster through the water, along its axis. Returns
  // thrust_newton().
  const ThrusterForces& Step(const ThrusterCommand& command, const PerThruster& inflow_mps,
                             double dt_s, const ThrusterFactors& factors = {});

  const ThrusterForces& thrust_newton() const { return thrust_newton_; }

 private:
  struct Sent {
    double at_s;
    PerThruster volts;
  };

  // What each thruster follows now.
  PerThruster Heard(const PerThruster& volts, double dt_s);

  std::vector<ThrusterKind> kinds_;
  PerThruster effectiveness_;
  double longest_dead_time_s_ = 0;
  double now_s_ = 0;
  std::deque<Sent> sent_;         // as far back as the longest dead time
  PerThruster lagged_;            // thrust to the power of 1 / lag_power, with its sign
  ThrusterForces lagged_newton_;  // what the propellers would give in still water
  ThrusterForces thrust_newton_;
};

}  // namespace turbidock::vehicle
