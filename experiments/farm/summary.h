#pragma once
// Trials by groups: successes with intervals, times, errors, failures.

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "experiments/farm/result_store.h"
#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/statistics/intervals.h"
#include "sim/base/result_fields.h"

namespace turbidock::farm {

// 10 %, 50 % and 90 % quantile of the values that exist.
struct Spread {
  std::optional<double> q10, median, q90;
  int64_t count = 0;

  TURBIDOCK_FIELDS(count, q10, median, q90)
};

// Successes of trials, by stratum where the plan has strata and the trials are all of some cells:
// among trials that were chosen by what they drew, what differs between strata is chance, too.
class SuccessCount {
 public:
  explicit SuccessCount(bool whole_cells) : whole_cells_(whole_cells) {}

  void Add(const StoredTrial& trial);

  statistics::Count all() const;
  // Wilson's 95 % interval of the success rate, narrower by what the strata tell.
  statistics::Interval Wilson() const;

 private:
  bool whole_cells_;
  std::map<std::string, statistics::Count> strata_;  // by name
};

// Trials that share the values of the keys they are grouped by.
struct GroupSummary {
  std::vector<std::string> group;  // the keys' values
  int64_t trials = 0, successes = 0;
  statistics::Interval wilson;              // 95 %, of the success rate, over strata
  statistics::Interval clopper_pearson;     // the same, as if there were no strata
  Spread time_to_dock_s;                    // of the successes
  Spread error_true_y_m, error_true_z_m;    // absolute, when docked on the estimate
  Spread estimate_error_m;                  // distance of estimate and truth, of the successes
  std::map<std::string, int64_t> failures;  // by name; none left out

  TURBIDOCK_FIELDS(group, trials, successes, wilson, clopper_pearson, time_to_dock_s,
                   error_true_y_m, error_true_z_m, estimate_error_m, failures)
};

// "12 collision, 3 timeout": the most frequent first.
std::string FailureText(const GroupSummary& group);

// How far the estimated position is from the true one at the trial's end.
double EstimateError_m(const trial::TrialRecord& record);

// Whether values stand before others in a table: numbers in their order, before words in theirs.
bool LessByValue(const std::vector<std::string>& a, const std::vector<std::string>& b);

// Something that trials can be grouped by.
class GroupKey {
 public:
  // A parameter's key, "outcome", "failure", "cell" or a figure of a trial. ConfigError for any
  // other name. `example` is one of the trials: they all have the same parameters.
  GroupKey(const std::string& name, const StoredTrial& example);

  std::string ValueOf(const StoredTrial& trial) const { return value_(trial); }
  // Whether it tells cells or strata apart, not what their trials drew or how they went.
  bool is_planned() const { return is_planned_; }

 private:
  bool is_planned_ = false;
  std::function<std::string(const StoredTrial&)> value_;
};

// One group for each combination of values that occurs, numbers in ascending order. Without keys,
// one group of all.
std::vector<GroupSummary> Summarise(const std::vector<StoredTrial>& trials,
                                    const std::vector<std::string>& keys);

// The groups as a table; with a precision, also which groups have it.
report::Section GroupSection(const std::vector<std::string>& keys,
                             const std::vector<GroupSummary>& groups,
                             const std::optional<double>& precision = {});
// The same as a list of objects.
report::Json GroupsJson(const std::vector<std::string>& keys,
                        const std::vector<GroupSummary>& groups,
                        const std::optional<double>& precision = {});

}  // namespace turbidock::farm
