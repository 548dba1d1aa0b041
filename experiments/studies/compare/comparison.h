#pragma once
// Two result sets, pair by pair: trials of the same seed and parameters.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "experiments/farm/result_store.h"
#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/statistics/intervals.h"
#include "experiments/trial/record_columns.h"
#include "sim/base/result_fields.h"

namespace turbidock::compare {

// One of the sets; `file` stands for it in commands.
struct ComparedFile {
  const farm::ResultStore& store;
  std::string file;
};

struct ComparisonOptions {
  std::vector<std::string> by = {};       // parameters: one group for each of their values
  std::vector<std::string> ignore = {};   // parameters in which the sets are meant to differ
  std::vector<std::string> metrics = {};  // what is compared where both docked; empty: all
};

// A trial in both sets.
struct TrialPair {
  std::vector<farm::Parameter> parameters;  // that both sets have
  trial::TrialRecord a, b;
  int64_t trial_a = 0, trial_b = 0;  // their numbers

  bool lost() const { return a.success() && !b.success(); }
  bool gained() const { return !a.success() && b.success(); }
  trial::Failure failure() const { return lost() ? b.failure : a.failure; }  // of one that flipped
};

// Success rates over pairs.
struct RateComparison {
  int64_t pairs = 0, lost = 0, gained = 0;  // success in a only, in b only
  double rate_a = 0, rate_b = 0;
  double difference = 0;             // of b less a
  statistics::Interval interval_95;  // of the difference
  double p_value = 1;                // exact McNemar test, two-sided
  bool significant = false;          // among all rates that are compared, by Holm at 0.05

  TURBIDOCK_FIELDS(pairs, rate_a, rate_b, difference, interval_95, p_value, significant)
};

// A metric over the pairs that succeeded in both and have it.
struct MetricComparison {
  std::string metric;
  int64_t pairs = 0, larger = 0, smaller = 0;  // in b
  std::optional<double> median_a, median_b;
  std::optional<double> median_difference;          // median of b less a, pair by pair
  std::optional<statistics::Interval> interval_95;  // of that median, from order statistics
  // Of the pairs that differ, of the share larger in b: Wilson's.
  statistics::Interval larger_share_interval_95;
  double p_value = 1;        // exact sign test, two-sided
  bool significant = false;  // among all metrics that are compared, by Holm at 0.05

  TURBIDOCK_FIELDS(metric, pairs, median_a, median_b, median_difference, interval_95, larger,
                   smaller, larger_share_interval_95, p_value, significant)
};

// Pairs that share the values of some parameters.
struct ComparisonGroup {
  std::vector<farm::Parameter> key;  // values of ComparisonOptions::by
  std::vector<TrialPair> pairs;
  RateComparison docked = {};
  std::vector<MetricComparison> metrics = {};

  std::string Name() const;  // "sea.state=calm", or "all" without parameters
};

struct Comparison {
  std::string a, b, build_a, build_b;  // files, and the programs that wrote them
  ComparisonOptions options = {};
  std::vector<ComparisonGroup> groups;
  RateComparison all;  // of all pairs; where there are several groups, one row more

  bool has_several() const { return groups.size() > 1; }
};

// Matches the trials that came to an end of their own and compares them. ConfigError when a trial
// would have several partners, when no trial has one, or for a parameter or metric that is not
// there.
Comparison Compare(const ComparedFile& a, const ComparedFile& b, const ComparisonOptions& options);

// Its steps. The parameters of a pair are those that both sets have and options do not ignore.
std::vector<TrialPair> PairTrials(const farm::ResultStore& a, const farm::ResultStore& b,
                                  const ComparisonOptions& options);
std::vector<ComparisonGroup> GroupPairs(const std::vector<TrialPair>& pairs,
                                        const std::vector<std::string>& by);
RateComparison CompareRates(const std::vector<TrialPair>& pairs);
MetricComparison CompareMetric(const std::vector<TrialPair>& pairs, const trial::Metric& metric);
// "final_error_m" (true distance from the desired pose) or one of trial::Metrics. ConfigError for
// any other name.
trial::Metric MetricNamed(const std::string& name);
// Rates are one family of tests, all metrics another: docking is what it is about.
void MarkSignificant(Comparison* comparison);

// What it says to people. A seed that flipped is a link, LinkOf(its pair).
report::Report ReportOf(const Comparison& comparison);
std::string LinkOf(const TrialPair& pair);
// The numbers, which stand beside the report in its document.
report::Json ResultJson(const Comparison& comparison);

}  // namespace turbidock::compare
