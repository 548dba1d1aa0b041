#pragma once
// A thruster that fails while the vehicle is under way. (`vehicle.thrusters.effectiveness` is what
// it is like from the beginning, as the vehicle's data.)

#include <string>
#include <vector>

#include "sim/base/fault.h"
#include "sim/vehicle/thrusters.h"

namespace turbidock::vehicle {

struct ThrusterFault : FaultSpan {
  std::string thruster;
  double force_factor = 0;

  static void Fields(auto& self, auto&& field) {
    FaultSpan::Fields(self, field);
    field("thruster", self.thruster, Finite(),
          "name of the failing thruster: its motor's in the vehicle's MJCF");
    field("force_factor", self.force_factor, InRange(-1, 1),
          "share of its thrust that the failing thruster still gives: 0 blocked, between 0 and 1 "
          "weak, below 0 reversed, as with its leads exchanged");
  }
};

// A fault of the thruster with this number.
struct NumberedThrusterFault : ThrusterFault {
  size_t number = 0;
};
// Faults of thrusters of these names. ConfigError below `path` for a thruster that is none of them.
std::vector<NumberedThrusterFault> Numbered(const std::vector<ThrusterFault>& faults,
                                            const std::vector<std::string>& names,
                                            const std::string& path);

// What all faults together leave of each of so many thrusters.
ThrusterFactors FactorsAt(const std::vector<NumberedThrusterFault>& faults, size_t thrusters,
                          double time_s);

}  // namespace turbidock::vehicle
