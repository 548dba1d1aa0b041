#include "experiments/studies/gate/trial_runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "experiments/farm/keep_busy.h"
#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

constexpr double kTrialTimeLimit_s = 3600;

double MetricOf(const farm::TrialRecord& record, const std::string& name) {
  const auto found = std::find_if(record.metrics.begin(), record.metrics.end(),
                                  [&](const farm::Metric& metric) { return metric.first == name; });
  TD_CHECK(found != record.metrics.end() && found->second, "a trial has a " + name);
  return *found->second;
}

}  // namespace

GateTrial GateTrialOf(const farm::TrialRecord& record) {
  return {.seed = record.seed,
          .outcome = record.outcome,
          .time_s = record.time_s,
          .final_error_m = std::hypot(MetricOf(record, "final_error_true_x_m"),
                                      MetricOf(record, "final_error_true_y_m"),
                                      MetricOf(record, "final_error_true_z_m")),
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
  const auto take = [&](const farm::TrialRecord& record) {
    const GateRequest& request = requests[static_cast<size_t>(record.trial)];
    if (record.digest.empty())
      throw SimulatorFault(fmt::format("condition '{}', seed {}: the trial {}: {}\n{}",
                                       plan_.conditions[request.condition].name, request.seed,
                                       record.outcome, record.reason, record.log));
    trials[static_cast<size_t>(record.trial)] = GateTrialOf(record);
  };
  if (!farm::KeepBusy(&pool_, submit_one, take, [&] { return !stop(); })) return {};
  return trials;
}

}  // namespace turbidock::gate
