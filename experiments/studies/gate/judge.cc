#include "experiments/studies/gate/judge.h"

#include <fmt/format.h>

#include <algorithm>

#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

using statistics::Verdict;

// The options as far as the baseline has trials to compare with. ConfigError for one that cannot
// get worse by the margin.
JudgeOptions OptionsWith(const BaselineCondition& baseline, JudgeOptions options) {
  if (baseline.docked <= options.margins.success_rate * baseline.trials)
    throw ConfigError(fmt::format(
        "{}: only {} of the baseline's {} trials docked; the success rate cannot fall by {:g}",
        baseline.name, baseline.docked, baseline.trials, options.margins.success_rate));
  for (size_t i = 0; i < kMedianMeasures.size(); ++i)
    if (options.margins.medians[i] > 0 && !baseline.outcomes.empty() &&
        baseline.outcomes.front().values[i] == kNotMeasured)
      throw ConfigError(
          fmt::format("{}: the baseline has no {}; measure it anew with --update, or judge without",
                      baseline.name, kMedianMeasures[i].key));
  options.max_trials = std::min(options.max_trials, baseline.trials);
  return options;
}

// Of the trials that docked.
std::optional<double> DockedMedian(const std::vector<GateTrial>& trials, size_t measure) {
  std::vector<double> values;
  for (const GateTrial& trial : trials)
    if (trial.docked()) values.push_back(trial.values[measure]);
  return statistics::Median(std::move(values));
}

}  // namespace

ConditionJudge::ConditionJudge(const BaselineCondition& baseline, const JudgeOptions& options)
    : options_(OptionsWith(baseline, options)),
      rate_test_(options.margins.success_rate, options.alpha, options.beta, options_.max_trials) {
  for (const GateTrial& trial : baseline.outcomes) baseline_[trial.seed] = trial;
  report_.condition = baseline.name;
  report_.least_loss_seen = rate_test_.LeastLossSeen(0.8);
  report_.baseline_trials = baseline.trials;
  report_.baseline_docked = baseline.docked;
  report_.baseline_interval_95 = statistics::WilsonInterval(baseline.docked, baseline.trials);
  report_.measures = {{.measure = "success rate",
                       .unit = "",
                       .less_is_worse = true,
                       .margin = options.margins.success_rate}};
  for (size_t i = 0; i < kMedianMeasures.size(); ++i) {
    const MedianMeasure& of = kMedianMeasures[i];
    const double margin = options.margins.medians[i];
    if (margin == 0) continue;
    medians_.push_back({.of = i,
                        .fail = {options.alpha, options_.max_trials},
                        .pass = {options.beta, options_.max_trials}});
    report_.measures.push_back(
        {.measure = of.name, .unit = of.unit, .less_is_worse = of.sign < 0, .margin = margin});
  }
}

void ConditionJudge::CountMedians(const GateTrial& before, const GateTrial& now) {
  for (size_t i = 0; i < medians_.size(); ++i) {
    Median& median = medians_[i];
    MeasureReport& report = report_.measures[i + 1];
    const double sign = kMedianMeasures[median.of].sign;
    const double was = sign * before.values[median.of], is = sign * now.values[median.of];
    ++report.compared;
    report.worse += is > was;
    report.better += is < was;
    median.equal += is == was;
    median.within_margin += is < was + report.margin;
  }
}

void ConditionJudge::Add(const GateTrial& trial) {
  if (done_) return;
  const auto found = baseline_.find(trial.seed);
  TD_CHECK(found != baseline_.end(), "a trial has a seed of the baseline");
  const GateTrial& before = found->second;
  report_.outcomes.push_back(trial);
  ++report_.trials;
  report_.docked += trial.docked();
  MeasureReport& rate = report_.measures.front();
  ++rate.compared;
  if (before.docked() && trial.docked()) {
    CountMedians(before, trial);
  } else if (before.docked()) {
    ++rate.worse;
    report_.newly_failing_seeds.push_back(trial.seed);
  } else if (trial.docked()) {
    ++rate.better;
    report_.newly_docking_seeds.push_back(trial.seed);
  }
  const auto decide = [&](MeasureReport* measure, const std::optional<Verdict>& verdict) {
    if (measure->decided_after_trials || !verdict) return;
    measure->verdict = *verdict;
    measure->decided_after_trials = report_.trials;
  };
  decide(&rate, rate_test_.Decide(rate.compared, rate.worse, rate.better));
  for (size_t i = 0; i < medians_.size(); ++i) {
    const Median& median = medians_[i];
    MeasureReport& measure = report_.measures[i + 1];
    if (median.fail.Rejects(measure.compared - median.equal, measure.worse))
      decide(&measure, Verdict::kFail);
    else if (median.pass.Rejects(measure.compared, median.within_margin))
      decide(&measure, Verdict::kPass);
  }
  const auto count = [&](Verdict v) {
    return std::ranges::count(report_.measures, v, &MeasureReport::verdict);
  };
  done_ = count(Verdict::kFail) > 0 || count(Verdict::kInconclusive) == 0 ||
          report_.trials >= options_.max_trials;
}

ConditionReport ConditionJudge::Report() const {
  ConditionReport report = report_;
  report.interval_95 = statistics::WilsonInterval(report.docked, report.trials);
  std::vector<GateTrial> before;  // of the same seeds
  for (const GateTrial& trial : report.outcomes) before.push_back(baseline_.at(trial.seed));
  if (report.trials > 0) {
    const auto docked = std::ranges::count_if(before, &GateTrial::docked);
    report.measures[0].before = static_cast<double>(docked) / report.trials;
    report.measures[0].now = static_cast<double>(report.docked) / report.trials;
  }
  for (size_t i = 0; i < medians_.size(); ++i) {
    report.measures[i + 1].before = DockedMedian(before, medians_[i].of);
    report.measures[i + 1].now = DockedMedian(report.outcomes, medians_[i].of);
  }
  report.verdict = std::ranges::min(report.measures, {}, &MeasureReport::verdict).verdict;
  return report;
}

}  // namespace turbidock::gate
