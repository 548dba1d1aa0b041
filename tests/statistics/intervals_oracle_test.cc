// Intervals and quantiles against numbers worked out another way.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "experiments/statistics/intervals.h"

namespace turbidock::statistics {
namespace {

TEST(WilsonInterval, SolvesTheScoreEquation) {
  // Its ends are where |p_hat - p| is z standard deviations of a binomial with that p.
  constexpr double kZ = 1.959963984540054;
  int checked = 0;
  for (const int64_t n : {1, 2, 10, 30, 1000}) {
    for (const int64_t k : {int64_t{0}, n / 3, n / 2, n}) {
      const Interval interval = WilsonInterval(k, n);
      const double rate = static_cast<double>(k) / static_cast<double>(n);
      for (const double p : {interval.low, interval.high}) {
        if (p == 0 || p == 1) continue;
        EXPECT_NEAR(std::abs(rate - p), kZ * std::sqrt(p * (1 - p) / static_cast<double>(n)),
                    1e-12);
        ++checked;
      }
    }
  }
  EXPECT_EQ(checked, 27);
  EXPECT_EQ(WilsonInterval(0, 7).low, 0);
  EXPECT_EQ(WilsonInterval(7, 7).high, 1);
}

TEST(StratifiedInterval, OfOneStratumIsWilsons) {
  for (const auto& [k, n] : {std::pair{0, 7}, {7, 7}, {3, 10}, {400, 1000}}) {
    const Interval wilson = WilsonInterval(k, n, 0.9);
    const Interval one = StratifiedInterval(std::vector<Count>{{k, n}}, 0.9);
    EXPECT_NEAR(one.low, wilson.low, 1e-12);
    EXPECT_NEAR(one.high, wilson.high, 1e-12);
  }
  EXPECT_EQ(StratifiedInterval({}).AsList(), (std::array<double, 2>{0, 1}));
  EXPECT_EQ(StratifiedInterval(std::vector<Count>(3)).AsList(), (std::array<double, 2>{0, 1}));
  EXPECT_EQ(DesignEffect({}), 1);
}

TEST(StratifiedInterval, IsWilsonsOfTheEffectiveNumberOfTrials) {
  // Two strata of 19, of which all and none succeeded: rates of 39/40 and 1/40, whose variance is
  // 39/1600 * 400/381 within and 1/4 in all, so that 38 trials count as 38 * 381/39 = 371.2.
  const std::vector<Count> apart = {{19, 19}, {0, 19}};
  EXPECT_NEAR(DesignEffect(apart), 39.0 / 381, 1e-15);
  constexpr double kZ = 1.959963984540054, kTrials = 38 * 381.0 / 39;
  const Interval interval = StratifiedInterval(apart);
  for (const double p : interval.AsList())  // the score equation
    EXPECT_NEAR(std::abs(0.5 - p), kZ * std::sqrt(p * (1 - p) / kTrials), 1e-12);
  // Strata that are alike tell nothing, unequal ones weigh by their trials: 14 of 14 and 1 of 6 are
  // rates of 29/30 and 3/14.
  EXPECT_EQ(DesignEffect(std::vector<Count>{{6, 19}, {6, 19}, {6, 19}}), 1);
  const double within = 0.7 * (29 / 900.0 * 225 / 211) + 0.3 * (33 / 196.0 * 49 / 43);
  const double rate = 0.7 * 29 / 30 + 0.3 * 3 / 14;
  EXPECT_NEAR(DesignEffect(std::vector<Count>{{14, 14}, {1, 6}}), within / (rate * (1 - rate)),
              1e-12);
  // All succeeded: nothing between the strata.
  EXPECT_NEAR(StratifiedInterval(std::vector<Count>{{10, 10}, {10, 10}}).low,
              WilsonInterval(20, 20).low, 1e-12);
}

// The exact share of intervals that hold the true rate, over all counts of six strata with these
// rates, of few trials each.
TEST(StratifiedInterval, HoldsTheTrueRateHoweverFewTrialsAStratumHas) {
  const std::vector<std::vector<double>> populations = {
      {0.1, 0.1, 0.1, 0.1, 0.1, 0.1}, {0.5, 0.5, 0.5, 0.5, 0.5, 0.5}, {1, 1, 0.6, 0, 0, 0},
      {0.9, 0.7, 0.5, 0.3, 0.2, 0.1}, {0.2, 0, 0, 0, 0, 0},           {1, 1, 1, 1, 1, 0.5}};
  for (const int64_t n : {1, 2, 5})
    for (const std::vector<double>& rates : populations) {
      double mean = 0, holds = 0, total = 0;
      for (const double rate : rates) mean += rate / static_cast<double>(rates.size());
      std::vector<Count> strata(rates.size(), Count{0, n});
      const std::function<void(size_t, double)> visit = [&](size_t at, double chance) {
        if (chance == 0) return;
        if (at == rates.size()) {
          const Interval interval = StratifiedInterval(strata);
          total += chance;
          if (interval.low <= mean && mean <= interval.high) holds += chance;
          return;
        }
        for (int64_t k = 0; k <= n; ++k) {
          strata[at].successes = k;
          const double p = rates[at];
          const double ways =
              std::exp(std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1));
          visit(at + 1, chance * ways * std::pow(p, k) * std::pow(1 - p, n - k));
        }
      };
      visit(0, 1);
      EXPECT_NEAR(total, 1, 1e-12);
      EXPECT_GE(holds, 0.94) << n << " trials of each, mean rate " << mean;
      RecordProperty("coverage_" + std::to_string(n) + "_" + std::to_string(mean),
                     std::to_string(holds));
    }
}

TEST(TrialsForHalfWidth, IsTheLeastNumberThatGivesIt) {
  for (const double h : {0.001, 0.01, 0.03, 0.05, 0.1, 0.3}) {
    const int64_t n = TrialsForHalfWidth(h) / 2;
    EXPECT_LE(WilsonInterval(n + 1, 2 * (n + 1)).half_width(), h);
    if (n > 1) {
      EXPECT_GT(WilsonInterval(n - 1, 2 * (n - 1)).half_width(), h);
    }
  }
  EXPECT_EQ(TrialsForHalfWidth(0.03), 1064);
  EXPECT_EQ(TrialsForHalfWidth(0.5), 0);
}

TEST(Intervals, KnowNothingWithoutTrials) {
  EXPECT_EQ(WilsonInterval(0, 0).high - WilsonInterval(0, 0).low, 1);
}

// Conover's tables: of ten values the second and the ninth, of five none.
TEST(MedianInterval, IsBetweenOrderStatistics) {
  std::vector<double> values = {5, 3, 9, 1, 7, 10, 2, 8, 6, 4};
  const auto of_ten = MedianInterval(values, 0.95);
  ASSERT_TRUE(of_ten);
  EXPECT_EQ(of_ten->low, 2);
  EXPECT_EQ(of_ten->high, 9);
  const auto of_six = MedianInterval({1, 2, 3, 4, 5, 6}, 0.95);
  ASSERT_TRUE(of_six);
  EXPECT_EQ(of_six->low, 1);
  EXPECT_EQ(of_six->high, 6);
  EXPECT_FALSE(MedianInterval({1, 2, 3, 4, 5}, 0.95));
  EXPECT_FALSE(MedianInterval({}, 0.95));
}

TEST(Quantile, InterpolatesBetweenOrderStatistics) {
  EXPECT_DOUBLE_EQ(*Quantile({4, 1, 3, 2}, 0.25), 1.75);
  EXPECT_DOUBLE_EQ(*Quantile({4, 1, 3, 2}, 1), 4);
  EXPECT_DOUBLE_EQ(*Median({5}), 5);
  EXPECT_FALSE(Median({}));
}

}  // namespace
}  // namespace turbidock::statistics
