#pragma once
// Success over one varied quantity: rates with intervals, a fitted curve, and where it falls to
// half.

#include <optional>
#include <string>
#include <vector>

#include "experiments/farm/result_store.h"
#include "experiments/statistics/intervals.h"

namespace turbidock::curve {

// How far the estimate was from the true position when a trial ended in success, over those of a
// dose: median and its 95 % interval (smallest and largest where there are too few).
struct ErrorPoint {
  double dose = 0, median_m = 0;
  statistics::Interval interval_m;
};

// The trials at one dose.
struct SuccessPoint : statistics::DosePoint {
  statistics::Interval wilson;  // 95 %, of the success rate over the plan's strata
};

// One curve: the trials that share a value of another key.
struct SuccessCurve {
  std::string name;                            // that value; empty when there is only one curve
  std::vector<SuccessPoint> points;            // ascending
  std::optional<statistics::LogisticFit> fit;  // nothing when success never falls through 1/2
  std::vector<ErrorPoint> errors;              // ascending; doses without a success have none
};

// `over` is a key whose values are numbers; `by` splits the trials into curves, empty for one.
// ConfigError for a key that the trials do not have or that is no number.
std::vector<SuccessCurve> SuccessCurves(const std::vector<farm::StoredTrial>& trials,
                                        const std::string& over, const std::string& by);

// A row a point and, below, where each curve falls to one half.
std::string SuccessTable(const std::string& over, const std::vector<SuccessCurve>& curves);
std::string SuccessJson(const std::string& over, const std::vector<SuccessCurve>& curves);

// Points with Wilson intervals and the fitted curves as a file, and beside them, if wanted, the
// estimate's errors. ConfigError when the path cannot be
// written, SimulatorFault when gnuplot is missing or fails.
void WriteSuccessFigure(const std::string& path, const std::string& title, const std::string& over,
                        const std::vector<SuccessCurve>& curves, bool with_errors = false);

}  // namespace turbidock::curve
