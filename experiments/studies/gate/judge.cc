#include "experiments/studies/gate/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

[[noreturn]] void FailBaseline(const std::string& name, const std::string& why) {
  throw ConfigError(name + ": " + why + "; measure the baseline with more trials");
}

std::optional<double> SuccessRate(const std::vector<GateTrial>& trials) {
  if (trials.empty()) return std::nullopt;
  const auto docked =
      std::count_if(trials.begin(), trials.end(), [](const GateTrial& t) { return t.docked(); });
  return static_cast<double>(docked) / static_cast<double>(trials.size());
}

Measure MakeMeasure(const char* name, const char* unit, bool less_is_worse, double margin) {
  Measure measure;
  measure.report.measure = name;
  measure.report.unit = unit;
  measure.report.less_is_worse = less_is_worse;
  measure.report.margin = margin;
  return measure;
}

// Success rate in pairs.
Measure PairedRate(const JudgeOptions& options) {
  Measure measure = MakeMeasure("success rate", "", true, options.margins.success_rate);
  measure.summary = SuccessRate;
  measure.count = [](const GateTrial& now, const GateTrial* before, Measure* m) {
    ++m->report.compared;
    m->report.worse += before->docked() && !now.docked();
    m->report.better += !before->docked() && now.docked();
  };
  const statistics::PairedRateTest test(options.margins.success_rate, options.alpha, options.beta,
                                        options.max_trials);
  measure.decide = [test](const Measure& m) {
    return test.Decide(m.report.compared, m.report.worse, m.report.better);
  };
  return measure;
}

// Success rate against that of other seeds.
Measure Rate(const std::string& condition, const JudgeOptions& options, int docked, int trials) {
  // one-sided bounds at alpha / 2 and beta / 2
  const double low = statistics::ClopperPearsonInterval(docked, trials, 1 - options.alpha).low;
  const double high = statistics::ClopperPearsonInterval(docked, trials, 1 - options.beta).high;
  const double margin = options.margins.success_rate, worse = high - margin;
  if (!(worse < low) || worse <= 0)
    FailBaseline(condition,
                 fmt::format("with other seeds than the baseline's, its {} of {} trials leave the "
                             "success rate in [{:.3f}, {:.3f}], too wide for a margin of {:g}",
                             docked, trials, low, high, margin));
  // A rate of 1 exactly cannot be a null: any failure would disprove it.
  const statistics::RateTest test({.no_worse = std::min(low, 1 - 1e-9),
                                   .worse = worse,
                                   .alpha = options.alpha / 2,
                                   .beta = options.beta / 2,
                                   .max_trials = options.max_trials});
  Measure measure = MakeMeasure("success rate", "", true, margin);
  measure.summary = SuccessRate;
  measure.count = [](const GateTrial& now, const GateTrial*, Measure* m) {
    ++m->report.compared;
    m->report.worse += !now.docked();
    m->report.better += now.docked();
  };
  measure.decide = [test](const Measure& m) {
    return test.Decide(m.report.compared, m.report.better);
  };
  return measure;
}

// Median of a quantity of the trials that docked, in pairs or against bounds of the baseline's
// median.
Measure MedianOf(const MedianMeasure& of, const JudgeOptions& options, const std::string& condition,
                 const std::vector<GateTrial>& baseline) {
  const auto worse_by = [of](const GateTrial& trial) { return of.sign * trial.quality.*of.value; };
  const double margin = options.margins.median.*of.value;
  double bound_low = 0, bound_high = 0;
  if (!options.paired) {
    std::vector<double> values;
    for (const GateTrial& trial : baseline)
      if (trial.docked()) values.push_back(worse_by(trial));
    std::sort(values.begin(), values.end());
    const auto high = statistics::MedianRank(values.size(), options.alpha / 2);
    const auto low = statistics::MedianRank(values.size(), options.beta / 2);
    if (!high || !low)
      FailBaseline(condition, fmt::format("with other seeds than the baseline's, its {} docked "
                                          "trials are too few to bound the median {}",
                                          values.size(), of.name));
    bound_high = values[*high - 1];
    bound_low = values[values.size() - *low];
  }
  Measure measure = MakeMeasure(of.name, of.unit, of.sign < 0, margin);
  measure.summary = [of](const std::vector<GateTrial>& trials) {
    return statistics::Median(DockedValues(trials, of.value));
  };
  measure.count = [=](const GateTrial& now, const GateTrial* before, Measure* m) {
    if (!now.docked() || (before && !before->docked())) return;
    const double high = before ? worse_by(*before) : bound_high;
    const double low = before ? worse_by(*before) : bound_low;
    const double value = worse_by(now);
    ++m->report.compared;
    m->report.worse += value > high;
    m->report.better += value < high;
    m->equal += value == high;
    m->within_margin += value < low + margin;
  };
  const double share = options.paired ? 1 : 0.5;
  const auto fail = statistics::SignTest(share * options.alpha, options.max_trials);
  const auto pass = statistics::SignTest(share * options.beta, options.max_trials);
  measure.decide = [fail, pass](const Measure& m) -> std::optional<statistics::Verdict> {
    const int compared = m.report.compared;
    if (fail.Rejects(compared - m.equal, m.report.worse)) return statistics::Verdict::kFail;
    if (pass.Rejects(compared, m.within_margin)) return statistics::Verdict::kPass;
    return std::nullopt;
  };
  return measure;
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

std::vector<double> DockedValues(const std::vector<GateTrial>& trials, double Quality::*value) {
  std::vector<double> values;
  for (const GateTrial& trial : trials)
    if (trial.docked()) values.push_back(trial.quality.*value);
  std::sort(values.begin(), values.end());
  return values;
}

ConditionJudge::ConditionJudge(std::string name, const JudgeOptions& options,
                               const std::vector<GateTrial>& baseline)
    : options_(options) {
  TD_CHECK(options.max_trials >= 1, "a verdict needs trials");
  if (baseline.empty()) FailBaseline(name, "the baseline has no trials");
  report_.name = std::move(name);
  report_.paired = options.paired;
  report_.baseline_trials = static_cast<int>(baseline.size());
  for (const GateTrial& trial : baseline) {
    report_.baseline_docked += trial.docked();
    baseline_[trial.seed] = trial;
  }
  if (report_.baseline_docked <= options.margins.success_rate * report_.baseline_trials)
    throw ConfigError(fmt::format(
        "{}: only {} of the baseline's {} trials docked; the success rate cannot fall by {:g}",
        report_.name, report_.baseline_docked, report_.baseline_trials,
        options.margins.success_rate));
  report_.baseline_interval_95 =
      statistics::WilsonInterval(report_.baseline_docked, report_.baseline_trials);
  if (options.paired) {
    options_.max_trials = std::min(options.max_trials, report_.baseline_trials);
    measures_.push_back(PairedRate(options_));
  } else {
    measures_.push_back(
        Rate(report_.name, options_, report_.baseline_docked, report_.baseline_trials));
  }
  for (const MedianMeasure& measure : kMedianMeasures)
    if (options.margins.median.*measure.value > 0)
      measures_.push_back(MedianOf(measure, options_, report_.name, baseline));
}

void ConditionJudge::Add(const GateTrial& trial) {
  if (done_) return;
  report_.trials.push_back(trial);
  report_.docked += trial.docked();
  const GateTrial* before = nullptr;
  if (options_.paired) {
    const auto found = baseline_.find(trial.seed);
    TD_CHECK(found != baseline_.end(), "a paired trial has a seed of the baseline");
    before = &found->second;
    if (before->docked() && !trial.docked()) report_.newly_failing_seeds.push_back(trial.seed);
    if (!before->docked() && trial.docked()) report_.newly_docking_seeds.push_back(trial.seed);
  }
  bool all_decided = true, failed = false;
  for (Measure& measure : measures_) {
    MeasureReport& report = measure.report;
    measure.count(trial, before, &measure);
    if (!report.decided_after_trials)
      if (const auto verdict = measure.decide(measure)) {
        report.verdict = *verdict;
        report.decided_after_trials = trials();
      }
    all_decided = all_decided && report.decided_after_trials;
    failed = failed || report.verdict == statistics::Verdict::kFail;
  }
  done_ = all_decided || failed || trials() >= options_.max_trials;
}

ConditionReport ConditionJudge::Report() const {
  ConditionReport report = report_;
  report.interval_95 = statistics::WilsonInterval(report.docked, trials());
  report.verdict = statistics::Verdict::kPass;
  // medians of the same trials that are compared: of the same seeds, when paired
  std::vector<GateTrial> before;
  for (const auto& [seed, trial] : baseline_) before.push_back(trial);
  if (options_.paired) {
    before.clear();
    for (const GateTrial& trial : report.trials) before.push_back(baseline_.at(trial.seed));
  }
  for (const Measure& measure : measures_) {
    MeasureReport m = measure.report;
    report.verdict = std::min(report.verdict, m.verdict);
    m.before = measure.summary(before);
    m.now = measure.summary(report.trials);
    report.measures.push_back(std::move(m));
  }
  return report;
}

std::vector<Look> ConditionJudge::Path() const {
  Measure rate = measures_.front();
  MeasureReport& now = rate.report;
  now.compared = now.worse = now.better = 0;
  const auto verdict_at = [&](int worse) {
    Measure other = rate;
    other.report.worse = worse;
    if (!options_.paired) other.report.better = now.compared - worse;
    return rate.decide(other);
  };
  std::vector<Look> path;
  for (int i = 0; i < std::max(trials(), options_.max_trials); ++i) {
    Look look{.trials = i + 1};
    if (i < trials()) {
      const GateTrial& trial = report_.trials[static_cast<size_t>(i)];
      rate.count(trial, options_.paired ? &baseline_.at(trial.seed) : nullptr, &rate);
      look.worse = now.worse;
    } else {
      ++now.compared;
    }
    // the more are worse, the nearer to failing
    const int most = now.compared - (options_.paired ? now.better : 0);
    const auto least = [&](auto holds) {
      int low = 0, high = most + 1;
      while (low < high) {
        const int middle = (low + high) / 2;
        holds(verdict_at(middle)) ? high = middle : low = middle + 1;
      }
      return low;
    };
    const int passes_below = least([](const auto& v) { return v != statistics::Verdict::kPass; });
    const int fails_at = least([](const auto& v) { return v == statistics::Verdict::kFail; });
    if (passes_below > 0) look.passes_at = passes_below - 1;
    if (fails_at <= most) look.fails_at = fails_at;
    path.push_back(look);
  }
  return path;
}

}  // namespace turbidock::gate
