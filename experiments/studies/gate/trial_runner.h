#pragma once
// Runs a gate's trials in worker processes.

#include <functional>
#include <string>
#include <vector>

#include "experiments/farm/trial_pool.h"
#include "experiments/studies/gate/gate.h"

namespace turbidock::gate {

GateTrial GateTrialOf(const trial::TrialRecord& record);

class GateTrialRunner {
 public:
  // `assignments` are set in every scenario, on top of the conditions' own.
  GateTrialRunner(const GatePlan& plan, std::vector<std::string> assignments, int workers);

  // Runs the trials. SimulatorFault when one crashes or hangs or this machine cannot simulate:
  // that is no verdict on docking. Gives up, with an incomplete list, when `stop` says so.
  std::vector<GateTrial> Run(const std::vector<GateRequest>& requests,
                             const std::function<bool()>& stop);

 private:
  const GatePlan& plan_;
  std::vector<std::string> assignments_;
  farm::TrialPool pool_;
};

}  // namespace turbidock::gate
