#pragma once
// Two result sets, pair by pair: trials of the same seed and parameters.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/result_store.h"
#include "experiments/page/page.h"
#include "experiments/report/report.h"
#include "experiments/statistics/intervals.h"
#include "experiments/trial/plugins.h"
#include "sim/base/result_fields.h"

namespace turbidock::compare {

// One of the sets; `file` stands for it in commands.
struct ComparedFile {
  const batch::ResultStore& store;
  std::string file;
};

struct ComparisonOptions {
  std::vector<std::string> by = {};      // parameters: one group for each of their values
  std::vector<std::string> ignore = {};  // parameters in which the sets are meant to differ
};

// A trial in both sets.
struct TrialPair {
  std::vector<batch::Parameter> parameters;  // that both sets have
  trial::TrialRecord a, b;
  int64_t trial_a = 0, trial_b = 0;  // their numbers

  bool docked() const { return a.success() && b.success(); }
};

// A pair of which one side docked alone.
struct Flip {
  int64_t seed = 0, trial_a = 0, trial_b = 0;
  trial::Failure failure = trial::Failure::kNone;  // of the other side
  std::string parameters;                          // "sea.state=calm water.milk_ml_m3=20"
  std::vector<batch::Parameter> shared = {};       // these

  std::string Link() const;  // what opens both in a page
  TURBIDOCK_FIELDS(seed, trial_a, trial_b, failure, parameters)
};

inline constexpr const char* kDocked = "docked";

// One quantity over the pairs that share the values of some parameters: docking itself, a rate of
// all of them, or a metric of those that docked in both and have it.
struct Change {
  std::string group;   // "sea.state=calm", or "all" without parameters
  std::string metric;  // kDocked, or a metric's name
  int64_t pairs = 0;
  double a = 0, b = 0;                                // rate or median
  double difference = 0;                              // of b less a; the median of the pairs'
  std::optional<statistics::Interval> interval_95{};  // of the difference
  double p_value = 1;        // two-sided: McNemar's exact test, or the sign test, which is the same
  bool significant = false;  // among all rates, or all metrics, that are compared: Holm at 0.05
  std::vector<batch::Parameter> shared = {};  // those of the group

  bool is_rate() const { return metric == kDocked; }
  TURBIDOCK_FIELDS(group, metric, pairs, a, b, difference, interval_95, p_value, significant)
};

// What the two plans have of each key in which they differ; "-" where it is not there.
using Differences = std::map<std::string, std::array<std::string, 2>>;

struct Comparison {
  std::string a, b, build_a, build_b;  // files, and the programs that wrote them
  ComparisonOptions options = {};
  Differences differences = {};
  int64_t left_out_a = 0,
          left_out_b = 0;  // trials without a partner, or without an end of their own
  // Group by group, docking first; where there are several, at last the docking of all pairs.
  std::vector<Change> changes = {};
  Change all = {};  // that, also where there is one group
  // That such a test of as many pairs, as many of which differ by chance, shows with 80 % power.
  std::optional<double> least_difference_seen = {};
  std::vector<std::string> not_varied = {};  // groups of keys, in neither set nor between them
  std::vector<Flip> lost = {}, gained = {};  // docked in a only, in b only

  TURBIDOCK_FIELDS(a, b, build_a, build_b, differences, left_out_a, left_out_b, changes, all,
                   least_difference_seen, not_varied, lost, gained)
};

// Matches the trials that came to an end of their own and compares them. ConfigError when a trial
// would have several partners, when no trial has one, or for a parameter that is not there.
Comparison Compare(const ComparedFile& a, const ComparedFile& b, const ComparisonOptions& options);

// Its steps. The parameters of a pair are those that both sets have and options do not ignore.
std::vector<TrialPair> PairTrials(const batch::ResultStore& a, const batch::ResultStore& b,
                                  const ComparisonOptions& options);
// Groups and what is significant: among all rates, which are one family of tests, and among all
// metrics, another; docking is what it is about.
Comparison ComparePairs(const std::vector<TrialPair>& pairs, const ComparisonOptions& options);
// Of two resolved plans. A scenario in a plan counts as its keys.
Differences PlanDifferences(const std::string& a, const std::string& b);

report::Report ReportOf(const Comparison& comparison);
report::Section ChangeSection(const Comparison& comparison);  // of it
// Its report, in which a seed that flipped opens its trials in both sets, with so many bytes of
// their stored series. `plugins`: what their scenarios may choose besides ours.
page::Page PageOf(const Comparison& comparison, const ComparedFile& a, const ComparedFile& b,
                  const trial::Plugins& plugins = {}, int64_t series_bytes = 2'200'000);

}  // namespace turbidock::compare
