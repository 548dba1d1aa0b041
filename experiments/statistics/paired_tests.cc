#include "experiments/statistics/paired_tests.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <numeric>

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

PairedComparison ComparePairs(const std::vector<double>& a, const std::vector<double>& b) {
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
  if (a.size() < 2) return result;
  double squares = 0;
  for (const double d : differences) squares += (d - result.mean) * (d - result.mean);
  const double error = std::sqrt(squares / (n - 1) / n);
  if (error == 0) {
    result.confidence = {result.mean, result.mean};
    result.t_p = result.mean == 0 ? 1 : 0;
    return result;
  }
  const boost::math::students_t t(n - 1);
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

std::optional<double> LeastDifferenceSeen(int64_t pairs, double differing, double power,
                                          double level) {
  return LeastReaching(power, [&](double difference) {
    const double gained = std::max(0.0, (differing - difference) / 2);
    return McNemarPower(pairs, gained + difference, gained, level);
  });
}

Interval RateDifferenceInterval(int64_t only_a, int64_t only_b, int64_t pairs) {
  const double lost = static_cast<double>(only_a) + 0.5, gained = static_cast<double>(only_b) + 0.5;
  const double total = static_cast<double>(pairs) + 2, change = gained - lost;
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
