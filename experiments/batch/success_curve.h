#pragma once
// Success over one varied quantity: rates with intervals, a fitted curve, and where it crosses one
// half.

#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/summary.h"

namespace turbidock::batch {

// The trials at one value.
struct SuccessPoint {
  double x = 0;
  GroupSummary trials;
};

// The trials that share the values of other keys.
struct SuccessCurve {
  std::string name;                            // those values; empty when there is only one curve
  std::vector<SuccessPoint> points;            // ascending
  std::optional<statistics::LogisticFit> fit;  // none when success never crosses 1/2
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

}  // namespace turbidock::batch
