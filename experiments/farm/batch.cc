#include "experiments/farm/batch.h"

#include <optional>

#include "experiments/farm/trial_scheduler.h"

namespace turbidock::farm {
namespace {

// `progress` is what the decider knows; this run's part is filled in.
void Run(const Plan& plan, const TrialDecider& decider, const BatchOptions& options,
         BatchProgress* progress, ResultStore* store) {
  const auto report = [&](const RunProgress& now) {
    static_cast<RunProgress&>(*progress) = now;
    if (options.on_progress) options.on_progress(*progress);
  };
  TrialRunner runner({.farm = options.farm,
                      .time_limit_s = plan.settings().trial_time_limit_s,
                      .plugins = plan.plugins(),
                      .on_trial = options.on_trial,
                      .on_progress = report,
                      .stop_requested = options.stop_requested},
                     store);
  runner.Run(SourceOf(plan), decider);
}

}  // namespace

BatchProgress RunBatch(const Plan& plan, const BatchOptions& options, ResultStore* store) {
  TrialScheduler scheduler = SchedulerOf(*store);
  BatchProgress progress;
  const auto count = [&] {
    progress.done = scheduler.done();
    progress.total = scheduler.Expected();
    progress.most = scheduler.most();
    progress.successes = scheduler.successes();
  };
  count();
  const TrialDecider decider{.next = [&] { return scheduler.Next(); },
                             .add =
                                 [&](const StoredTrial& trial) {
                                   scheduler.Add(trial.trial, trial.record.success());
                                   count();
                                 }};
  if (!scheduler.complete()) Run(plan, decider, options, &progress, store);
  return progress;
}

void RunTrials(const Plan& plan, const std::vector<int64_t>& trials, const BatchOptions& options) {
  BatchProgress progress;
  progress.total = progress.most = std::ssize(trials);
  size_t next = 0;
  const TrialDecider decider{
      .next = [&] { return next < trials.size() ? std::optional(trials[next++]) : std::nullopt; },
      .add =
          [&](const StoredTrial& trial) {
            ++progress.done;
            progress.successes += trial.record.success();
          }};
  Run(plan, decider, options, &progress, nullptr);
}

}  // namespace turbidock::farm
