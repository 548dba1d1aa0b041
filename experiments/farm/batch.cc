#include "experiments/farm/batch.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "experiments/farm/trial_pool.h"
#include "experiments/farm/trial_scheduler.h"

namespace turbidock::farm {
namespace {

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Runs up to `most` trials, those that `next` gives, and hands each to `take`.
void Run(const Plan& plan, int64_t most, const std::function<std::optional<int64_t>()>& next,
         const BatchOptions& options, BatchProgress* progress,
         const std::function<void(const StoredTrial&)>& take) {
  if (most == 0) return;
  const auto start = std::chrono::steady_clock::now();
  FarmOptions farm = options.farm;
  farm.workers = static_cast<int>(std::min<int64_t>(farm.workers, most));
  TrialPool pool(farm, plan.settings().trial_time_limit_s, plan.plugins());
  const auto submit_one = [&] {
    const std::optional<int64_t> trial = next();
    if (!trial) return false;
    const TrialSpec spec = plan.Trial(*trial);
    pool.Submit({.id = spec.trial,
                 .scenario = plan.ScenarioOf(spec),
                 .series_every_frames = plan.settings().series_every_frames});
    return true;
  };
  const auto take_one = [&](FinishedTrial finished) {
    const TrialSpec spec = plan.Trial(finished.id);
    const StoredTrial trial = {.trial = spec.trial,
                               .cell = spec.cell,
                               .sample = spec.sample,
                               .parameters = spec.parameters,
                               .record = std::move(finished.record),
                               .series_csv = std::move(finished.series_csv)};
    take(trial);
    ++progress->done;
    ++progress->done_now;
    progress->successes += trial.record.success();
    progress->worker_time_s += trial.record.wall_time_s;
    if (options.on_trial) options.on_trial(trial);
  };
  RunAll(&pool, submit_one, take_one, [&] {
    progress->wall_time_s = SecondsSince(start);
    if (options.on_progress) options.on_progress(*progress);
    return !options.stop_requested || !options.stop_requested();
  });
}

}  // namespace

BatchProgress RunBatch(const Plan& plan, const BatchOptions& options, ResultStore* store) {
  TrialScheduler scheduler = SchedulerOf(*store);
  BatchProgress progress{.done = scheduler.done(),
                         .total = scheduler.Expected(),
                         .most = scheduler.most(),
                         .successes = scheduler.successes()};
  const auto take = [&](const StoredTrial& trial) {
    store->Add(trial);
    scheduler.Add(trial.trial, trial.record.success());
    progress.total = scheduler.Expected();
  };
  if (!scheduler.complete())
    Run(
        plan, scheduler.most() - scheduler.done(), [&] { return scheduler.Next(); }, options,
        &progress, take);
  return progress;
}

void RunTrials(const Plan& plan, const std::vector<int64_t>& trials, const BatchOptions& options) {
  BatchProgress progress;
  progress.total = std::ssize(trials);
  size_t next = 0;
  const auto next_one = [&]() -> std::optional<int64_t> {
    if (next == trials.size()) return std::nullopt;
    return trials[next++];
  };
  Run(plan, progress.total, next_one, options, &progress, [](const StoredTrial&) {});
}

}  // namespace turbidock::farm
