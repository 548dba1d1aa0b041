#pragma once
// What a trial leaves on disk: result.json, resolved.yaml, trajectory.csv.

#include <string>
#include <vector>

#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "experiments/trial/trial_view.h"

namespace turbidock::trial {

// The limits to draw in a scenario's pictures.
ViewCriteria CriteriaOf(const Scenario& scenario);

// What WriteRecords writes.
inline const std::vector<std::string> kRecordFiles = {"result.json", "resolved.yaml",
                                                      "trajectory.csv"};

// Writes result.json (keys as in `list result-keys`), resolved.yaml and trajectory.csv into a
// folder, which it makes when needed, each complete or not at all.
void WriteRecords(const std::string& folder, const Scenario& scenario, const TrialResult& result);

}  // namespace turbidock::trial
