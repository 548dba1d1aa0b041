#pragma once
// Logistic curves through binomial data, p = 1 / (1 + exp(-(intercept + slope x))): maximum
// likelihood with Firth's correction (Biometrika 80 (1993) 27), which is finite also when one value
// of x separates all successes from all failures.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "experiments/statistics/intervals.h"
#include "sim/base/result_fields.h"

namespace turbidock::statistics {

// Successes of trials at a value of what was varied.
struct BinomialPoint {
  double x = 0;
  int64_t successes = 0, trials = 0;
};

struct LogisticFit {
  double intercept = 0, slope = 0;
  double half_x = 0;    // where p = 1/2
  double half_low = 0;  // 95 % interval of half_x, from the curvature (delta method)
  double half_high = 0;

  TURBIDOCK_FIELDS(intercept, slope, half_x, half_low, half_high)
  double At(double x) const;
};
// Nothing when the values of x or the outcomes are all alike, or when the fitted curve does not
// cross 1/2 within the values of x.
std::optional<LogisticFit> FitLogistic(const std::vector<BinomialPoint>& points);

// How the log-odds of a success change with x. Interval and p are of the profile penalised
// likelihood, which with few successes or failures holds where Wald's does not (Heinze and
// Schemper, Stat. Med. 21 (2002) 2409).
struct LogisticSlope {
  double slope = 0;
  double low = 0, high = 0;  // 95 %
  double p = 1;              // two-sided, of no slope
};
// `clusters`, if not empty, has a number for each point: points of the same number have something
// in common that x does not say, such as a seed. The likelihood counts for less then: by the ratio
// of the slope's variance between clusters (a jackknife's) to the model's, if above 1 (after Rao
// and Scott, Ann. Stat. 12 (1984) 46), and Student's t has a degree of freedom less than clusters.
// Nothing of a single cluster, or when the values of x or the outcomes are all alike. A few
// thousand points take 50 ms.
//
// Measured: of 40 trials with few failures the interval holds the slope in 95 %, and p < 0.05 in 5
// % where there is none; of 20 seeds in 8 cells, which decide much, in 6 %, and in 32 % without
// clusters.
std::optional<LogisticSlope> FitSlope(const std::vector<BinomialPoint>& points,
                                      std::span<const int64_t> clusters = {});

}  // namespace turbidock::statistics
