#include "experiments/statistics/paired_tests.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "sim/base/check.h"

namespace turbidock::statistics {
namespace {

double TwoSided(double tail) { return std::min(1.0, 2 * tail); }

// That McNemar's test says so where these shares of the pairs succeed in one alone.
double McNemarPower(int64_t pairs, double only_a, double only_b, double level) {
  using boost::math::binomial;
  const double differing = std::min(1.0, only_a + only_b);
  const double expected = static_cast<double>(pairs) * differing;
  const double far = 6 * std::sqrt(expected) + 10;  // what is farther off is too rare to count
  const auto first = static_cast<int64_t>(std::max(1.0, expected - far));
  const int64_t last = std::min(pairs, static_cast<int64_t>(expected + far));
  const binomial differ(static_cast<double>(pairs), differing);
  // The most on one side that are too few for chance; from below, since quantiles are rounded.
  const double start = boost::math::quantile(binomial(static_cast<double>(first), 0.5), level / 2);
  auto few = std::max<int64_t>(-1, static_cast<int64_t>(start) - 2);
  double power = 0;
  for (int64_t n = first; n <= last; ++n) {
    while (2 * few + 2 < n && McNemarExactP(few + 1, n - few - 1) <= level) ++few;
    if (few < 0) continue;
    const binomial a(static_cast<double>(n), only_a / (only_a + only_b));
    const auto at = static_cast<double>(few), above = static_cast<double>(n - few - 1);
    power += boost::math::pdf(differ, static_cast<double>(n)) *
             (boost::math::cdf(a, at) + boost::math::cdf(boost::math::complement(a, above)));
  }
  return power;
}

}  // namespace

PairedComparison ComparePairs(const std::vector<double>& a, const std::vector<double>& b,
                              const std::vector<int64_t>& units) {
  TD_CHECK(a.size() == b.size(), "pairs have two sides");
  PairedComparison result{.pairs = std::ssize(a),
                          .mean = 0,
                          .confidence = {-std::numeric_limits<double>::infinity(),
                                         std::numeric_limits<double>::infinity()}};
  if (a.empty()) return result;
  std::vector<double> differences(a.size());
  for (size_t i = 0; i < a.size(); ++i) differences[i] = b[i] - a[i];
  const auto n = static_cast<double>(a.size());
  result.mean = std::accumulate(differences.begin(), differences.end(), 0.0) / n;
  TD_CHECK(std::isfinite(result.mean), "differences are numbers");
  const auto independent =
      units.empty() ? a.size() : std::set<int64_t>(units.begin(), units.end()).size();
  result.seeds = static_cast<int64_t>(independent);
  if (independent < 2) return result;
  double squares = 0;
  for (const double d : differences) squares += (d - result.mean) * (d - result.mean);
  const double error = std::sqrt(squares / (n - 1) / n * ClusterEffect(differences, units));
  if (error == 0) {
    result.confidence = {result.mean, result.mean};
    result.t_p = result.mean == 0 ? 1 : 0;
    return result;
  }
  const boost::math::students_t t(static_cast<double>(independent) - 1);
  const double half = error * boost::math::quantile(t, 0.975);
  result.confidence = {result.mean - half, result.mean + half};
  result.t_p = TwoSided(boost::math::cdf(t, -std::abs(result.mean / error)));
  return result;
}

double McNemarExactP(int64_t only_a, int64_t only_b) {
  const int64_t n = only_a + only_b;
  if (n == 0) return 1;
  const boost::math::binomial half(static_cast<double>(n), 0.5);
  return TwoSided(boost::math::cdf(half, static_cast<double>(std::min(only_a, only_b))));
}

double SignFlipP(const std::vector<int64_t>& sums) {
  int64_t up = 0, down = 0, total = 0, largest = 0;
  std::vector<int64_t> sizes;  // of the units that differ
  double squares = 0;
  for (const int64_t sum : sums) {
    if (sum == 0) continue;
    ++(sum > 0 ? up : down);
    total += sum;
    sizes.push_back(std::abs(sum));
    largest = std::max(largest, sizes.back());
    squares += static_cast<double>(sum) * static_cast<double>(sum);
  }
  if (std::ranges::count(sizes, largest) == std::ssize(sizes)) return McNemarExactP(up, down);
  if (sizes.size() > 1000) {
    // Sums are two apart: by one corrected for continuity.
    const double z =
        (static_cast<double>(std::max<int64_t>(1, std::abs(total))) - 1) / std::sqrt(squares);
    return TwoSided(boost::math::cdf(boost::math::normal(), -z));
  }
  // How likely each sum of the sizes is that are up, where each is with a probability of 1/2.
  const int64_t all = std::accumulate(sizes.begin(), sizes.end(), int64_t{0});
  std::vector<double> p(static_cast<size_t>(all) + 1, 0);
  p[0] = 1;
  int64_t reached = 0;
  for (const int64_t size : sizes) {
    reached += size;
    for (int64_t at = reached; at >= 0; --at) {
      double& here = p[static_cast<size_t>(at)];
      here = (here + (at >= size ? p[static_cast<size_t>(at - size)] : 0)) / 2;
    }
  }
  double as_far = 0;
  for (int64_t at = 0; at <= all; ++at)
    if (std::abs(2 * at - all) >= std::abs(total)) as_far += p[static_cast<size_t>(at)];
  return std::min(1.0, as_far);
}

std::optional<double> LeastDifferenceSeen(int64_t pairs, double differing, double power,
                                          double level) {
  return LeastReaching(power, [&](double difference) {
    const double gained = std::max(0.0, (differing - difference) / 2);
    return McNemarPower(pairs, gained + difference, gained, level);
  });
}

Interval RateDifferenceInterval(double only_a, double only_b, double pairs) {
  const double lost = only_a + 0.5, gained = only_b + 0.5;
  const double total = pairs + 2, change = gained - lost;
  const double z = boost::math::quantile(boost::math::normal(), 0.975);
  const double half = z * std::sqrt(lost + gained - change * change / total) / total;
  return {std::max(-1.0, change / total - half), std::min(1.0, change / total + half)};
}

std::vector<bool> HolmSignificant(const std::vector<double>& p_values, double level) {
  std::vector<size_t> order(p_values.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, {}, [&](size_t i) { return p_values[i]; });
  std::vector<bool> significant(p_values.size(), false);
  for (size_t k = 0; k < order.size(); ++k) {
    if (p_values[order[k]] > level / static_cast<double>(order.size() - k)) break;
    significant[order[k]] = true;
  }
  return significant;
}

}  // namespace turbidock::statistics
