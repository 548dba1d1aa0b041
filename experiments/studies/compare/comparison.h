#pragma once
// Two result sets, pair by pair: trials of the same seed and parameters (batch/comparison.h).

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/comparison.h"
#include "experiments/batch/result_store.h"
#include "experiments/report/report.h"
#include "sim/base/result_fields.h"

namespace turbidock::compare {

// One of the sets; `file` stands for it in commands.
struct ComparedFile {
  const batch::ResultStore& store;
  std::string file;
};

struct ComparisonOptions {
  std::vector<std::string> by = {};      // parameters: more rows, for each of their values
  std::vector<std::string> ignore = {};  // parameters in which the sets are meant to differ
  trial::Plugins plugins = {};           // what their scenarios may choose besides ours
};

// A trial in both sets.
struct TrialPair {
  std::vector<batch::Parameter> parameters;  // that both sets have
  trial::TrialRecord a, b;
  int64_t trial_a = 0, trial_b = 0;  // their numbers
};

struct Comparison {
  std::string a, b, build_a, build_b;  // files, and the programs that wrote them
  ComparisonOptions options = {};
  batch::PlanDifferences differences = {};
  int64_t left_out_a = 0,
          left_out_b = 0;                // trials without a partner, or without an end of their own
  int64_t unended_a = 0, unended_b = 0;  // trials without an end of their own
  // Of all pairs, which the verdict is about, then group by group of options.by; success first.
  // What is significant is told among the rows of all pairs, and among those of the groups.
  std::vector<batch::Change> changes = {};
  // That such a test of as many pairs, as many of which differ by chance, shows with 80 % power.
  std::optional<double> least_difference_seen = {};
  std::vector<std::string> not_varied = {};  // groups of keys, in neither set nor between them
  std::vector<batch::Flip> flips = {};       // lost ones first

  const batch::Change& all() const { return changes.front(); }
  int64_t lost() const { return all().worse; }
  int64_t gained() const { return all().better; }

  TURBIDOCK_FIELDS(a, b, build_a, build_b, differences, left_out_a, left_out_b, unended_a,
                   unended_b, changes, least_difference_seen, not_varied, flips)
};

// Matches the trials that came to an end of their own and compares them. ConfigError when a trial
// would have several partners, when no trial has one, or for a parameter that is not there.
Comparison Compare(const ComparedFile& a, const ComparedFile& b, const ComparisonOptions& options);

// Its steps. The parameters of a pair are those that both sets vary and options do not ignore, and
// where several trials of a set share these and the seed, those in which they differ: the other
// set's trials have one value of each, from their scenario.
std::vector<TrialPair> PairTrials(const batch::ResultStore& a, const batch::ResultStore& b,
                                  const ComparisonOptions& options);
Comparison ComparePairs(const std::vector<TrialPair>& pairs, const ComparisonOptions& options);

report::Report ReportOf(const Comparison& comparison);

}  // namespace turbidock::compare
