#pragma once
// Real trials beside a gate's simulated ones: what rate is to be expected of the vehicle.

#include <optional>
#include <string>
#include <vector>

#include "experiments/report/report.h"
#include "experiments/statistics/prediction_powered.h"
#include "experiments/studies/gate/gate.h"

namespace turbidock::gate {

// Reads a CSV file with the columns condition and success (1 or 0), a row a real trial. Counts by
// condition of the gate; ConfigError with file and line for anything else.
std::vector<statistics::Count> LoadRealTrials(const std::string& file, const Gate& gate);

// Between which bounds the real success rate over the tried conditions is, by these and the gate's
// own trials of the same conditions (statistics/prediction_powered.h); none without such trials.
struct RealTrials {
  std::vector<statistics::Count> real, simulated;  // by condition
  std::optional<statistics::RealRate> rate;
  double p = 1;  // that the two differ, exact
};
RealTrials WithReal(const std::vector<statistics::Count>& real, const GateReport& report);
report::Section RealTrialSection(const RealTrials& trials, const GateReport& report);
report::Json RealTrialJson(const RealTrials& trials, const GateReport& report);

}  // namespace turbidock::gate
