#include "experiments/studies/gate/trial_runner.h"

#include <fmt/format.h>

#include <utility>

#include "experiments/farm/keep_busy.h"
#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

constexpr double kTrialTimeLimit_s = 3600;

}  // namespace

GateTrial GateTrialOf(const trial::TrialRecord& record) {
  return {.seed = record.seed,
          .outcome = record.outcome,
          .time_s = record.time_s,
          .final_error_m = record.final_error_true.distance_m(),
          .digest = record.digest};
}

GateTrialRunner::GateTrialRunner(const GatePlan& plan, std::vector<std::string> assignments,
                                 int workers)
    : plan_(plan),
      assignments_(std::move(assignments)),
      pool_(workers, {.time_limit_s = kTrialTimeLimit_s}) {}

std::vector<GateTrial> GateTrialRunner::Run(const std::vector<GateRequest>& requests,
                                            const std::function<bool()>& stop) {
  size_t next = 0;
  const auto submit_one = [&] {
    if (next == requests.size()) return false;
    const GateRequest& request = requests[next];
    pool_.Submit(
        {.id = static_cast<int64_t>(next),
         .scenario = plan_.conditions[request.condition].Load(assignments_, request.seed)});
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
                                       plan_.conditions[request.condition].name, request.seed,
                                       NameOf(record.outcome), record.reason, record.log));
    trials[index] = GateTrialOf(record);
  };
  if (!farm::KeepBusy(&pool_, submit_one, take, [&] { return !stop(); })) return {};
  return trials;
}

}  // namespace turbidock::gate
