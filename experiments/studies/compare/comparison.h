#pragma once
// Two result sets, pair by pair: trials of the same seed and parameters.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "experiments/farm/result_store.h"
#include "experiments/statistics/intervals.h"
#include "experiments/trial/record_columns.h"
#include "sim/base/result_fields.h"

namespace turbidock::compare {

// A trial in both sets.
struct TrialPair {
  std::vector<farm::Parameter> parameters;  // that both sets have
  trial::TrialRecord a, b;
  int64_t trial_a = 0, trial_b = 0;  // their numbers
};

struct ComparisonOptions {
  std::vector<std::string> by;      // parameters: one group for each of their values
  std::vector<std::string> ignore;  // parameters in which the sets are meant to differ
};

// Matches the trials that came to an end of their own. ConfigError when a trial would have several
// partners, when no trial has one, or for a parameter that is not there.
std::vector<TrialPair> PairTrials(const farm::ResultStore& a, const farm::ResultStore& b,
                                  const ComparisonOptions& options);

// Success rates over pairs.
struct RateComparison {
  int64_t pairs = 0, lost = 0, gained = 0;  // success in a only, in b only
  double rate_a = 0, rate_b = 0;
  double difference = 0;             // of b less a
  statistics::Interval interval_95;  // of the difference, 95 %: Wald's with half a pair added to
                                     // each cell (Agresti and Min, Stat. Med. 24 (2005) 729)
  double p_value = 1;                // exact McNemar test, two-sided

  TURBIDOCK_FIELDS(pairs, rate_a, rate_b, difference, interval_95, p_value)
};
RateComparison CompareRates(const std::vector<TrialPair>& pairs);

// A metric over the pairs that succeeded in both and have it.
struct MetricComparison {
  std::string metric;
  int64_t pairs = 0, larger = 0, smaller = 0;  // in b
  std::optional<double> median_a, median_b;
  std::optional<double> median_difference;          // median of b less a, pair by pair
  std::optional<statistics::Interval> interval_95;  // of that median, from order statistics
  // Of the pairs that differ, of the share larger in b: Wilson's.
  statistics::Interval larger_share_interval_95;
  double p_value = 1;  // exact sign test, two-sided

  TURBIDOCK_FIELDS(metric, pairs, median_a, median_b, median_difference, interval_95, larger,
                   smaller, larger_share_interval_95, p_value)
};
MetricComparison CompareMetric(const std::vector<TrialPair>& pairs, const trial::Metric& metric);
// "final_error_m" (true distance from the desired pose) or one of trial::Metrics. ConfigError for
// any other name.
trial::Metric MetricNamed(const std::string& name);

// The pairs of which only a (lost) or only b succeeded.
std::vector<TrialPair> Flipped(const std::vector<TrialPair>& pairs, bool lost);

struct ComparisonGroup {
  std::vector<farm::Parameter> key;  // values of ComparisonOptions::by
  std::vector<TrialPair> pairs;
};
std::vector<ComparisonGroup> GroupPairs(const std::vector<TrialPair>& pairs,
                                        const std::vector<std::string>& by);

// "sea.state=calm", or "all" without parameters.
std::string GroupName(const ComparisonGroup& group);

// All of it as one JSON document; a and b stand for the sets.
std::string ComparisonJson(const std::string& name_a, const std::string& name_b,
                           const farm::ResultStore& a, const farm::ResultStore& b,
                           const std::vector<ComparisonGroup>& groups,
                           const std::vector<trial::Metric>& metrics);

// Draws success rates and their differences by group and both sets' times to dock into a file.
void WriteComparisonFigure(const std::string& path, const std::vector<ComparisonGroup>& groups,
                           const std::string& name_a, const std::string& name_b);

}  // namespace turbidock::compare
