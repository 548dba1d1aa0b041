// Logistic fits against closed forms and counted shares.

#include "experiments/statistics/logistic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/base/random.h"

namespace turbidock::statistics {
namespace {

TEST(FitLogistic, EqualsTheClosedFormOfTwoDoses) {
  // Firth's estimate with one parameter per value of x is (k + 1/2) / (n + 1).
  for (const int64_t k : {0, 3, 12}) {
    const auto fit = FitLogistic({{10, 18, 20}, {60, k, 30}});
    ASSERT_TRUE(fit);
    EXPECT_NEAR(fit->At(10), 18.5 / 21, 1e-9);
    EXPECT_NEAR(fit->At(60), (static_cast<double>(k) + 0.5) / 31, 1e-9);
    EXPECT_NEAR(fit->At(fit->half_x), 0.5, 1e-12);
    EXPECT_LT(fit->half_low, fit->half_x);
    EXPECT_GT(fit->half_high, fit->half_x);
  }
}

TEST(FitLogistic, FindsTheCurveBehindManyTrials) {
  std::vector<BinomialPoint> points;
  for (int x = 0; x <= 80; x += 10) {
    constexpr int64_t kTrials = 1000000;
    const double p = 1 / (1 + std::exp(-(4 - 0.1 * x)));
    points.push_back({static_cast<double>(x), std::llround(p * kTrials), kTrials});
  }
  const auto fit = FitLogistic(points);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->half_x, 40, 1e-3);
  EXPECT_NEAR(fit->slope, -0.1, 1e-5);
  EXPECT_LT(fit->half_high - fit->half_low, 0.2);
}

TEST(FitLogistic, IsFiniteForSeparatedData) {
  const auto fit = FitLogistic({{0, 10, 10}, {10, 10, 10}, {20, 0, 10}, {30, 0, 10}});
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->half_x, 15, 1e-9);
}

TEST(FitLogistic, SaysNothingWhereThereIsNothingToSay) {
  EXPECT_FALSE(FitLogistic({}));
  EXPECT_FALSE(FitLogistic({{0, 5, 10}}));                // one value of x
  EXPECT_FALSE(FitLogistic({{0, 10, 10}, {9, 10, 10}}));  // never fails
  EXPECT_FALSE(FitLogistic({{0, 9, 10}, {9, 8, 10}}));    // half is outside
}

constexpr double kChi2 = 3.841458820694124;  // 95 % of chi squared with a degree of freedom

double Rate(double log_odds) { return 1 / (1 + std::exp(-log_odds)); }

// Of two values of x the penalty is half a success and half a failure at each, so that the interval
// is that of the plain likelihood of those counts: worked out here by its own root.
TEST(FitSlope, OfTwoValuesIsTheProfileLikelihoodOfCountsWithHalves) {
  int checked = 0;
  for (const int64_t k : {0, 1, 7, 30}) {
    const double a[] = {18.5, k + 0.5}, n[] = {21, 31};  // at x = 10 and 60
    const auto fit = FitSlope({{10, 18, 20}, {60, k, 30}});
    ASSERT_TRUE(fit);
    const double log_odds[] = {std::log(a[0] / (n[0] - a[0])), std::log(a[1] / (n[1] - a[1]))};
    EXPECT_NEAR(fit->slope, (log_odds[1] - log_odds[0]) / 50, 1e-9);
    const auto likelihood = [&](double first, double second) {
      double sum = 0;
      for (int i = 0; i < 2; ++i) {
        const double p = Rate(i == 0 ? first : second);
        sum += a[i] * std::log(p) + (n[i] - a[i]) * std::log(1 - p);
      }
      return sum;
    };
    const auto deviance = [&](double slope) {
      double low = -40, high = 40;  // where the rates give the counts together
      while (high - low > 1e-12) {
        const double at = (low + high) / 2;
        const bool is_below = n[0] * Rate(at) + n[1] * Rate(at + 50 * slope) < a[0] + a[1];
        (is_below ? low : high) = at;
      }
      return 2 * (likelihood(log_odds[0], log_odds[1]) - likelihood(low, low + 50 * slope));
    };
    for (const double end : {fit->low, fit->high}) {
      EXPECT_NEAR(deviance(end), kChi2, 0.005) << k;
      ++checked;
    }
    EXPECT_LT(fit->low, fit->slope);
    EXPECT_GT(fit->high, fit->slope);
    EXPECT_NEAR(fit->p, std::erfc(std::sqrt(deviance(0) / 2)), 1e-9);
  }
  EXPECT_EQ(checked, 8);
}

TEST(FitSlope, IsFiniteWhereOneValueSeparatesTheOutcomes) {
  for (const double far : {19.0, 1e3, 1e9}) {
    std::vector<BinomialPoint> points;
    for (int i = 0; i < 20; ++i) points.push_back({i == 19 ? far : i, i < 10 ? 0 : 1, 1});
    const auto fit = FitSlope(points);
    ASSERT_TRUE(fit) << far;
    EXPECT_TRUE(std::isfinite(fit->low) && std::isfinite(fit->high)) << far;
    EXPECT_LT(fit->slope, fit->high);
    EXPECT_GT(fit->slope, fit->low);
    if (far == 19) {
      EXPECT_GT(fit->low, 0);
      EXPECT_LT(fit->p, 1e-4);
    }
  }
  EXPECT_FALSE(FitSlope({{0, 1, 1}, {0, 0, 1}}));
  EXPECT_FALSE(FitSlope({{0, 0, 1}, {1, 0, 1}}));
  EXPECT_FALSE(FitSlope({{0, 0, 1}, {1, 1, 1}}, std::vector<int64_t>{7, 7})) << "one cluster";
}

// How often the interval holds a slope, and how often p < 0.05 where there is none, of 40 trials
// that all draw x, of which few fail.
TEST(FitSlope, HoldsTheSlopeBehindFewFailures) {
  Rng rng(7, 0);
  for (const double slope : {0.0, 1.0, 2.0}) {
    int fits = 0, holds = 0, alarms = 0;
    for (int i = 0; i < 1000; ++i) {
      std::vector<BinomialPoint> points;
      for (int trial = 0; trial < 40; ++trial) {
        const double x = rng.Normal();
        points.push_back({x, rng.Uniform() < Rate(-2 + slope * x) ? 1 : 0, 1});
      }
      const auto fit = FitSlope(points);
      if (!fit) continue;
      ++fits;
      holds += fit->low <= slope && slope <= fit->high;
      alarms += fit->p < 0.05;
    }
    EXPECT_GE(fits, 980);
    EXPECT_GE(holds, 0.935 * fits) << slope;
    if (slope == 0) {
      EXPECT_LE(alarms, 0.065 * fits);
    }
    RecordProperty("coverage_" + std::to_string(slope), std::to_string(1.0 * holds / fits));
  }
}

// 20 seeds in each of 8 cells; what a seed draws beside x decides much of its trials.
TEST(FitSlope, TakesTrialsOfOneSeedForWhatTheyAre) {
  Rng rng(8, 0);
  int alarms = 0, naive = 0;
  constexpr int kRuns = 500;
  for (int i = 0; i < kRuns; ++i) {
    std::vector<BinomialPoint> points;
    std::vector<int64_t> seeds;
    for (int seed = 0; seed < 20; ++seed) {
      const double x = rng.Normal(), other = 2 * rng.Normal();
      for (int cell = 0; cell < 8; ++cell) {
        points.push_back({x, rng.Uniform() < Rate(-1 + other) ? 1 : 0, 1});
        seeds.push_back(seed);
      }
    }
    const auto fit = FitSlope(points, seeds), alone = FitSlope(points);
    ASSERT_TRUE(fit && alone);
    alarms += fit->p < 0.05;
    naive += alone->p < 0.05;
    EXPECT_GE(fit->high - fit->low, alone->high - alone->low);
  }
  EXPECT_LE(alarms, 0.08 * kRuns);
  EXPECT_GE(naive, 0.2 * kRuns);
  RecordProperty("alarms", alarms);
  RecordProperty("naive", naive);
}

}  // namespace
}  // namespace turbidock::statistics
