#include "experiments/farm/batch.h"

#include <algorithm>
#include <chrono>
#include <iterator>

#include "experiments/farm/keep_busy.h"

namespace turbidock::farm {
namespace {

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Runs the trials and hands each to `take`.
void Run(const Plan& plan, const std::vector<int64_t>& trials, const BatchOptions& options,
         BatchProgress* progress, const std::function<void(const StoredTrial&)>& take) {
  if (trials.empty()) return;
  const auto start = std::chrono::steady_clock::now();
  const auto most = static_cast<int64_t>(options.workers);
  TrialPool pool(static_cast<int>(std::min(most, std::ssize(trials))),
                 {.time_limit_s = plan.settings().trial_time_limit_s});
  size_t next = 0;
  const auto submit_one = [&] {
    if (next == trials.size()) return false;
    const TrialSpec spec = plan.Trial(trials[next++]);
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
  KeepBusy(&pool, submit_one, take_one, [&] {
    progress->wall_time_s = SecondsSince(start);
    if (options.on_progress) options.on_progress(*progress);
    return !options.stop_requested || !options.stop_requested();
  });
}

}  // namespace

BatchProgress RunBatch(const Plan& plan, const BatchOptions& options, ResultStore* store) {
  std::vector<int64_t> mine, missing;
  for (int64_t trial = 0; trial < plan.trials(); ++trial)
    if (store->header().shard.Has(trial)) mine.push_back(trial);
  const std::vector<int64_t> done = store->Done();
  std::set_difference(mine.begin(), mine.end(), done.begin(), done.end(),
                      std::back_inserter(missing));
  BatchProgress progress;
  progress.total = std::ssize(mine);
  progress.done = progress.total - std::ssize(missing);
  progress.successes = store->Successes();
  Run(plan, missing, options, &progress, [&](const StoredTrial& trial) { store->Add(trial); });
  return progress;
}

void RunTrials(const Plan& plan, const std::vector<int64_t>& trials, const BatchOptions& options) {
  BatchProgress progress;
  progress.total = std::ssize(trials);
  Run(plan, trials, options, &progress, [](const StoredTrial&) {});
}

}  // namespace turbidock::farm
