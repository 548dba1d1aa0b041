#include "experiments/batch/batch.h"

#include <algorithm>
#include <utility>

namespace turbidock::batch {

TrialScheduler::TrialScheduler(const TrialRule& rule, const Shard& shard)
    : rule_(rule), shard_(shard), cells_(static_cast<size_t>(rule.cells)) {
  for (int64_t cell = 0; cell < rule_.cells; ++cell) {
    cells_of_shard_ += !rule_.precision || Owns(cell);
    cells_[static_cast<size_t>(cell)].strata.resize(static_cast<size_t>(rule_.strata));
    WantMore(cell);
  }
}

void TrialScheduler::WantMore(int64_t cell) {
  Cell& c = cells_[static_cast<size_t>(cell)];
  const int64_t before = std::exchange(c.wanted, std::min(c.wanted + rule_.batch, rule_.most));
  for (int64_t sample = before; sample < c.wanted; ++sample) {
    wanted_ += Owns(sample * rule_.cells + cell);
    done_ += c.Of(sample) != Result::kUnknown;
  }
  open_.push_back(cell);
}

void TrialScheduler::Decide(int64_t cell) {
  Cell& c = cells_[static_cast<size_t>(cell)];
  const bool is_narrow = statistics::StratifiedInterval(c.strata).half_width() <= *rule_.precision;
  if (!is_narrow && c.counted < rule_.most) return WantMore(cell);
  c.decided = true;
  reached_ += is_narrow;
}

void TrialScheduler::Add(int64_t trial, bool success) {
  if (trial < 0 || trial >= rule_.cells * rule_.most) return;  // no trial of the plan
  const int64_t cell = trial % rule_.cells, sample = trial / rule_.cells;
  Cell& c = cells_[static_cast<size_t>(cell)];
  if (sample >= std::ssize(c.results))
    c.results.resize(static_cast<size_t>(sample) + 1, Result::kUnknown);
  c.results[static_cast<size_t>(sample)] = success ? Result::kSuccess : Result::kFailure;
  successes_ += success;
  done_ += sample < c.wanted;
  if (!rule_.precision) return;
  while (!c.decided && c.Of(c.counted) != Result::kUnknown) {
    const Result result = c.Of(c.counted);
    statistics::Count& stratum = c.strata[static_cast<size_t>(c.counted % rule_.strata)];
    ++c.counted;
    ++stratum.trials;
    stratum.successes += result == Result::kSuccess;
    if (c.counted == c.wanted) Decide(cell);
  }
}

std::optional<int64_t> TrialScheduler::Next() {
  for (; !open_.empty(); open_.pop_front()) {
    const int64_t cell = open_.front();
    Cell& c = cells_[static_cast<size_t>(cell)];
    while (c.next < c.wanted) {
      const int64_t sample = c.next++, trial = sample * rule_.cells + cell;
      if (c.Of(sample) == Result::kUnknown && Owns(trial)) return trial;
    }
  }
  return std::nullopt;
}

int64_t TrialScheduler::most() const {
  return rule_.precision ? cells_of_shard_ * rule_.most : wanted_;
}

TrialScheduler SchedulerOf(const ResultStore& store) {
  TrialScheduler scheduler(RuleOf(store.header()), store.header().shard);
  for (const auto& [trial, success] : store.Successes()) scheduler.Add(trial, success);
  return scheduler;
}

BatchProgress RunBatch(const Plan& plan, RunOptions options,
                       const std::function<void(const BatchProgress&)>& on_progress,
                       ResultStore* store) {
  TrialScheduler scheduler = SchedulerOf(*store);
  const auto after = [&](const RunProgress& run) {
    return BatchProgress{run, scheduler.done(), scheduler.wanted(), scheduler.most(),
                         scheduler.successes()};
  };
  if (scheduler.complete()) return after({});
  options.time_limit_s = plan.settings().trial_time_limit_s;
  options.plugins = plan.plugins();
  options.on_progress = [&](const RunProgress& now) {
    if (on_progress) on_progress(after(now));
  };
  TrialRunner runner(options, store);
  runner.Run(SourceOf(plan), {.next = [&] { return scheduler.Next(); },
                              .add =
                                  [&](const StoredTrial& trial) {
                                    scheduler.Add(trial.trial, trial.record.success());
                                  }});
  return after(runner.progress());
}

}  // namespace turbidock::batch
