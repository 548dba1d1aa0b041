#pragma once
// Trials by groups: successes with intervals, times, errors, failures; and success over one varied
// quantity, with a fitted curve and where it crosses one half.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/result_store.h"
#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/statistics/intervals.h"
#include "experiments/statistics/logistic.h"
#include "sim/base/result_fields.h"

namespace turbidock::batch {

// 10 %, 50 % and 90 % quantile of the values that exist.
struct Spread {
  std::optional<double> q10, median, q90;
  int64_t count = 0;

  TURBIDOCK_FIELDS(count, q10, median, q90)
};

// Trials that share the values of the keys they are grouped by.
struct GroupSummary {
  std::vector<std::string> group;  // the keys' values
  int64_t trials = 0, successes = 0;
  // 95 %, of the success rate, narrower by what the plan's strata tell where the groups are of
  // whole cells: among trials that were chosen by what they drew, what differs between strata is
  // chance, too. Trials of one seed in several cells are alike.
  statistics::Interval wilson;
  bool by_strata = false;                    // whether strata narrow it
  Spread time_to_dock_s;                     // of the successes
  Spread error_true_y_m, error_true_z_m;     // absolute, when docked on the estimate
  Spread estimate_error_m;                   // distance of estimate and truth, of the successes
  std::optional<double> false_confidence_s;  // mean over the trials that ended
  std::map<std::string, int64_t> failures;   // by name; none left out

  // NaN where no trial says whether it docks (TrialRecord::judged).
  double rate() const { return static_cast<double>(successes) / static_cast<double>(trials); }
  TURBIDOCK_FIELDS(group, trials, successes, wilson, time_to_dock_s, error_true_y_m, error_true_z_m,
                   estimate_error_m, false_confidence_s, failures)
};

// "12 collision, 3 timeout": the most frequent first.
std::string FailureText(const GroupSummary& group);

// What their intervals are: "95 %, Wilson's", and what makes them others than those.
std::string IntervalText(const std::vector<GroupSummary>& groups);

// What the word means (trial::FailureOf).
const char* MeaningOf(trial::Failure failure);
// A row for each that happened, with its meaning.
report::Section FailureTable(const GroupSummary& group);

// Whether values stand before others in a table: numbers in their order, before words in theirs.
bool LessByValue(const std::vector<std::string>& a, const std::vector<std::string>& b);

// One group for each combination of values that occurs, numbers in ascending order. Without keys,
// one group of all. A key is a parameter, "outcome", "failure" or "cell"; ConfigError for any
// other.
std::vector<GroupSummary> Summarise(const std::vector<StoredTrial>& trials,
                                    const std::vector<std::string>& keys);

// A parameter's key as people read it, by its last word and the group around that, as the page does
// (format.js): "current surface velocity y" in "m/s". And one of its values.
report::Quantity NameOfKey(const std::string& key);
std::string ValueText(const std::string& key, const std::string& value);

// The groups as a table; with a precision, also which groups have it.
report::Section GroupSection(const std::vector<std::string>& keys,
                             const std::vector<GroupSummary>& groups,
                             const std::optional<double>& precision = {});
// The same as a list of objects.
report::Json GroupsJson(const std::vector<std::string>& keys,
                        const std::vector<GroupSummary>& groups);

// The trials at one value.
struct SuccessPoint {
  double x = 0;
  GroupSummary trials;

  TURBIDOCK_FIELDS(x, trials)
};

// The trials that share the values of other keys.
struct SuccessCurve {
  std::string name;                       // those values; empty when there is only one curve
  std::vector<SuccessPoint> points = {};  // ascending
  std::optional<statistics::LogisticFit> fit = {};  // none when success never crosses 1/2

  TURBIDOCK_FIELDS(name, points, fit)
};

// `over` is a key whose values are numbers; a curve for each combination of the values of `by`.
// ConfigError for a key that the trials do not have or that is no number.
std::vector<SuccessCurve> SuccessCurves(const std::vector<StoredTrial>& trials,
                                        const std::string& over,
                                        const std::vector<std::string>& by);

// Where each crosses one half, and a plot: rates with intervals and the fitted curves.
report::Section SuccessSection(const std::string& over, const std::vector<std::string>& by,
                               const std::vector<SuccessCurve>& curves);

}  // namespace turbidock::batch
