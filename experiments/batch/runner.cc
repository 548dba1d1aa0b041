#include "experiments/batch/runner.h"

#include <fmt/format.h>

#include <utility>

#include "experiments/batch/trial_job.h"

namespace turbidock::batch {

TrialSource SourceOf(const Plan& plan) {
  return {.spec = [&plan](int64_t trial) { return plan.Trial(trial); },
          .scenario = [&plan](const TrialSpec& spec) { return plan.ScenarioOf(spec); },
          .series_every_frames = plan.settings().series_every_frames};
}

TrialRunner::TrialRunner(const RunOptions& options, ResultStore* store)
    : options_(options),
      store_(store),
      pool_(MakePool(options.jobs, options.time_limit_s, TrialWork(options.plugins))) {
  if (!store_) return;
  const std::vector<int64_t> done = store_->Done();
  stored_.insert(done.begin(), done.end());
}

const StoredTrial* TrialRunner::Find(const TrialSpec& spec) {
  if (!stored_.contains(spec.trial)) return nullptr;
  if (!known_) {
    known_.emplace();
    for (StoredTrial& trial : store_->Trials()) known_->emplace(trial.trial, std::move(trial));
  }
  const StoredTrial& known = known_->at(spec.trial);
  if (known.parameters != spec.parameters || known.record.seed != spec.seed)
    throw MismatchError(
        fmt::format("trial {} in the file is not the one that this program would run", spec.trial));
  return &known;
}

bool TrialRunner::Run(const TrialSource& source, const TrialDecider& decider) {
  std::multimap<int64_t, TrialSpec> under_way;  // whoever asks twice gets a trial twice
  const auto submit_one = [&] {
    while (const std::optional<int64_t> trial = decider.next()) {
      TrialSpec spec = source.spec(*trial);
      if (const StoredTrial* known = Find(spec)) {
        decider.add(*known);
        continue;
      }
      pool_->Submit(TrialJob(*trial, source.scenario(spec), source.series_every_frames));
      under_way.emplace(*trial, std::move(spec));
      return true;
    }
    return false;
  };
  const auto take = [&](const JobResult& result) {
    TrialSpec spec = std::move(under_way.extract(result.id).mapped());
    FinishedTrial finished = FinishedTrialOf(result, spec.seed);
    const StoredTrial trial = {.trial = spec.trial,
                               .cell = spec.cell,
                               .sample = spec.sample,
                               .parameters = std::move(spec.parameters),
                               .record = std::move(finished.record),
                               .series = std::move(finished.series)};
    decider.add(trial);
    if (store_) store_->Add(trial);
    ++progress_.done_now;
    progress_.worker_time_s += trial.record.wall_time_s;
    if (options_.on_trial) options_.on_trial(trial);
  };
  return RunAll(pool_.get(), submit_one, take, [&] {
    progress_.wall_time_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    if (options_.on_progress) options_.on_progress(progress_);
    return !options_.stop_requested || !options_.stop_requested();
  });
}

}  // namespace turbidock::batch
