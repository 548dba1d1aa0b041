#include "experiments/statistics/prediction_powered.h"

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <vector>

#include "sim/base/check.h"

namespace turbidock::statistics {
namespace {

double Share(const Count& count) {
  return static_cast<double>(count.successes) / static_cast<double>(count.trials);
}

// The least rate that goes with so few of so many; nothing is asked of more.
double LeastRate(int64_t few, int64_t trials) {
  if (few == 0) return 0;
  if (few > 2) return 1;
  return boost::math::gamma_p_inv(static_cast<double>(few), 0.05) / static_cast<double>(trials);
}

// Of a condition's successes in both, that so many are real: hypergeometric, by real successes.
std::vector<double> RealShareOf(const RealAndSimulated& condition) {
  const auto log_ways = [](int64_t n, int64_t k) {
    return std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0);
  };
  const auto& [real, simulated] = condition;
  const int64_t successes = real.successes + simulated.successes;
  std::vector<double> p(static_cast<size_t>(real.trials) + 1, 0);
  for (int64_t k = std::max<int64_t>(0, successes - simulated.trials);
       k <= std::min(real.trials, successes); ++k)
    p[static_cast<size_t>(k)] =
        std::exp(log_ways(real.trials, k) + log_ways(simulated.trials, successes - k) -
                 log_ways(real.trials + simulated.trials, successes));
  return p;
}

}  // namespace

RealRate PredictRealRate(std::span<const RealAndSimulated> conditions) {
  Count all;
  for (const auto& [real, simulated] : conditions) {
    TD_CHECK(real.trials == 0 || simulated.trials > 0, "simulated trials of each condition");
    all.successes += real.successes;
    all.trials += real.trials;
  }
  TD_CHECK(all.trials > 0, "a real trial at least");
  const auto n = static_cast<double>(all.trials);
  RealRate result{.rate = Share(all)};
  // Between conditions: variance of the simulated rates, and covariance with the real outcomes.
  double square = 0, product = 0;
  for (const auto& [real, simulated] : conditions) {
    if (real.trials == 0) continue;
    const double weight = static_cast<double>(real.trials) / n, predicted = Share(simulated);
    result.simulated_rate += weight * predicted;
    square += weight * predicted * predicted;
    product += weight * predicted * Share(real);
  }
  constexpr double kAdded = 4;  // trials, half of which succeed
  const double variance = square - result.simulated_rate * result.simulated_rate;
  const double covariance = (product - result.simulated_rate * result.rate) * n / (n + kAdded);
  const double rate = (result.rate * n + kAdded / 2) / (n + kAdded);
  if (variance > 1e-12) result.power = std::clamp(covariance / variance, 0.0, 1.0);
  const double explained = result.power * (2 * covariance - result.power * variance);
  result.worth_trials = n / (1 - explained / (rate * (1 - rate)));
  result.interval = RateInterval(result.rate, result.worth_trials);
  const int64_t failures = all.trials - all.successes;
  result.interval.low = std::min(result.interval.low, LeastRate(all.successes, all.trials));
  result.interval.high = std::max(result.interval.high, 1 - LeastRate(failures, all.trials));
  return result;
}

double RealDiffersP(std::span<const RealAndSimulated> conditions) {
  std::vector<double> p = {1};  // by real successes
  size_t seen = 0;
  for (const RealAndSimulated& condition : conditions) {
    const std::vector<double> more = RealShareOf(condition);
    std::vector<double> sum(p.size() + more.size() - 1, 0);
    for (size_t i = 0; i < p.size(); ++i)
      for (size_t j = 0; j < more.size(); ++j) sum[i + j] += p[i] * more[j];
    p = sum;
    seen += static_cast<size_t>(condition.real.successes);
  }
  double at_most = 0, at_least = 0;
  for (size_t k = 0; k < p.size(); ++k) {
    if (k <= seen) at_most += p[k];
    if (k >= seen) at_least += p[k];
  }
  return std::min(1.0, 2 * std::min(at_most, at_least));
}

}  // namespace turbidock::statistics
