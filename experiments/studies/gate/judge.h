#pragma once
// The verdict on one condition: its trials, one after another, against the baseline's.
//
// Measured are the success rate and, on trials that docked, kMedianMeasures. Each has a margin, the
// change for the worse that matters, and two one-sided tests (sequential_test.h): one rejects "no
// worse" and fails, the other rejects "worse by the margin" and passes.
//
// Trials are compared with the baseline's of the same seeds, in pairs:
//  - success rate: of the pairs in which one build docked and the other did not, "no worse" says
//    that at most half are losses (McNemar's test, sequential); NetLossTest passes;
//  - the others, in pairs that docked in both: "no worse" says that of the pairs that differ at
//    most half are worse; "worse by the margin" says that at most half are less than the margin
//    worse (two sequential sign tests, of the median difference). Where beta exceeds a test's share
//    of alpha, as it does by default, the second needs fewer pairs: what makes every trial worse by
//    less than the margin passes.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/statistics/intervals.h"
#include "experiments/statistics/sequential_test.h"
#include "experiments/studies/gate/baseline.h"
#include "sim/base/result_fields.h"

namespace turbidock::gate {

// One measure of a condition.
struct MeasureReport {
  std::string measure;  // "success rate", or one of kMedianMeasures
  std::string unit;     // "" of the success rate
  bool less_is_worse = false;
  double margin = 0;
  statistics::Verdict verdict = statistics::Verdict::kInconclusive;
  std::optional<int> decided_after_trials{};
  std::optional<double> before{}, now{};  // rate or median
  int compared = 0;                       // pairs
  int worse = 0, better = 0;              // of these

  TURBIDOCK_FIELDS(measure, unit, verdict, decided_after_trials, less_is_worse, margin, before, now,
                   compared, worse, better)
};

struct ConditionReport {
  std::string condition;  // its name
  statistics::Verdict verdict = statistics::Verdict::kInconclusive;
  int trials = 0, docked = 0;
  statistics::Interval interval_95;  // of the success rate, Wilson, 95 %
  int baseline_trials = 0, baseline_docked = 0;
  statistics::Interval baseline_interval_95;
  // Of success rate: the least loss that fails with a probability of 0.8 in a build that does as
  // the old one but for what it loses. Exact.
  std::optional<double> least_loss_seen;
  std::vector<MeasureReport> measures;  // of the success rate first
  std::vector<int64_t> newly_failing_seeds, newly_docking_seeds;

  std::vector<GateTrial> outcomes;  // that the verdict rests on, in their order

  TURBIDOCK_FIELDS(condition, verdict, trials, docked, interval_95, baseline_trials,
                   baseline_docked, baseline_interval_95, least_loss_seen, measures,
                   newly_failing_seeds, newly_docking_seeds, outcomes)
};

class ConditionJudge {
 public:
  // ConfigError when the baseline docks too rarely to get worse by the margin.
  ConditionJudge(const BaselineCondition& baseline, const JudgeOptions& options);

  // Counts the next trial, whose seed must be one of the baseline's. Ignored once done.
  void Add(const GateTrial& trial);
  // Something is worse, everything is known, or the trials allowed are spent.
  bool done() const { return done_; }
  int wanted() const { return done_ ? report_.trials : options_.max_trials; }  // as far as is known
  ConditionReport Report() const;

 private:
  // A median under test.
  struct Median {
    size_t of;  // kMedianMeasures
    statistics::SignTest fail, pass;
    int equal = 0, within_margin = 0;  // counted besides what is reported
  };

  void CountMedians(const GateTrial& before, const GateTrial& now);

  JudgeOptions options_;
  std::map<int64_t, GateTrial> baseline_;  // by seed
  statistics::PairedRateTest rate_test_;
  std::vector<Median> medians_;  // their reports follow that of the success rate
  ConditionReport report_;
  bool done_ = false;
};

}  // namespace turbidock::gate
