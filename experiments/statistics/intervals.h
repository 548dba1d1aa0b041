#pragma once
// Numbers that summarise many trials: rates with intervals, quantiles, groups.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace turbidock::statistics {

// Bounds of a probability.
struct Interval {
  double low = 0, high = 1;

  double half_width() const { return (high - low) / 2; }
  std::array<double, 2> AsList() const { return {low, high}; }
};

// Two-sided intervals of the probability behind `successes` of `trials`, at a confidence in (0, 1);
// [0, 1] without trials.
// Wilson (1927): the score interval, close to the stated confidence on average.
Interval WilsonInterval(int64_t successes, int64_t trials, double confidence = 0.95);
// The same of a number of trials that need not be whole, above 0, and the share that succeeded.
Interval RateInterval(double rate, double trials, double confidence = 0.95);
// The least number of trials whose Wilson interval has no more than this half width (in (0, 1/2])
// where half of them succeed, which makes it the widest.
int64_t TrialsForHalfWidth(double half_width, double confidence = 0.95);

// Successes of trials.
struct Count {
  int64_t successes = 0, trials = 0;
};
// How much of the variance of a success rate is left where each stratum of a population was given
// trials in proportion to its size: that within the strata over that of all, in (0, 1]. Each
// stratum's rate with half a success and half a failure added (Jeffreys), so that one in which all
// or none succeeded has some; its variance is then without bias where half succeed, however few
// its trials. 1 of a single stratum and without trials.
double DesignEffect(std::span<const Count> strata);
// Wilson's interval of so many trials as would tell as much without strata: Korn and Graubard's
// (1998, Survey Methodology 24:193) effective number, without their correction for degrees of
// freedom, with Wilson's as in Franco et al. (2019, J. Survey Stat. Methodol. 7:334). Of a single
// stratum it is WilsonInterval.
Interval StratifiedInterval(std::span<const Count> strata, double confidence = 0.95,
                            double cluster_effect = 1);

// By how much more the mean of these numbers varies than that of as many which are independent (Rao
// and Scott, Biometrics 48 (1992) 577): 1 at least; the numbers a unit where none differs.
// `units`: to which unit each belongs; empty: each is one.
double ClusterEffect(const std::vector<double>& values, const std::vector<int64_t>& units);

// A trial that counts towards a success rate.
struct RatedTrial {
  bool success = false;
  size_t stratum = 0;
  int64_t seed = 0;
};
// StratifiedInterval of trials of which those of one seed, in several cells, are alike; it holds at
// least what as many trials as seeds leave open that all end alike.
Interval SuccessInterval(std::span<const RatedTrial> trials, double confidence = 0.95);

// The quantile of a share in [0, 1] by linear interpolation between order statistics (Hyndman and
// Fan's type 7, as in R and NumPy). Nothing without values.
std::optional<double> Quantile(std::vector<double> values, double share);
inline std::optional<double> Median(std::vector<double> values) {
  return Quantile(std::move(values), 0.5);
}

// The interval of the median behind the values, at that confidence at least, from order statistics.
// Nothing where there are too few (95 %: fewer than 6). `cluster_effect`: of values that do not
// vary each for itself.
std::optional<Interval> MedianInterval(std::vector<double> values, double confidence = 0.95,
                                       double cluster_effect = 1);

// Where a function that rises over [0, 1] reaches a value, to 1e-4; nothing where it does not.
std::optional<double> LeastReaching(double value, const std::function<double(double)>& function);

}  // namespace turbidock::statistics
