// Paired tests against published tables and brute force.

#include "experiments/statistics/paired_tests.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace turbidock::statistics {
namespace {

TEST(PairedTests, McNemarByHand) {
  EXPECT_EQ(McNemarExactP(0, 0), 1);
  EXPECT_EQ(McNemarExactP(3, 3), 1);
  EXPECT_NEAR(McNemarExactP(0, 5), 2 / 32.0, 1e-12);
  EXPECT_NEAR(McNemarExactP(1, 7), 2 * (1 + 8) / 256.0, 1e-12);
  EXPECT_EQ(McNemarExactP(7, 1), McNemarExactP(1, 7));
}

// Of ten pairs 3 succeeded in a only, 1 in b only: (1.5 - 3.5) / 12 and 1.959964 sqrt(5 - 4 / 12)
// / 12.
TEST(PairedTests, RateDifferenceByHand) {
  const Interval interval = RateDifferenceInterval(3, 1, 10);
  EXPECT_NEAR(interval.low, -1.0 / 6 - 0.352834, 1e-5);
  EXPECT_NEAR(interval.high, -1.0 / 6 + 0.352834, 1e-5);
  EXPECT_EQ(RateDifferenceInterval(1, 0, 1).low, -1) << "no rate differs by more than all";
}

// The probability that McNemar's p is at most `level`, over every count of both kinds of pairs.
double PowerByCounting(int pairs, double only_a, double only_b, double level) {
  double power = 0;
  for (int a = 0; a <= pairs; ++a)
    for (int b = 0; a + b <= pairs; ++b) {
      if (McNemarExactP(a, b) > level) continue;
      const double ways = std::lgamma(pairs + 1) - std::lgamma(a + 1) - std::lgamma(b + 1) -
                          std::lgamma(pairs - a - b + 1);
      power += std::exp(ways) * std::pow(only_a, a) * std::pow(only_b, b) *
               std::pow(1 - only_a - only_b, pairs - a - b);
    }
  return power;
}

// At the least difference that is seen the power is the one asked for, just below it is less.
TEST(LeastDifferenceSeen, IsWhereThePowerIsReached) {
  for (const int pairs : {20, 60, 150})
    for (const double differing : {0.0, 0.05, 0.3})
      for (const double power : {0.5, 0.8}) {
        const auto least = LeastDifferenceSeen(pairs, differing, power);
        ASSERT_TRUE(least);
        const auto at = [&](double difference) {
          const double gained = std::max(0.0, (differing - difference) / 2);
          return PowerByCounting(pairs, gained + difference, gained, 0.05);
        };
        EXPECT_GE(at(*least), power - 1e-6) << pairs << ' ' << differing;
        EXPECT_LT(at(*least - 2e-4), power) << pairs << ' ' << differing;
      }
}

TEST(LeastDifferenceSeen, MorePairsSeeLessAndTooFewNothing) {
  EXPECT_FALSE(LeastDifferenceSeen(0, 0));
  EXPECT_FALSE(LeastDifferenceSeen(5, 0)) << "5 of 5 lost: p = 0.0625";
  EXPECT_NEAR(*LeastDifferenceSeen(6, 0), std::pow(0.8, 1 / 6.), 1e-4) << "all six must be lost";
  double last = 1;
  for (const int64_t pairs : {50, 500, 5000, 50000}) {
    const double least = *LeastDifferenceSeen(pairs, 0.2);
    EXPECT_LT(least, last);
    last = least;
  }
  // of many pairs as of normal differences: (1.96 + 0.8416) sqrt(0.2 / 50000)
  EXPECT_NEAR(last, 2.8016 * std::sqrt(0.2 / 50000), 2e-4);
}

// R: p.adjust(c(0.01, 0.04, 0.03, 0.005), "holm") is 0.03, 0.06, 0.06, 0.02.
TEST(Holm, StepsDownFromTheSmallest) {
  using ::testing::ElementsAre;
  EXPECT_THAT(HolmSignificant({0.01, 0.04, 0.03, 0.005}), ElementsAre(true, false, false, true));
  EXPECT_THAT(HolmSignificant({0.01, 0.04, 0.03, 0.005}, 0.06),
              ElementsAre(true, true, true, true));
  // Whatever is behind the first that is not stays out, small as it may be beside its own bound.
  EXPECT_THAT(HolmSignificant({0.03, 0.04}), ElementsAre(false, false));
  EXPECT_THAT(HolmSignificant({0.025, 0.05}), ElementsAre(true, true)) << "bounds included";
  EXPECT_TRUE(HolmSignificant({}).empty());
}

// Student's (1908) own example: hours of sleep gained with two drugs, t = 4.0621 on 9 degrees of
// freedom, p = 0.002833.
TEST(PairedTests, StudentsSleepData) {
  const std::vector<double> one = {0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0};
  const std::vector<double> two = {1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4};
  const PairedComparison c = ComparePairs(one, two);
  EXPECT_EQ(c.pairs, 10);
  EXPECT_NEAR(c.mean, 1.58, 1e-12);
  EXPECT_NEAR(c.t_p, 0.002833, 1e-6);
  EXPECT_NEAR(c.confidence.low, 0.7001142, 1e-6);
  EXPECT_NEAR(c.confidence.high, 2.4598858, 1e-6);
}

TEST(PairedTests, NothingToCompareSaysNothing) {
  EXPECT_EQ(ComparePairs({}, {}).t_p, 1);
  EXPECT_EQ(ComparePairs({1}, {2}).t_p, 1);
  EXPECT_EQ(ComparePairs({1, 2}, {1, 2}).t_p, 1);
  EXPECT_EQ(ComparePairs({1, 2}, {2, 3}).t_p, 0);
  EXPECT_EQ(ComparePairs({1, 2}, {2, 3}).confidence.low, 1);
  EXPECT_EQ(ComparePairs({1, 2}, {2, 3}).confidence.high, 1);
}

TEST(PairedTestsDeathTest, RefusesWhatIsNoNumber) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_DEATH(ComparePairs({1, kInfinity}, {2, kInfinity}), "are numbers");
}

}  // namespace
}  // namespace turbidock::statistics
