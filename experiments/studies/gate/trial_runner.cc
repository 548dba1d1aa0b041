#include "experiments/studies/gate/trial_runner.h"

#include <fmt/format.h>

#include <memory>

#include "experiments/farm/trial_pool.h"
#include "sim/base/check.h"

namespace turbidock::gate {

GateRunner MakeGateRunner(const GatePlan& plan, const std::vector<std::string>& assignments,
                          const farm::FarmOptions& farm, const std::function<bool()>& stop,
                          double time_limit_s) {
  const auto pool = std::make_shared<farm::TrialPool>(farm, time_limit_s, plan.plugins);
  return [=, &plan](const std::vector<GateRequest>& requests) {
    size_t next = 0;
    const auto submit_one = [&] {
      if (next == requests.size()) return false;
      const GateRequest& request = requests[next];
      pool->Submit(
          {.id = static_cast<int64_t>(next),
           .scenario = plan.conditions[request.condition].Load(assignments, request.seed)});
      ++next;
      return true;
    };
    std::vector<GateTrial> trials(requests.size());
    const auto take = [&](const farm::FinishedTrial& finished) {
      const trial::TrialRecord& record = finished.record;
      const auto index = static_cast<size_t>(finished.id);
      const GateRequest& request = requests[index];
      if (!record.ended())
        throw SimulatorFault(fmt::format("condition '{}', seed {}: the trial {}: {}\n{}",
                                         plan.conditions[request.condition].name, request.seed,
                                         NameOf(record.outcome), record.reason, record.printed));
      trials[index] = {.seed = record.seed,
                       .outcome = record.outcome,
                       .quality = QualityOf(record),
                       .digest = record.digest};
    };
    if (!farm::RunAll(pool.get(), submit_one, take, [&] { return !stop(); })) throw Stopped();
    return trials;
  };
}

}  // namespace turbidock::gate
