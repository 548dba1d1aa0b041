#include "experiments/batch/batch.h"

#include "experiments/batch/trial_scheduler.h"

namespace turbidock::batch {

BatchProgress RunBatch(const Plan& plan, RunOptions options,
                       const std::function<void(const BatchProgress&)>& on_progress,
                       ResultStore* store) {
  TrialScheduler scheduler = SchedulerOf(*store);
  BatchProgress progress;
  const auto count = [&] {
    progress.done = scheduler.done();
    progress.total = scheduler.Expected();
    progress.most = scheduler.most();
    progress.successes = scheduler.successes();
  };
  count();
  if (scheduler.complete()) return progress;
  options.time_limit_s = plan.settings().trial_time_limit_s;
  options.plugins = plan.plugins();
  options.on_progress = [&](const RunProgress& now) {
    static_cast<RunProgress&>(progress) = now;
    if (on_progress) on_progress(progress);
  };
  const auto add = [&](const StoredTrial& trial) {
    scheduler.Add(trial.trial, trial.record.success());
    count();
  };
  TrialRunner runner(options, store);
  runner.Run(SourceOf(plan), {.next = [&] { return scheduler.Next(); }, .add = add});
  return progress;
}

}  // namespace turbidock::batch
