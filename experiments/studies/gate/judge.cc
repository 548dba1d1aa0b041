#include "experiments/studies/gate/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

using statistics::Verdict;

int CountDocked(const std::vector<GateTrial>& trials) {
  return static_cast<int>(std::ranges::count_if(trials, &GateTrial::docked));
}

// The options as far as the baseline has trials to compare with. ConfigError for one that cannot
// get worse by the margin.
JudgeOptions OptionsWith(const std::vector<GateTrial>& baseline, const std::string& name,
                         JudgeOptions options) {
  TD_CHECK(options.max_trials >= 1 && !baseline.empty(), "a verdict needs trials");
  const int docked = CountDocked(baseline), trials = static_cast<int>(baseline.size());
  if (docked <= options.margins.success_rate * trials)
    throw ConfigError(fmt::format(
        "{}: only {} of the baseline's {} trials docked; the success rate cannot fall by {:g}",
        name, docked, trials, options.margins.success_rate));
  options.max_trials = std::min(options.max_trials, trials);
  return options;
}

statistics::PairedRateTest RateTest(const JudgeOptions& options) {
  return {options.margins.success_rate, options.alpha, options.beta, options.max_trials};
}

// Notes the verdict of a measure's test when it comes.
void Note(const std::optional<Verdict>& verdict, int trials, MeasureReport* report) {
  if (report->decided_after_trials || !verdict) return;
  report->verdict = *verdict;
  report->decided_after_trials = trials;
}

}  // namespace

Quality QualityOf(const trial::TrialRecord& record) {
  return {.time_s = record.time_s,
          .final_error_m = record.final_error_true.distance_m(),
          .returns_to_servoing = static_cast<double>(record.returns_to_servoing),
          .fitness = record.fitness_mean,
          .effort_v = record.effort_v};
}

int GateMargins::tests() const {
  return 1 + static_cast<int>(std::ranges::count_if(
                 kMedianMeasures, [&](const MedianMeasure& m) { return median.*m.value > 0; }));
}

TestSize SizeOf(const JudgeOptions& options) {
  const statistics::PairedRateTest test = RateTest(options);
  const auto unchanged = test.At(0);
  return {.margin = options.margins.success_rate,
          .alpha = options.alpha,
          .beta = options.beta,
          .max_trials = options.max_trials,
          .unchanged_trials = unchanged.expected_pairs,
          .passes_unchanged = unchanged.p_pass > 0,
          .worse_fails = test.At(options.margins.success_rate).p_fail,
          .least_loss_seen = test.LeastLossSeen(0.8)};
}

std::optional<double> DockedMedian(const std::vector<GateTrial>& trials, double Quality::*value) {
  std::vector<double> values;
  for (const GateTrial& trial : trials)
    if (trial.docked()) values.push_back(trial.quality.*value);
  return statistics::Median(std::move(values));
}

ConditionJudge::ConditionJudge(std::string name, const JudgeOptions& options,
                               const std::vector<GateTrial>& baseline)
    : options_(OptionsWith(baseline, name, options)),
      rate_test_(RateTest(options_)),
      rate_{.measure = "success rate",
            .unit = "",
            .less_is_worse = true,
            .margin = options.margins.success_rate} {
  for (const GateTrial& trial : baseline) baseline_[trial.seed] = trial;
  report_.name = std::move(name);
  report_.test = SizeOf(options_);
  report_.baseline_trials = static_cast<int>(baseline.size());
  report_.baseline_docked = CountDocked(baseline);
  report_.baseline_interval_95 =
      statistics::WilsonInterval(report_.baseline_docked, report_.baseline_trials);
  for (const MedianMeasure& of : kMedianMeasures) {
    const double margin = options.margins.median.*of.value;
    if (margin <= 0) continue;
    medians_.push_back({.of = of,
                        .report = {.measure = of.name,
                                   .unit = of.unit,
                                   .less_is_worse = of.sign < 0,
                                   .margin = margin},
                        .fail = {options.alpha, options_.max_trials},
                        .pass = {options.beta, options_.max_trials}});
  }
}

void ConditionJudge::Count(const GateTrial& before, const GateTrial& now) {
  ++rate_.compared;
  rate_.worse += before.docked() && !now.docked();
  rate_.better += !before.docked() && now.docked();
  if (before.docked() && !now.docked()) report_.newly_failing_seeds.push_back(now.seed);
  if (!before.docked() && now.docked()) report_.newly_docking_seeds.push_back(now.seed);
  if (!before.docked() || !now.docked()) return;
  for (Median& median : medians_) {
    const double was = median.of.sign * before.quality.*median.of.value;
    const double is = median.of.sign * now.quality.*median.of.value;
    ++median.report.compared;
    median.report.worse += is > was;
    median.report.better += is < was;
    median.equal += is == was;
    median.within_margin += is < was + median.report.margin;
  }
}

void ConditionJudge::Add(const GateTrial& trial) {
  if (done_) return;
  const auto before = baseline_.find(trial.seed);
  TD_CHECK(before != baseline_.end(), "a trial has a seed of the baseline");
  report_.trials.push_back(trial);
  report_.docked += trial.docked();
  Count(before->second, trial);
  Note(rate_test_.Decide(rate_.compared, rate_.worse, rate_.better), trials(), &rate_);
  bool all_decided = rate_.decided_after_trials.has_value();
  bool failed = rate_.verdict == Verdict::kFail;
  for (Median& median : medians_) {
    MeasureReport& report = median.report;
    if (median.fail.Rejects(report.compared - median.equal, report.worse))
      Note(Verdict::kFail, trials(), &report);
    else if (median.pass.Rejects(report.compared, median.within_margin))
      Note(Verdict::kPass, trials(), &report);
    all_decided = all_decided && report.decided_after_trials;
    failed = failed || report.verdict == Verdict::kFail;
  }
  done_ = all_decided || failed || trials() >= options_.max_trials;
}

ConditionReport ConditionJudge::Report() const {
  ConditionReport report = report_;
  report.interval_95 = statistics::WilsonInterval(report.docked, trials());
  report.path = Path();
  std::vector<GateTrial> before;  // of the same seeds
  for (const GateTrial& trial : report.trials) before.push_back(baseline_.at(trial.seed));
  report.measures = {rate_};
  if (trials() > 0) {
    report.measures[0].before = static_cast<double>(CountDocked(before)) / trials();
    report.measures[0].now = static_cast<double>(report.docked) / trials();
  }
  for (const Median& median : medians_) {
    MeasureReport& measure = report.measures.emplace_back(median.report);
    measure.before = DockedMedian(before, median.of.value);
    measure.now = DockedMedian(report.trials, median.of.value);
  }
  report.verdict = std::ranges::min(report.measures, {}, &MeasureReport::verdict).verdict;
  return report;
}

std::vector<Look> ConditionJudge::Path() const {
  std::vector<Look> path;
  int worse = 0, better = 0;
  for (int i = 0; i < options_.max_trials; ++i) {
    Look look{.trials = i + 1};
    if (i < trials()) {
      const GateTrial& now = report_.trials[static_cast<size_t>(i)];
      const GateTrial& before = baseline_.at(now.seed);
      worse += before.docked() && !now.docked();
      better += !before.docked() && now.docked();
      look.worse = worse;
    }
    for (int count = 0; count <= look.trials - better && !look.fails_at; ++count) {
      const auto verdict = rate_test_.Decide(look.trials, count, better);
      if (verdict == Verdict::kPass) look.passes_at = count;
      if (verdict == Verdict::kFail) look.fails_at = count;
    }
    path.push_back(look);
  }
  return path;
}

}  // namespace turbidock::gate
