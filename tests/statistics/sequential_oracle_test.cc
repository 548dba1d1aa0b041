// Sequential tests against sums over every sequence and products written out.

#include "experiments/statistics/sequential_test.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace turbidock::statistics {
namespace {

TEST(HitTest, RejectsAsOftenAsTheSequencesInWhichItEverDoes) {
  constexpr int kTrials = 12;
  for (const auto& [p_null, p_alternative, level] :
       {std::array{0.5, 0.75, 0.2}, std::array{0.2, 0.4, 0.1}, std::array{0.05, 0.15, 0.05}}) {
    const HitTest test({p_null, p_alternative, level, kTrials});
    for (const double p : {p_null, p_alternative, 0.37, 0.9}) {
      double rate = 0;
      for (int sequence = 0; sequence < 1 << kTrials; ++sequence) {
        int hits = 0;
        bool rejects = false;
        for (int n = 1; n <= kTrials; ++n) {
          hits += sequence >> (n - 1) & 1;
          rejects = rejects || test.Rejects(n, hits);
        }
        if (rejects) rate += std::pow(p, hits) * std::pow(1 - p, kTrials - hits);
      }
      EXPECT_NEAR(test.RejectionRate(p), rate, 1e-12) << p_null << ' ' << p;
    }
    EXPECT_LE(test.RejectionRate(p_null), level);
  }
}

// A sign test of a hundred pairs spends its level and sees what it is designed for.
TEST(HitTest, SpendsItsLevelAndHasPower) {
  const HitTest test = SignTest(0.05, 100);
  EXPECT_GT(test.RejectionRate(0.5), 0.04);
  EXPECT_LE(test.RejectionRate(0.5), 0.05);
  EXPECT_GT(test.RejectionRate(0.75), 0.98);
}

TEST(HitTestDeathTest, RefusesWhatIsNoDesign) {
  for (const HitTest::Design& design :
       {HitTest::Design{0, 0.5, 0.05, 10}, HitTest::Design{0.5, 1, 0.05, 10},
        HitTest::Design{0.5, 0.75, 1, 10}, HitTest::Design{0.5, 0.75, 0.05, 0}})
    EXPECT_DEATH(HitTest{design}, "design is impossible");
}

// The wealth of a gambler who spreads it over four stakes, as products instead of logarithms.
TEST(NetLossTest, RejectsWhenTheAverageOfItsStakesHasGrownEnough) {
  int rejected = 0, kept = 0;
  for (const double margin : {0.05, 0.2})
    for (const double level : {0.05, 0.3}) {
      const NetLossTest test(margin, level);
      for (int same = 0; same <= 60; same += 4)
        for (int losses = 0; losses <= 3; ++losses)
          for (int gains = 0; gains <= 6; ++gains) {
            double wealth = 0;
            for (const auto& [share, weight] : {std::array{1.0, 0.4}, std::array{0.7, 0.3},
                                                std::array{0.4, 0.2}, std::array{0.2, 0.1}}) {
              const double b = share / (1 - margin);
              wealth += weight * std::pow(1 + b * margin, same) *
                        std::pow(1 - b * (1 - margin), losses) *
                        std::pow(1 + b * (1 + margin), gains);
            }
            if (std::abs(wealth * level - 1) < 1e-9) continue;  // on the edge
            const bool rejects = test.Rejects(same + losses + gains, losses, gains);
            ASSERT_EQ(rejects, wealth * level > 1)
                << margin << ' ' << level << ' ' << same << ' ' << losses << ' ' << gains;
            ++(rejects ? rejected : kept);
          }
    }
  EXPECT_GT(rejected, 300);
  EXPECT_GT(kept, 300);
}

TEST(PairedRateTest, StandsAtTheLimitsOfWhatMayBeAsked) {
  constexpr double kLeast = kLeastProbability;
  for (const double margin : {kLeast, 0.5, 1 - kLeast})
    for (const double level : {kLeast, 1 - kLeast})
      for (const int max_pairs : {1, 300}) {
        const PairedRateTest test(margin, level, level, max_pairs);
        EXPECT_LE(test.At(margin).p_pass, level) << margin << ' ' << level;
        EXPECT_LE(test.At(0.1, 0.1).p_fail, level) << margin << ' ' << level;
      }
}

// The probabilities of both verdicts, by all counts of successes.
std::array<double, 2> FailAndPass(const RateTest& test, double rate, int max_trials) {
  std::vector<double> ways(static_cast<size_t>(max_trials) + 2, 0.0);  // by successes
  ways[0] = 1;
  std::array<double, 2> found{};
  for (int n = 1; n <= max_trials; ++n)
    for (int successes = n; successes >= 0; --successes) {
      double& p = ways[static_cast<size_t>(successes)];
      p = (1 - rate) * p + (successes > 0 ? rate * (&p)[-1] : 0);
      if (const auto verdict = test.Decide(n, successes))
        found[verdict == Verdict::kPass] += std::exchange(p, 0.0);
    }
  return found;
}

TEST(RateTest, StandsAtTheLimitsOfWhatMayBeAsked) {
  constexpr double kLeast = kLeastProbability;
  for (const double rate : {2 * kLeast, 0.5, 1 - kLeast})
    for (const double margin : {kLeast, rate - kLeast})
      for (const double level : {kLeast, 1 - kLeast})
        for (const int max_trials : {1, 300}) {
          const RateTest test({.no_worse = rate,
                               .worse = rate - margin,
                               .alpha = level,
                               .beta = level,
                               .max_trials = max_trials});
          EXPECT_LE(FailAndPass(test, rate, max_trials)[0], level) << rate << ' ' << margin;
          EXPECT_LE(FailAndPass(test, rate - margin, max_trials)[1], level)
              << rate << ' ' << margin;
        }
}

}  // namespace
}  // namespace turbidock::statistics
