#pragma once
// Success over one varied quantity: rates with intervals, a fitted curve, and where it crosses one
// half.

#include <optional>
#include <string>
#include <vector>

#include "experiments/farm/result_store.h"
#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/statistics/intervals.h"

namespace turbidock::farm {

// How far the estimate was from the true position when trials ended in success: median and its
// 95 % interval (smallest and largest where there are too few).
struct PositionError {
  double median_m = 0;
  statistics::Interval interval_m;
};

// The trials at one value.
struct SuccessPoint : statistics::DosePoint {
  statistics::Interval wilson;              // 95 %, of the success rate over the plan's strata
  std::optional<PositionError> error = {};  // none without a success
};

// The trials that share the values of other keys.
struct SuccessCurve {
  std::string name;                            // those values; empty when there is only one curve
  std::vector<SuccessPoint> points;            // ascending
  std::optional<statistics::LogisticFit> fit;  // none when success never crosses 1/2

  // "falls to 50 % at 62.1 [58.3, 66]" or that it does not.
  std::string CrossingText() const;
};

// `over` is a key whose values are numbers; a curve for each combination of the values of `by`.
// ConfigError for a key that the trials do not have or that is no number.
std::vector<SuccessCurve> SuccessCurves(const std::vector<StoredTrial>& trials,
                                        const std::string& over,
                                        const std::vector<std::string>& by);

// Where each crosses one half, and a plot: rates with intervals and the fitted curves. Beside it
// the estimate's errors, if it has any.
report::Section SuccessSection(const std::string& over, const std::vector<std::string>& by,
                               const std::vector<SuccessCurve>& curves);
report::Json SuccessJson(const std::string& over, const std::vector<SuccessCurve>& curves);

}  // namespace turbidock::farm
