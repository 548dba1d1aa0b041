#pragma once
// A thruster that fails while the vehicle is under way. (`vehicle.thrusters.effectiveness` is what
// it is like from the beginning, as the vehicle's data.)

#include <vector>

#include "sim/base/fault.h"
#include "sim/vehicle/thrusters.h"

namespace turbidock::vehicle {

enum class ThrusterName { kSurgeLeft, kSurgeRight, kSway, kHeave };  // in ThrusterCommand's order
constexpr auto Names(ThrusterName) {
  using enum ThrusterName;
  return EnumList<ThrusterName>({{kSurgeLeft, "surge_left"},
                                 {kSurgeRight, "surge_right"},
                                 {kSway, "sway"},
                                 {kHeave, "heave"}});
}

struct ThrusterFault : FaultSpan {
  ThrusterName thruster = ThrusterName::kSurgeLeft;
  double force_factor = 0;

  static void Fields(auto& self, auto&& field) {
    FaultSpan::Fields(self, field);
    field("thruster", self.thruster, Finite(), "which one");
    field("force_factor", self.force_factor, InRange(-1, 1),
          "share of its thrust that it still gives: 0 blocked, between 0 and 1 weak, below 0 "
          "reversed, as with its leads exchanged");
  }
};

// What all faults together leave of each thruster.
ThrusterFactors FactorsAt(const std::vector<ThrusterFault>& faults, double time_s);

}  // namespace turbidock::vehicle
