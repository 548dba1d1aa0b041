#include "experiments/batch/batch.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <utility>

#include "experiments/trial/identity.h"

namespace turbidock::batch {

TrialScheduler::TrialScheduler(const TrialRule& rule, const Shard& shard)
    : rule_(rule), shard_(shard), cells_(static_cast<size_t>(rule.cells)) {
  if (rule_.search) {
    lattices_.resize(static_cast<size_t>(rule_.unit_of(rule_.cells)));
    for (int64_t i = 0; i < std::ssize(lattices_); ++i)
      if (shard_.Has(i)) ++cells_of_shard_, ChooseRounds(i);
    return;
  }
  for (int64_t cell = 0; cell < rule_.cells; ++cell) {
    cells_of_shard_ += !rule_.precision || Owns(cell);
    cells_[static_cast<size_t>(cell)].strata.resize(static_cast<size_t>(rule_.strata));
    WantMore(cell, rule_.batch);
  }
}

void TrialScheduler::WantMore(int64_t cell, int64_t count) {
  Cell& c = cells_[static_cast<size_t>(cell)];
  const int64_t before = std::exchange(c.wanted, std::min(c.wanted + count, rule_.most));
  for (int64_t sample = before; sample < c.wanted; ++sample) {
    const bool is_known = c.Of(sample) != Result::kUnknown;
    wanted_ += Owns(sample * rule_.cells + cell);
    done_ += is_known;
    successes_ += c.Of(sample) == Result::kSuccess;
    if (!rule_.search) continue;
    Lattice& lattice = lattices_[static_cast<size_t>(rule_.unit_of(cell))];
    ++lattice.wanted;
    lattice.known += is_known;
  }
  open_.push_back(cell);
}

std::vector<int> TrialScheduler::NextRoundOf(int64_t lattice) const {
  const auto points = static_cast<size_t>(rule_.search->lattice.cells());
  std::vector<search::Tally> tallies(points);
  std::vector<int64_t> run(points);
  for (size_t i = 0; i < points; ++i) {
    const Cell& c = cells_[static_cast<size_t>(lattice) * points + i];
    run[i] = c.wanted;
    for (int64_t sample = 0; sample < c.wanted; ++sample) {
      tallies[i].trials += c.Of(sample) != Result::kNeither;
      tallies[i].successes += c.Of(sample) == Result::kSuccess;
    }
  }
  return search::NextRound(*rule_.search, tallies, std::move(run));
}

void TrialScheduler::ChooseRounds(int64_t lattice) {
  Lattice& l = lattices_[static_cast<size_t>(lattice)];
  if (l.decided) return;
  while (!l.decided && l.known == l.wanted) {
    const std::vector<int> cells = NextRoundOf(lattice);
    l.decided = cells.empty();
    for (const int cell : cells) WantMore(lattice * rule_.search->lattice.cells() + cell, 1);
  }
}

void TrialScheduler::Decide(int64_t cell) {
  Cell& c = cells_[static_cast<size_t>(cell)];
  const bool is_narrow = statistics::StratifiedInterval(c.strata).half_width() <= *rule_.precision;
  if (!is_narrow && c.counted < rule_.most) return WantMore(cell, rule_.batch);
  c.decided = true;
  reached_ += is_narrow;
}

void TrialScheduler::Add(int64_t trial, std::optional<bool> success) {
  if (trial < 0 || trial >= rule_.cells * rule_.most) return;  // no trial of the plan
  const int64_t cell = trial % rule_.cells, sample = trial / rule_.cells;
  Cell& c = cells_[static_cast<size_t>(cell)];
  if (sample >= std::ssize(c.results))
    c.results.resize(static_cast<size_t>(sample) + 1, Result::kUnknown);
  c.results[static_cast<size_t>(sample)] = !success   ? Result::kNeither
                                           : *success ? Result::kSuccess
                                                      : Result::kFailure;
  // what is not asked for yet counts once it is
  if (sample < c.wanted) ++done_, successes_ += success == true;
  if (rule_.search && sample < c.wanted) {
    const int64_t lattice = rule_.unit_of(cell);
    ++lattices_[static_cast<size_t>(lattice)].known;
    ChooseRounds(lattice);
  }
  if (!rule_.precision) return;
  while (!c.decided && c.Of(c.counted) != Result::kUnknown) {
    const Result result = c.Of(c.counted);
    statistics::Count& stratum = c.strata[static_cast<size_t>(c.counted % rule_.strata)];
    ++c.counted;
    stratum.trials += result != Result::kNeither;
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
  if (rule_.search) return std::max(wanted_, complete() ? 0 : cells_of_shard_ * rule_.search->most);
  return rule_.precision ? cells_of_shard_ * rule_.most : wanted_;
}

namespace {

std::string LabelOf(const StoredTrial& trial) {
  std::string label = fmt::format("trial {}", trial.trial);
  for (const Parameter& parameter : trial.parameters) label += ", " + parameter.Assignment();
  return label;
}

// What draws in these workers now, by what is asked for; nothing where that cannot be told.
class Renderers {
 public:
  explicit Renderers(const JobOptions& jobs) : jobs_(jobs) {}

  std::optional<std::string> Now(view::GlBackend asked) {
    // on a cluster it is its nodes' and comes with their results
    if (jobs_.slurm) return std::nullopt;
    const auto known = known_.try_emplace(asked);
    std::optional<std::string>& now = known.first->second;
    if (!known.second) return now;
    const Work ask{"renderer", [asked](const std::string&) {
                     std::string remark;
                     return view::MakeGlContext(asked, &remark)->description();
                   }};
    const auto pool = MakePool({.workers = 1, .fork = jobs_.fork}, kJobTimeLimit_s, ask);
    try {
      MapEach(
          pool.get(), {""}, [&](size_t, const std::string& text) { now = text; }, nullptr);
    } catch (const SimulatorFault&) {  // a trial that has to be drawn will say so
    }
    return now;
  }

 private:
  JobOptions jobs_;
  std::map<view::GlBackend, std::optional<std::string>> known_;
};

// Which stored trials are still those of the plan.
struct Kept {
  std::vector<ResultStore::Renumbered> numbers;
  std::string changed;  // of the first that is not: which, and what changed
};

// Why a trial's identity is another one.
std::string Cause(const std::string& change, const StoreHeader& before, const StoreHeader& now) {
  if (!change.empty()) return change;
  const std::string file = OtherFile(before, now);
  return file.empty() ? "its seed or its draws are others" : file;
}

Kept KeptOf(const ResultStore& store, const Plan& plan, const StoreHeader& header,
            Renderers* renderers) {
  Kept kept;
  const std::string change = ChangeOf(store.header(), header);
  // What decides no trial, but what is kept of it.
  const auto change_of = [&](const std::string& setting) {
    const std::string was = SettingOf(store.header(), setting), is = SettingOf(header, setting);
    return was == is ? "" : fmt::format("{}: {} then, {} now", setting, was, is);
  };
  const std::string series = change_of("series_every_frames"),
                    limit = change_of("trial_time_limit_s");
  for (const StoredTrial& trial : store.Trials()) {
    if (!trial.record.judged()) continue;  // runs again
    const std::optional<int64_t> number = plan.NumberOf(trial.parameters, trial.sample);
    if (!number) {
      const std::string seeds = change_of("seeds");
      throw OtherResults(
          store.file(),
          seeds + (seeds.empty() ? "" : ": ") + LabelOf(trial) + ", is not of this plan", "");
    }
    const TrialSpec spec = plan.Trial(*number);
    const trial::Scenario scenario = plan.ScenarioOf(spec);
    const std::string& drawn = trial.record.renderer;
    const std::string draws =
        drawn.empty() ? "" : renderers->Now(scenario.renderer).value_or(drawn);
    const bool is_same = spec.parameters == trial.parameters && spec.seed == trial.record.seed &&
                         trial::IdentityOf(scenario, header.build, draws) == trial.identity;
    const std::string other =
        !series.empty() || trial.record.outcome != trial::Outcome::kHung ? series : limit;
    if (is_same && other.empty())
      kept.numbers.push_back({.before = trial.trial, .trial = *number, .cell = spec.cell});
    else if (kept.changed.empty())
      kept.changed = LabelOf(trial) + ": " +
                     (draws != drawn ? fmt::format("it was drawn by {}, now by {}", drawn, draws)
                      : is_same      ? other
                                     : Cause(change, store.header(), header));
  }
  return kept;
}

}  // namespace

ResultStore OpenResults(const std::string& file, const Plan& plan, const Shard& shard, bool anew,
                        const JobOptions& jobs, const std::string& kind) {
  const StoreHeader header = HeaderOf(plan, shard, kind);
  ResultStore store = ResultStore::Open(file, header);
  const std::string difference = DifferenceOf(store.header(), header);
  if (!difference.empty() && shard.count > 1)
    throw OtherResults(file, difference + " (a part of a batch does not grow)", "");
  if (store.header().keys != header.keys) {
    if (!anew)
      throw OtherResults(
          file, fmt::format("its trials vary {}, these {}", fmt::join(store.header().keys, ", "),
                            fmt::join(header.keys, ", ")));
    store.Become(header, {});
    return store;
  }
  Renderers renderers(jobs);
  bool is_same = difference.empty() && store.header().plan == header.plan &&
                 store.Successes().size() == store.Done().size();
  if (is_same)
    store.ForEachRenderer([&](const std::string& drawn, int64_t trial) {
      const view::GlBackend asked = plan.ScenarioOf(plan.Trial(trial)).renderer;
      is_same = is_same && renderers.Now(asked).value_or(drawn) == drawn;
    });
  if (is_same) return store;
  const Kept kept = KeptOf(store, plan, header, &renderers);
  if (!kept.changed.empty() && !anew) throw OtherResults(file, kept.changed);
  store.Become(header, kept.numbers);
  return store;
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
  store->ForEachRenderer([&](const std::string& drawn, int64_t trial) {
    runner.RequireSameRenderer(trial, plan.ScenarioOf(plan.Trial(trial)).renderer, drawn);
  });
  runner.Run(SourceOf(plan), {.next = [&] { return scheduler.Next(); },
                              .add =
                                  [&](const StoredTrial& trial) {
                                    const trial::TrialRecord& r = trial.record;
                                    scheduler.Add(trial.trial, r.judged()
                                                                   ? std::optional(r.success())
                                                                   : std::nullopt);
                                  }});
  return after(runner.progress());
}

}  // namespace turbidock::batch
