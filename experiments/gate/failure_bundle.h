#pragma once
// What is needed to look into a seed that docked before and no longer does.

#include <string>
#include <vector>

#include "experiments/gate/gate_plan.h"
#include "experiments/gate/judge.h"

namespace turbidock::experiments {

// Runs the trial once more, with video, into FOLDER/CONDITION_SEED/: the files of `turbidock run`
// (resolved.yaml holds scenario and seed, result.json the digest) and replay.txt, which says how to
// run it again. Returns that folder. SimulatorFault when the trial does not repeat bit for bit.
std::string WriteFailureBundle(const std::string& folder, const GateCondition& condition,
                               const std::vector<std::string>& assignments, const GateTrial& trial);

}  // namespace turbidock::experiments
