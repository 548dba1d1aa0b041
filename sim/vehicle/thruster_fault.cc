#include "sim/vehicle/thruster_fault.h"

namespace turbidock::vehicle {

ThrusterFactors FactorsAt(const std::vector<ThrusterFault>& faults, double time_s) {
  ThrusterFactors factors = kSoundThrusters;
  for (const ThrusterFault& fault : faults)
    if (fault.Holds(time_s)) factors[static_cast<size_t>(fault.thruster)] *= fault.force_factor;
  return factors;
}

}  // namespace turbidock::vehicle
