#include "experiments/statistics/intervals.h"

#include <algorithm>
#include <array>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "sim/base/check.h"

namespace turbidock::statistics {
namespace {

double TwoSidedZ(double confidence) {
  return boost::math::quantile(boost::math::normal(), (1 + confidence) / 2);
}

Count Sum(std::span<const Count> strata) {
  Count all;
  for (const Count& stratum : strata) {
    all.successes += stratum.successes;
    all.trials += stratum.trials;
  }
  return all;
}

}  // namespace

Interval WilsonInterval(int64_t successes, int64_t trials, double confidence) {
  return StratifiedInterval(std::array{Count{successes, trials}}, confidence);
}

Interval RateInterval(double rate, double trials, double confidence) {
  const double n = trials, z = TwoSidedZ(confidence);
  const double middle = (rate + z * z / (2 * n)) / (1 + z * z / n);
  const double half = z / (1 + z * z / n) * std::sqrt(rate * (1 - rate) / n + z * z / (4 * n * n));
  // At the ends the formula gives 0 and 1 but for rounding.
  return {rate == 0 ? 0 : std::max(0.0, middle - half),
          rate == 1 ? 1 : std::min(1.0, middle + half)};
}

double DesignEffect(std::span<const Count> strata) {
  const auto n = static_cast<double>(Sum(strata).trials);
  if (n == 0) return 1;
  double rate = 0, within = 0;
  for (const auto& [successes, trials] : strata) {
    const auto m = static_cast<double>(trials);
    const double p = (static_cast<double>(successes) + 0.5) / (m + 1);
    rate += m / n * p;
    within += m / n * p * (1 - p) * (m + 1) * (m + 1) / (m * m + m + 1);
  }
  return std::min(1.0, within / (rate * (1 - rate)));
}

Interval StratifiedInterval(std::span<const Count> strata, double confidence,
                            double cluster_effect) {
  TD_CHECK(0 < confidence && confidence < 1, "a confidence in (0, 1)");
  for (const auto& [successes, trials] : strata)
    TD_CHECK(0 <= successes && successes <= trials, "no more successes than trials");
  const Count all = Sum(strata);
  if (all.trials == 0) return {};
  // Of these counts, as if there were so many trials.
  const auto trials = static_cast<double>(all.trials);
  const double rate = static_cast<double>(all.successes) / trials;
  return RateInterval(rate, trials / (DesignEffect(strata) * cluster_effect), confidence);
}

double ClusterEffect(const std::vector<double>& values, const std::vector<int64_t>& units) {
  if (units.empty() || values.empty()) return 1;
  TD_CHECK(values.size() == units.size(), "every value has a unit");
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  std::map<int64_t, double> off;  // of the mean, by unit
  double squares = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    off[units[i]] += values[i] - mean;
    squares += (values[i] - mean) * (values[i] - mean);
  }
  if (off.size() == values.size()) return 1;
  const auto count = static_cast<double>(off.size());
  if (squares == 0 || off.size() == 1) return n / count;
  double clustered = 0;
  for (const auto& [unit, sum] : off) clustered += sum * sum;
  return std::max(1.0, count / (count - 1) * clustered / (n / (n - 1) * squares));
}

Interval SuccessInterval(std::span<const RatedTrial> trials, double confidence) {
  std::map<size_t, Count> by_stratum;
  for (const auto& [success, stratum, seed] : trials) {
    by_stratum[stratum].successes += success;
    ++by_stratum[stratum].trials;
  }
  std::vector<Count> strata;
  strata.reserve(by_stratum.size());
  for (const auto& [stratum, count] : by_stratum) strata.push_back(count);
  std::vector<double> off;  // of their stratum's rate
  std::vector<int64_t> seeds;
  for (const auto& [success, stratum, seed] : trials) {
    const auto& [successes, all] = by_stratum[stratum];
    off.push_back((success ? 1 : 0) - static_cast<double>(successes) / static_cast<double>(all));
    seeds.push_back(seed);
  }
  Interval interval = StratifiedInterval(strata, confidence, ClusterEffect(off, seeds));
  const std::set<int64_t> distinct(seeds.begin(), seeds.end());
  if (distinct.empty() || distinct.size() == seeds.size()) return interval;
  // Where all end alike each seed counts once: one other end must not make that surer.
  const auto count = static_cast<double>(distinct.size());
  interval.low = std::min(interval.low, RateInterval(1, count, confidence).low);
  interval.high = std::max(interval.high, RateInterval(0, count, confidence).high);
  return interval;
}

int64_t TrialsForHalfWidth(double half_width, double confidence) {
  TD_CHECK(0 < half_width && half_width <= 0.5, "a half width in (0, 1/2]");
  const double z = TwoSidedZ(confidence);
  return std::llround(std::ceil(z * z * (1 / (4 * half_width * half_width) - 1)));
}

std::optional<double> Quantile(std::vector<double> values, double share) {
  TD_CHECK(0 <= share && share <= 1, "a share in [0, 1]");
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  const double at = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<size_t>(at);
  const size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (at - static_cast<double>(below)) * (values[above] - values[below]);
}

std::optional<Interval> MedianInterval(std::vector<double> values, double confidence,
                                       double cluster_effect) {
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  const auto independent = std::max(
      size_t{1},
      static_cast<size_t>(std::lround(static_cast<double>(values.size()) / cluster_effect)));
  const boost::math::binomial below(static_cast<double>(independent), 0.5);
  // The least rank above the median with that probability, and the same from the other end.
  for (size_t k = independent / 2 + 1; k <= independent; ++k)
    if (boost::math::cdf(below, static_cast<double>(k - 1)) >= (1 + confidence) / 2) {
      const size_t rank = (k * values.size() + independent - 1) / independent;
      return Interval{values[values.size() - rank], values[rank - 1]};
    }
  return std::nullopt;
}

std::optional<double> LeastReaching(double value, const std::function<double(double)>& function) {
  double low = 0, high = 1;
  if (function(high) < value) return std::nullopt;
  while (high - low > 1e-4) {
    const double middle = (low + high) / 2;
    (function(middle) >= value ? high : low) = middle;
  }
  return high;
}

}  // namespace turbidock::statistics
