#pragma once
// Runs a gate's trials in worker processes, and keeps them in a file so that a gate that was
// stopped goes on.

#include <functional>
#include <string>
#include <vector>

#include "experiments/farm/runner.h"
#include "experiments/studies/gate/gate.h"

namespace turbidock::gate {

// `assignments` are set in every scenario, on top of the conditions' own. The runner throws Stopped
// when the options' stop_requested says so, and SimulatorFault when a trial crashes or hangs or
// this machine cannot simulate: that is no verdict on docking. `store`, where trials are kept, may
// be null; it and `plan` must outlive the runner.
GateRunner MakeGateRunner(const GatePlan& plan, const std::vector<std::string>& assignments,
                          farm::RunOptions options, farm::ResultStore* store = nullptr);

// The file of a gate's trials, to be gone on with when they are of the same program, conditions,
// assignments and data. Trials of anything else say nothing about this build: the file is then
// begun anew, which `say` tells. ConfigError when something else is in the way.
farm::ResultStore OpenTrials(const std::string& file, const GatePlan& plan,
                             const std::vector<std::string>& assignments,
                             const std::function<void(const std::string&)>& say);

}  // namespace turbidock::gate
