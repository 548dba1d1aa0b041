#include "experiments/studies/gate/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "experiments/system/build_info.h"
#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

using statistics::Verdict;

constexpr const char* kKind = "gate";  // of its file of trials

// How a condition is judged, as far as the baseline has trials to compare with.
batch::JudgeOptions OptionsOf(const Condition& condition, const BaselineCondition& baseline,
                              const std::optional<EnvelopeShift>& shift) {
  batch::JudgeOptions options = condition.options();
  if (shift) {
    const double area = options.margins.area;
    if (shift->area() <= area)
      throw ConfigError(fmt::format(
          "{}: the baseline succeeds often enough in {:.3g} of the ranges; it cannot lose {:g}",
          condition.name, shift->area(), area));
    options.max_trials = baseline.trials;
    options.margins.success_rate =
        std::max(statistics::kLeastProbability, shift->SuccessLost(area));
  }
  if (baseline.successes <= options.margins.success_rate * baseline.trials)
    throw ConfigError(fmt::format(
        "{}: only {} of the baseline's {} trials succeeded; the success rate cannot fall by {:g}",
        condition.name, baseline.successes, baseline.trials, options.margins.success_rate));
  for (size_t i = 0; i < batch::kMeasures.size(); ++i)
    if (options.margins.medians[i] > 0 && !baseline.outcomes.empty() &&
        std::isnan(baseline.outcomes.front().values[i]))
      throw ConfigError(
          fmt::format("{}: the baseline has no {}; measure it anew with --update, or judge without",
                      condition.name, batch::kMeasures[i].name));
  for (const batch::ComparedTrial& trial : baseline.outcomes)
    if (std::ranges::count(condition.settings.never, trial.outcome) > 0)
      throw ConfigError(fmt::format(
          "{}: seed {} ends as {} in the baseline, which `never` forbids; leave that out, or "
          "measure a build of which none ends so",
          condition.name, trial.seed, NameOf(trial.outcome)));
  options.max_trials = std::min(options.max_trials, baseline.trials);
  return options;
}

// Trials that it takes a build to pass that does the same and always succeeds, up to so many.
int64_t TrialsToPass(batch::JudgeOptions options, int most) {
  options.max_trials = most;
  batch::PairedTrials same(options);
  batch::ComparedTrial trial{.outcome = trial::Outcome::kSuccess};
  trial.values.fill(0);
  while (!same.done()) same.Add(trial, trial);
  return same.verdict() == Verdict::kPass ? same.pairs() : most + 1;
}

// How the side that failed ended; of the baseline's trials no more than the outcome is kept.
std::string WhyFlipped(const batch::ComparedTrial& before, const trial::TrialRecord& now,
                       bool never) {
  if (never) return NameOf(now.outcome) + std::string(", as none may end");
  return now.success() ? NameOf(before.outcome) : NameOf(now.failure);
}

// What trials had otherwise than this gate's: "water.milk_ml_m3=20".
std::vector<std::string> SetOtherwise(const batch::StoreHeader& header, const Gate& gate) {
  std::vector<std::string> groups = {"scenario."};
  for (const Condition& condition : gate.conditions)
    groups.push_back("cases." + condition.name + ".");
  std::set<std::string> otherwise;  // a key that all conditions have is said once
  for (const auto& difference :
       batch::DifferencesOf(header.plan, batch::HeaderOf(gate.plan, {}, kKind).plan)) {
    const std::string& key = difference.first;
    if (key == batch::kFolderKey) continue;
    const auto group = std::ranges::find_if(
        groups, [&key](const std::string& name) { return key.starts_with(name); });
    const size_t begin = group == groups.end() ? 0 : group->size();
    otherwise.insert(key.substr(begin) + "=" + difference.second[0]);
  }
  return {otherwise.begin(), otherwise.end()};
}

}  // namespace

GateRun::GateRun(const Gate& gate, const std::optional<Baseline>& baseline)
    : gate_(gate), places_(PlacesOf(gate.plan)) {
  if (gate.plan.envelope() && !baseline)
    search_.emplace(batch::RuleOf(batch::HeaderOf(gate.plan, {}, kKind)), batch::Shard{});
  std::vector<BaselineCondition> known;
  if (baseline) {
    known = ConditionsOf(gate, *baseline);
    baseline_build_ = baseline->build;
  }
  for (size_t i = 0; i < gate.conditions.size(); ++i) {
    Running& running = running_.emplace_back();
    running.options = gate.conditions[i].options();
    running.least = running.options.max_trials;
    if (baseline) {
      running.baseline = known[i];
      if (gate.plan.envelope()) running.shift.emplace(gate.plan, known[i]);
      running.options = OptionsOf(gate.conditions[i], known[i], running.shift);
      running.pairs = batch::PairedTrials(running.options);
      batch::PairedTrials same(running.options);
      for (const batch::ComparedTrial& trial : known[i].outcomes) same.Add(trial, trial);
      running.least = same.pairs();
    }
    most_ = std::max<int64_t>(most_, running.options.max_trials);
  }
  most_ *= std::ssize(running_);
  std::vector<std::string> names;
  for (const Condition& condition : gate.conditions) names.push_back(condition.name);
  bundles_ = BundleNames(names);
}

bool GateRun::IsDone(const Running& condition) const {
  return failed_at_once_ || std::ssize(condition.trials) >= condition.options.max_trials ||
         (condition.baseline && condition.pairs.done());
}

int64_t GateRun::NumberOf(size_t condition, int64_t place) const {
  const auto& baseline = running_[condition].baseline;
  return gate_.plan.envelope() ? baseline->outcomes[static_cast<size_t>(place)].trial
                               : gate_.plan.NumberOf(static_cast<int64_t>(condition), place);
}

int64_t GateRun::PlaceOf(size_t condition, const batch::StoredTrial& trial) const {
  if (!gate_.plan.envelope()) return trial.sample;
  const auto& outcomes = running_[condition].baseline->outcomes;
  const auto found = std::ranges::find(outcomes, trial.trial, &batch::ComparedTrial::trial);
  if (found == outcomes.end())
    throw ConfigError(fmt::format("condition '{}': trial {} is none of the baseline's",
                                  gate_.conditions[condition].name, trial.trial));
  return found - outcomes.begin();
}

std::optional<int64_t> GateRun::Next() {
  if (search_) return search_->Next();
  const auto conditions = std::ssize(running_);
  while (asked_ < most_) {
    const int64_t turn = asked_++, place = turn / conditions;
    const auto condition = static_cast<size_t>(turn % conditions);
    const Running& running = running_[condition];
    if (!IsDone(running) && place < running.options.max_trials) return NumberOf(condition, place);
  }
  return std::nullopt;
}

void GateRun::Add(const batch::StoredTrial& trial) {
  const auto of = static_cast<size_t>(trial.cell / places_);
  if (!trial.record.ended())
    throw SimulatorFault(fmt::format("condition '{}', seed {}: the trial {}: {}\n{}",
                                     gate_.conditions.at(of).name, trial.record.seed,
                                     NameOf(trial.record.outcome), trial.record.reason,
                                     trial.record.printed));
  if (search_) {
    search_->Add(trial.trial, trial.record.success());
    running_[of].trials.push_back(trial);
    return;
  }
  const auto conditions = std::ssize(running_);
  early_.emplace(PlaceOf(of, trial) * conditions + static_cast<int64_t>(of), trial);
  for (; taken_ < most_; ++taken_) {
    const auto condition = static_cast<size_t>(taken_ % conditions);
    Running& running = running_[condition];
    const auto found = early_.extract(taken_);
    if (IsDone(running) || taken_ / conditions >= running.options.max_trials) continue;
    if (!found) return;
    Take(condition, found.mapped());
  }
}

void GateRun::Take(size_t condition, const batch::StoredTrial& trial) {
  Running& running = running_[condition];
  const batch::ComparedTrial compared = batch::TrialOf(trial.record);
  if (running.baseline) {
    const batch::ComparedTrial& before = running.baseline->outcomes.at(running.trials.size());
    if (before.seed != compared.seed)
      throw ConfigError(fmt::format("condition '{}': seed {} is none of the baseline's trial {}",
                                    gate_.conditions[condition].name, compared.seed,
                                    running.trials.size()));
    running.pairs.Add(before, compared);
    const auto& never = gate_.conditions[condition].settings.never;
    if (std::ranges::count(never, compared.outcome) > 0) {
      running.never_seeds.push_back(compared.seed);
      failed_at_once_ = true;
    }
  }
  running.trials.push_back(trial);
}

GateProgress GateRun::progress() const {
  if (search_) return {search_->done(), search_->wanted(), search_->most()};
  GateProgress progress;
  for (const Running& running : running_) {
    const int64_t done = std::ssize(running.trials);
    progress.done += done;
    progress.most += IsDone(running) ? done : running.options.max_trials;
    // A change costs trials, so many that nobody knows.
    progress.least += IsDone(running) ? done : std::max(running.least, done + 1);
  }
  return progress;
}

std::vector<std::string> GateRun::Remarks() const {
  constexpr int kMost = 10000;
  std::vector<std::string> remarks;
  if (search_) return remarks;  // looks for a baseline, which nothing has to pass
  for (size_t i = 0; i < running_.size(); ++i) {
    const batch::JudgeOptions& options = running_[i].options;
    if (TrialsToPass(options, options.max_trials) <= options.max_trials) continue;
    int allowed = options.max_trials;
    int64_t enough = allowed + 1;
    while (enough > allowed && allowed < kMost) {
      allowed = std::min(2 * allowed, kMost);
      enough = TrialsToPass(options, allowed);
    }
    remarks.push_back(
        fmt::format("condition '{}': {} trials are too few to pass, whatever they say; {}",
                    gate_.conditions[i].name, options.max_trials,
                    enough > allowed ? "no number would do" : fmt::format("{} would do", enough)));
  }
  return remarks;
}

void GateRun::Run(batch::RunOptions options, batch::ResultStore* store,
                  const std::function<void(const GateProgress&)>& on_trial) {
  options.plugins = gate_.plan.plugins();
  batch::TrialRunner runner(options, store);
  const auto add = [&](const batch::StoredTrial& trial) {
    Add(trial);
    if (on_trial) on_trial(progress());
  };
  if (!runner.Run(batch::SourceOf(gate_.plan), {.next = [this] { return Next(); }, .add = add}))
    throw batch::Stopped();
}

ConditionReport GateRun::ReportOf(size_t condition) const {
  const Running& running = running_[condition];
  const BaselineCondition& baseline = *running.baseline;
  ConditionReport report{.condition = gate_.conditions[condition].name,
                         .trials = std::ssize(running.trials),
                         .baseline_trials = baseline.trials,
                         .baseline_successes = baseline.successes,
                         .changes = running.pairs.Changes(gate_.conditions[condition].name),
                         .effects = batch::FailureEffects(running.trials),
                         .never_seeds = running.never_seeds};
  report.verdict = running.never_seeds.empty() ? *running.pairs.verdict() : Verdict::kFail;
  report.baseline_interval_95 = statistics::WilsonInterval(baseline.successes, baseline.trials);
  if (running.shift) {
    report.changes.push_back(AreaChange(*running.shift, report.changes.front()));
    const auto before = TrialsIn(baseline, gate_.plan);
    const batch::EnvelopeSummary both = BoundariesOf(gate_.plan, before, running.trials);
    report.envelope = EnvelopeJson(both);
    report.boundaries = EnvelopeSection(both);
    report.boundaries->title += ": " + report.condition;
  }
  report.smallest_loss_noticed =
      statistics::LeastLossSeen({.margin = running.options.margins.success_rate,
                                 .alpha = running.options.alpha,
                                 .beta = running.options.beta,
                                 .most = running.options.max_trials},
                                0.8);
  for (size_t i = 0; i < running.trials.size(); ++i) {
    const batch::StoredTrial& trial = running.trials[i];
    const batch::ComparedTrial now = batch::TrialOf(trial.record), &before = baseline.outcomes[i];
    report.outcomes.push_back(now);
    report.successes += now.success();
    const bool never = std::ranges::count(running.never_seeds, now.seed) > 0;
    if (before.success() == now.success() && !never) continue;
    report.flips.push_back({.seed = now.seed,
                            .change = before.success() ? batch::FlipKind::kLost
                                      : now.success()  ? batch::FlipKind::kGained
                                                       : batch::FlipKind::kForbidden,
                            .group = report.condition,
                            .why = WhyFlipped(before, trial.record, never),
                            .link = fmt::format("{}_{}", bundles_[condition], now.seed),
                            .trial_b = trial.trial});
  }
  report.interval_95 = statistics::WilsonInterval(report.successes, report.trials);
  return report;
}

GateReport GateRun::Report() const {
  GateReport report{.description = gate_.plan.settings().description,
                    .build = system::BuildId(),
                    .baseline_build = baseline_build_,
                    .alpha_covers = gate_.settings.alpha_covers,
                    .assignments = gate_.assignments};
  for (size_t i = 0; i < running_.size(); ++i) {
    report.conditions.push_back(ReportOf(i));
    report.verdict = std::min(report.verdict, report.conditions.back().verdict);
    // Bonferroni's bound, of what alpha covers.
    const batch::JudgeOptions& options = running_[i].options;
    const double tests = report.alpha_covers == AlphaCovers::kTest ? 1 : options.margins.tests();
    const double alpha = tests * options.alpha;
    report.alpha = report.alpha_covers == AlphaCovers::kGate ? report.alpha + alpha
                                                             : std::max(report.alpha, alpha);
    report.beta = std::max(report.beta, options.beta);
  }
  return report;
}

Baseline GateRun::Measured() const {
  Baseline baseline;
  baseline.build = system::BuildId();
  baseline.seed = gate_.plan.settings().master_seed;
  for (size_t i = 0; i < running_.size(); ++i) {
    const Condition& condition = gate_.conditions[i];
    BaselineCondition& c = baseline.conditions.emplace_back(BaselineCondition{
        .name = condition.name, .given = condition.given, .digest = condition.digest});
    for (const batch::StoredTrial& trial : running_[i].trials) {
      c.outcomes.push_back(batch::TrialOf(trial.record));
      if (search_) c.outcomes.back().trial = trial.trial;
    }
    // In an order that knows of no place: tests that look at trials one by one need that.
    if (search_) std::ranges::sort(c.outcomes, {}, &batch::ComparedTrial::seed);
    c.trials = static_cast<int>(std::ssize(c.outcomes));
    c.successes =
        static_cast<int>(std::ranges::count_if(c.outcomes, &batch::ComparedTrial::success));
    c.success_rate = static_cast<double>(c.successes) / c.trials;
    c.interval_95 = statistics::WilsonInterval(c.successes, c.trials).AsList();
  }
  return baseline;
}

batch::ResultStore OpenTrials(const std::string& file, const Gate& gate, bool anew,
                              const batch::JobOptions& jobs,
                              const std::function<void(const std::string&)>& say) {
  const batch::StoreHeader now = batch::HeaderOf(gate.plan, {}, kKind);
  // Made where there is none, or an empty one that a killed run left.
  const batch::StoreHeader before = batch::ResultStore::Open(file, now).header();
  if (before.build != now.build || before.code != now.code) {
    anew = true;
    say(fmt::format("{}: has trials of another program ({}): begun anew", file, before.build));
  }
  try {
    return batch::OpenResults(file, gate.plan, {}, anew, jobs, kKind);
  } catch (const batch::OtherResults& other) {
    if (!anew) throw ConfigError(fmt::format("{} (--anew: without its trials)", other.what()));
  }
  // The verdict is what counts: trials that the gate has no more are not missed.
  std::filesystem::remove(file);
  return batch::OpenResults(file, gate.plan, {}, anew, jobs, kKind);
}

GateReport ReportOfFile(const std::string& file, const Gate& gate, const Baseline& baseline) {
  const batch::ResultStore store = batch::ResultStore::Read(file);
  GateRun run(gate, baseline);
  for (batch::StoredTrial& trial : store.Trials()) {
    const auto number = gate.plan.NumberOf(trial.parameters, trial.sample);
    if (!number) throw ConfigError(file + ": has trials that are none of this gate");
    trial.trial = *number;
    trial.cell = gate.plan.Trial(*number).cell;
    run.Add(trial);
  }
  GateReport report = run.Report();
  report.build = store.header().build;
  report.assignments = SetOtherwise(store.header(), gate);
  return report;
}

}  // namespace turbidock::gate
