#pragma once
// Runs a gate's trials in worker processes.

#include <functional>
#include <string>
#include <vector>

#include "experiments/farm/farm.h"
#include "experiments/studies/gate/gate.h"

namespace turbidock::gate {

// Thrown by a runner when the caller asked to stop.
struct Stopped {};

// `assignments` are set in every scenario, on top of the conditions' own. The runner throws Stopped
// when `stop` says so, and SimulatorFault when a trial crashes or hangs or this machine cannot
// simulate: that is no verdict on docking. `plan` must outlive it.
GateRunner MakeGateRunner(const GatePlan& plan, const std::vector<std::string>& assignments,
                          const farm::FarmOptions& farm, const std::function<bool()>& stop,
                          double time_limit_s = 3600);

}  // namespace turbidock::gate
