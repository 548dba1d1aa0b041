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

// The record as one JSON document, two spaces indented, with a final newline; keys as in
// `list result-keys`. All units SI.
std::string ResultJson(const TrialRecord& record);

// What WriteRecords writes.
inline const std::vector<std::string> kRecordFiles = {"result.json", "resolved.yaml",
                                                      "trajectory.csv"};

// Writes result.json, resolved.yaml and trajectory.csv into an existing folder, each complete or
// not at all.
void WriteRecords(const std::string& folder, const Scenario& scenario, const TrialResult& result);

}  // namespace turbidock::trial
