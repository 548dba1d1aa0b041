// The interval of the real success rate: exact coverage over grids of real and simulated rates.

#include "experiments/statistics/prediction_powered.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/distributions/hypergeometric.hpp>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace turbidock::statistics {
namespace {

constexpr int64_t kSimulated = 200;  // trials of a condition

double Rate(double log_odds) { return 1 / (1 + std::exp(-log_odds)); }

RealAndSimulated Condition(int64_t successes, int64_t trials, double simulated_rate) {
  return {{successes, trials}, {std::llround(kSimulated * simulated_rate), kSimulated}};
}

// Rates whose log-odds are spread evenly, with that mean over trials.
std::vector<double> Spread(const std::vector<int64_t>& trials, double mean, double spread) {
  double low = -40, high = 40;
  std::vector<double> rates(trials.size());
  while (high - low > 1e-9) {
    double weighted = 0, total = 0;
    for (size_t i = 0; i < rates.size(); ++i) {
      const double place = rates.size() > 1 ? 2.0 * i / (rates.size() - 1) - 1 : 0;
      rates[i] = Rate((low + high) / 2 + spread * place);
      weighted += trials[i] * rates[i];
      total += trials[i];
    }
    (weighted < mean * total ? low : high) = (low + high) / 2;
  }
  return rates;
}

// Visits all outcomes of the real trials with their probabilities.
void ForEachOutcome(const std::vector<int64_t>& trials, const std::vector<double>& rates,
                    const std::function<void(const std::vector<int64_t>&, double)>& visit) {
  std::vector<int64_t> successes(trials.size());
  const std::function<void(size_t, double)> rest = [&](size_t at, double chance) {
    if (at == trials.size()) return visit(successes, chance);
    const int64_t n = trials[at];
    for (int64_t k = 0; k <= n; ++k) {
      successes[at] = k;
      const double ways =
          std::exp(std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1));
      const double p = chance * ways * std::pow(rates[at], k) * std::pow(1 - rates[at], n - k);
      if (p > 1e-12) rest(at + 1, p);
    }
  };
  rest(0, 1);
}

// Simulated rates for real ones: right, off, in the wrong order, or with differences of their own.
std::vector<std::vector<double>> Simulators(const std::vector<double>& rates) {
  std::vector<std::vector<double>> all;
  for (const double off : {0.0, -0.2, -0.1, 0.1, 0.2}) {
    all.emplace_back();
    for (const double rate : rates) all.back().push_back(std::clamp(rate + off, 0.0, 1.0));
  }
  all.emplace_back(rates.rbegin(), rates.rend());
  all.emplace_back();
  for (size_t i = 0; i < rates.size(); ++i) all.back().push_back(i % 2 == 0 ? 0.3 : 0.95);
  return all;
}

struct Measured {
  double sum = 0, least = 1;
  int count = 0;
  std::map<double, std::vector<double>> ratios;  // of widths, by spread: the medians of outcomes
  double least_of_wilson = 1;
};

void Measure(const std::vector<int64_t>& trials, double mean, double spread, Measured* measured) {
  const std::vector<double> rates = Spread(trials, mean, spread);
  int64_t n = 0;
  for (const int64_t m : trials) n += m;
  const auto simulators = Simulators(rates);
  std::vector<double> holds(simulators.size() + 1);  // the last is Wilson's alone
  std::vector<std::pair<double, double>> ratios;     // with the right one, and how likely
  ForEachOutcome(trials, rates, [&](const std::vector<int64_t>& successes, double chance) {
    int64_t k = 0;
    for (const int64_t some : successes) k += some;
    const Interval wilson = WilsonInterval(k, n);
    const auto adds = [&](const Interval& interval) {
      return interval.low <= mean && mean <= interval.high ? chance : 0;
    };
    holds.back() += adds(wilson);
    for (size_t s = 0; s < simulators.size(); ++s) {
      std::vector<RealAndSimulated> conditions;
      for (size_t i = 0; i < trials.size(); ++i)
        conditions.push_back(Condition(successes[i], trials[i], simulators[s][i]));
      const Interval interval = PredictRealRate(conditions).interval;
      holds[s] += adds(interval);
      if (s == 0) ratios.emplace_back(interval.half_width() / wilson.half_width(), chance);
    }
  });
  measured->least_of_wilson = std::min(measured->least_of_wilson, holds.back());
  holds.pop_back();
  for (const double share : holds) {
    measured->sum += share;
    measured->least = std::min(measured->least, share);
    ++measured->count;
  }
  std::ranges::sort(ratios);
  double below = 0;
  auto median = ratios.begin();
  while ((below += median->second) < 0.5) ++median;
  measured->ratios[spread].push_back(median->first);
}

TEST(PredictRealRate, HoldsTheRealRateWhateverTheSimulatorSays) {
  const std::map<int, std::vector<std::vector<int64_t>>> designs = {
      {6, {{3, 3}, {2, 2, 2}, {1, 1, 1, 1, 1, 1}, {5, 1}}},
      {12, {{6, 6}, {4, 4, 4}, {3, 3, 3, 3}, {2, 2, 2, 2, 2, 2}, {8, 3, 1}}},
      {30, {{15, 15}, {10, 10, 10}, {20, 7, 3}, {12, 9, 6, 3}}}};
  for (const auto& [n, plans] : designs) {
    Measured measured;
    for (const std::vector<int64_t>& trials : plans)
      for (const double mean : {0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 0.97, 0.99})
        for (const double spread : {0.0, 1.0, 2.0, 4.0}) Measure(trials, mean, spread, &measured);
    EXPECT_EQ(measured.count, std::ssize(plans) * 10 * 4 * 7);
    EXPECT_GE(measured.sum / measured.count, 0.94) << n;
    EXPECT_GE(measured.least, 0.9) << n;
    std::string text =
        fmt::format("coverage {:.3f}, least {:.3f}, Wilson's least {:.3f}; width",
                    measured.sum / measured.count, measured.least, measured.least_of_wilson);
    for (auto& [spread, ratios] : measured.ratios) {
      std::ranges::sort(ratios);
      text += fmt::format(", spread {:g}: {:.2f} ({:.2f} to {:.2f})", spread,
                          ratios[ratios.size() / 2], ratios.front(), ratios.back());
    }
    RecordProperty("of_" + std::to_string(n), text);
    // right predictions of conditions that differ as much as they can make it narrower
    EXPECT_LT(measured.ratios.at(4).front(), n < 30 ? 0.9 : 0.55);
    EXPECT_LE(measured.ratios.at(0).back(), 1.05);
  }
}

// 5 of 5 and 1 of 5, predicted as 0.9 and 0.3 on average 0.6: covariance of simulated rates and
// outcomes 0.3 * 0.4, of which 10 of 14 trials are left, variance 0.09; of 14 trials 8 succeeded.
TEST(PredictRealRate, IsWilsonsOfWhatThePredictionsLeave) {
  const std::vector<RealAndSimulated> conditions = {{{5, 5}, {90, 100}}, {{1, 5}, {30, 100}}};
  const RealRate real = PredictRealRate(conditions);
  EXPECT_DOUBLE_EQ(real.rate, 0.6);
  EXPECT_DOUBLE_EQ(real.simulated_rate, 0.6);
  const double power = 0.12 * 10 / 14 / 0.09;
  EXPECT_NEAR(real.power, power, 1e-12);
  const double explained = power * (2 * 0.12 * 10 / 14 - power * 0.09);
  EXPECT_NEAR(real.worth_trials, 10 / (1 - explained / (8.0 / 14 * 6 / 14)), 1e-9);
  EXPECT_EQ(real.interval.AsList(), RateInterval(0.6, real.worth_trials).AsList());

  // one condition, equal predictions, and predictions the wrong way round tell nothing
  for (const auto& [first, second] : {std::pair{90, 90}, {30, 90}}) {
    const std::vector<RealAndSimulated> other = {{{5, 5}, {first, 100}}, {{1, 5}, {second, 100}}};
    EXPECT_EQ(PredictRealRate(other).power, 0);
    EXPECT_EQ(PredictRealRate(other).interval.AsList(), WilsonInterval(6, 10).AsList());
  }
  // a condition without real trials changes nothing
  std::vector<RealAndSimulated> more = conditions;
  more.push_back({{0, 0}, {7, 50}});
  more.push_back({});
  EXPECT_EQ(PredictRealRate(more).interval.AsList(), real.interval.AsList());
  EXPECT_EQ(PredictRealRate(std::vector<RealAndSimulated>{{{7, 7}, {9, 10}}}).interval.high, 1);
  // -ln(0.95) of 12 failed at least where one did
  const std::vector<RealAndSimulated> once = {{{11, 12}, {9, 10}}};
  EXPECT_NEAR(PredictRealRate(once).interval.high, 1 + std::log(0.95) / 12, 1e-12);
}

TEST(RealDiffersP, OfOneConditionIsFishersTest) {
  for (const int64_t k : {0, 2, 5, 6}) {
    const std::vector<RealAndSimulated> one = {{{k, 6}, {180, 200}}};
    const boost::math::hypergeometric_distribution<> by_chance(static_cast<unsigned>(180 + k), 6,
                                                               206);
    const double at_most = cdf(by_chance, k), at_least = k > 0 ? 1 - cdf(by_chance, k - 1) : 1;
    EXPECT_NEAR(RealDiffersP(one), std::min(1.0, 2 * std::min(at_most, at_least)), 1e-9) << k;
  }
  EXPECT_EQ(RealDiffersP({}), 1);
}

// How often p < 0.05, over all real outcomes of three conditions and simulated rates that are right
// but for `off`.
TEST(RealDiffersP, SeldomAccusesARightSimulatorAndOftenAWrongOne) {
  const auto alarms = [](const std::vector<int64_t>& trials, double off) {
    const std::vector<double> rates = {0.95, 0.9, 0.8};
    double total = 0;
    ForEachOutcome(trials, rates, [&](const std::vector<int64_t>& successes, double chance) {
      std::vector<RealAndSimulated> conditions;
      for (size_t i = 0; i < rates.size(); ++i)
        conditions.push_back(Condition(successes[i], trials[i], rates[i] - off));
      if (RealDiffersP(conditions) < 0.05) total += chance;
    });
    return total;
  };
  int i = 0;
  for (const std::vector<int64_t>& trials :
       {{2, 2, 2}, {4, 4, 4}, std::vector<int64_t>{10, 10, 10}}) {
    EXPECT_LE(alarms(trials, 0), 0.05);
    const double least[] = {0, 0.4, 0.9};
    EXPECT_GE(alarms(trials, 0.4), least[i++]);
    for (const double off : {-0.05, 0.0, 0.2, 0.4})
      RecordProperty(fmt::format("alarms_{}_{}", trials[0], off),
                     fmt::format("{:.3f}", alarms(trials, off)));
  }
}

}  // namespace
}  // namespace turbidock::statistics
