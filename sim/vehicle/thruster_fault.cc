#include "sim/vehicle/thruster_fault.h"

#include <algorithm>

namespace turbidock::vehicle {

std::vector<NumberedThrusterFault> Numbered(const std::vector<ThrusterFault>& faults,
                                            const std::vector<std::string>& names,
                                            const std::string& path) {
  std::vector<NumberedThrusterFault> numbered;
  for (size_t i = 0; i < faults.size(); ++i) {
    const auto at = std::find(names.begin(), names.end(), faults[i].thruster);
    if (at == names.end())
      throw ConfigError(JoinKey(path, "thrusters[" + std::to_string(i) + "].thruster"),
                        "'" + faults[i].thruster + "', must be one of " + Listed(names));
    numbered.push_back({faults[i], static_cast<size_t>(at - names.begin())});
  }
  return numbered;
}

ThrusterFactors FactorsAt(const std::vector<NumberedThrusterFault>& faults, size_t thrusters,
                          double time_s) {
  ThrusterFactors factors(thrusters, 1.0);
  for (const NumberedThrusterFault& fault : faults)
    if (fault.Holds(time_s)) factors[fault.number] *= fault.force_factor;
  return factors;
}

}  // namespace turbidock::vehicle
