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

}  // namespace

std::vector<double> DockedValues(const std::vector<GateTrial>& trials, double GateTrial::*value) {
  std::vector<double> values;
  for (const GateTrial& trial : trials)
    if (trial.docked()) values.push_back(trial.*value);
  std::sort(values.begin(), values.end());
  return values;
}

// A quantity under test: two one-sided tests and what they have counted.
class ConditionJudge::Measure {
 public:
  Measure(std::string name, std::string unit, double margin) {
    report_.measure = std::move(name);
    report_.unit = std::move(unit);
    report_.margin = margin;
  }
  virtual ~Measure() = default;

  // `before` is null without pairs.
  void Add(const GateTrial& now, const GateTrial* before, int trials) {
    Count(now, before);
    if (decided()) return;
    if (const auto verdict = Decide()) {
      report_.verdict = *verdict;
      report_.decided_after_trials = trials;
    }
  }
  bool decided() const { return report_.decided_after_trials.has_value(); }
  const MeasureReport& report() const { return report_; }
  // The measure of some trials: a rate, a median.
  virtual std::optional<double> Summary(const std::vector<GateTrial>& trials) const = 0;

 protected:
  virtual void Count(const GateTrial& now, const GateTrial* before) = 0;
  virtual std::optional<statistics::Verdict> Decide() const = 0;

  MeasureReport report_;
};

// Success rate in pairs.
class ConditionJudge::PairedRateMeasure : public Measure {
 public:
  explicit PairedRateMeasure(const JudgeOptions& options)
      : Measure("success rate", "", options.margins.success_rate),
        test_(options.margins.success_rate, options.alpha, options.beta, options.max_trials) {}

  std::optional<double> Summary(const std::vector<GateTrial>& trials) const override {
    return SuccessRate(trials);
  }

 private:
  void Count(const GateTrial& now, const GateTrial* before) override {
    ++report_.compared;
    report_.worse += before->docked() && !now.docked();
    report_.better += !before->docked() && now.docked();
  }
  std::optional<statistics::Verdict> Decide() const override {
    return test_.Decide(report_.compared, report_.worse, report_.better);
  }

  statistics::PairedRateTest test_;
};

// Success rate against that of other seeds.
class ConditionJudge::RateMeasure : public Measure {
 public:
  RateMeasure(const std::string& condition, const JudgeOptions& options, int docked, int trials)
      : Measure("success rate", "", options.margins.success_rate),
        test_(Design(condition, options, docked, trials)) {}

  std::optional<double> Summary(const std::vector<GateTrial>& trials) const override {
    return SuccessRate(trials);
  }

 private:
  static statistics::RateTestDesign Design(const std::string& condition,
                                           const JudgeOptions& options, int docked, int trials) {
    // one-sided bounds at alpha / 2 and beta / 2
    const double low = statistics::ClopperPearsonInterval(docked, trials, 1 - options.alpha).low;
    const double high = statistics::ClopperPearsonInterval(docked, trials, 1 - options.beta).high;
    const double worse = high - options.margins.success_rate;
    if (!(worse < low) || worse <= 0)
      FailBaseline(
          condition,
          fmt::format("with other seeds than the baseline's, its {} of {} trials leave the "
                      "success rate in [{:.3f}, {:.3f}], too wide for a margin of {:g}",
                      docked, trials, low, high, options.margins.success_rate));
    // A rate of 1 exactly cannot be a null: any failure would disprove it.
    return {.no_worse = std::min(low, 1 - 1e-9),
            .worse = worse,
            .alpha = options.alpha / 2,
            .beta = options.beta / 2,
            .max_trials = options.max_trials};
  }
  void Count(const GateTrial& now, const GateTrial*) override {
    ++report_.compared;
    report_.worse += !now.docked();
    report_.better += now.docked();
  }
  std::optional<statistics::Verdict> Decide() const override {
    return test_.Decide(report_.compared, report_.better);
  }

  statistics::RateTest test_;
};

// Median of a quantity of the trials that docked, in pairs or against bounds of the baseline's
// median.
class ConditionJudge::MedianMeasure : public Measure {
 public:
  MedianMeasure(std::string name, std::string unit, double GateTrial::*value, double margin,
                const JudgeOptions& options, const std::string& condition,
                const std::vector<GateTrial>& baseline)
      : Measure(std::move(name), std::move(unit), margin),
        value_(value),
        fail_(statistics::SignTest(options.paired ? options.alpha : options.alpha / 2,
                                   options.max_trials)),
        pass_(statistics::SignTest(options.paired ? options.beta : options.beta / 2,
                                   options.max_trials)) {
    if (options.paired) return;
    const std::vector<double> values = DockedValues(baseline, value);
    const auto high = statistics::MedianRank(values.size(), options.alpha / 2);
    const auto low = statistics::MedianRank(values.size(), options.beta / 2);
    if (!high || !low)
      FailBaseline(condition, fmt::format("with other seeds than the baseline's, its {} docked "
                                          "trials are too few to bound the median {}",
                                          values.size(), report_.measure));
    median_high_ = values[*high - 1];
    median_low_ = values[values.size() - *low];
  }

  std::optional<double> Summary(const std::vector<GateTrial>& trials) const override {
    return statistics::Median(DockedValues(trials, value_));
  }

 private:
  void Count(const GateTrial& now, const GateTrial* before) override {
    if (!now.docked() || (before && !before->docked())) return;
    const double value = now.*value_;
    const double high = before ? before->*value_ : median_high_;
    const double low = before ? before->*value_ : median_low_;
    ++report_.compared;
    report_.worse += value > high;
    report_.better += value < high;
    equal_ += value == high;
    within_margin_ += value < low + report_.margin;
  }
  std::optional<statistics::Verdict> Decide() const override {
    if (fail_.Rejects(report_.compared - equal_, report_.worse)) return statistics::Verdict::kFail;
    if (pass_.Rejects(report_.compared, within_margin_)) return statistics::Verdict::kPass;
    return std::nullopt;
  }

  double GateTrial::*value_;
  double median_low_ = 0, median_high_ = 0;
  int equal_ = 0, within_margin_ = 0;
  statistics::HitTest fail_, pass_;
};

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
    measures_.push_back(std::make_unique<PairedRateMeasure>(options_));
  } else {
    measures_.push_back(std::make_unique<RateMeasure>(
        report_.name, options_, report_.baseline_docked, report_.baseline_trials));
  }
  const auto add_median = [&](const char* measure, const char* unit, double GateTrial::*value,
                              double margin) {
    if (margin > 0)
      measures_.push_back(std::make_unique<MedianMeasure>(measure, unit, value, margin, options_,
                                                          report_.name, baseline));
  };
  add_median("time to dock", "s", &GateTrial::time_s, options.margins.time_s);
  add_median("final true error", "m", &GateTrial::final_error_m, options.margins.final_error_m);
}

ConditionJudge::~ConditionJudge() = default;
ConditionJudge::ConditionJudge(ConditionJudge&&) noexcept = default;

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
  for (const auto& measure : measures_) {
    measure->Add(trial, before, trials());
    all_decided = all_decided && measure->decided();
    failed = failed || measure->report().verdict == statistics::Verdict::kFail;
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
  for (const auto& measure : measures_) {
    MeasureReport m = measure->report();
    report.verdict = Worst(report.verdict, m.verdict);
    m.before = measure->Summary(before);
    m.now = measure->Summary(report.trials);
    report.measures.push_back(std::move(m));
  }
  return report;
}

statistics::Verdict Worst(statistics::Verdict a, statistics::Verdict b) {
  if (a == statistics::Verdict::kFail || b == statistics::Verdict::kFail)
    return statistics::Verdict::kFail;
  if (a == statistics::Verdict::kInconclusive || b == statistics::Verdict::kInconclusive)
    return statistics::Verdict::kInconclusive;
  return statistics::Verdict::kPass;
}

}  // namespace turbidock::gate
