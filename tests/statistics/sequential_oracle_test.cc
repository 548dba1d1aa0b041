// Sequential tests against sums over every sequence and products written out.

#include "experiments/statistics/paired_measure.h"
#include "experiments/statistics/sequential_test.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "sim/base/random.h"

namespace turbidock::statistics {
namespace {

// The two tests of a rate by counts alone, as PairedMeasure takes them pair by pair.
struct RateTest {
  RateTest(double margin, double alpha, double beta, int max_pairs)
      : fail(alpha, max_pairs), pass(margin, beta) {}

  std::optional<Verdict> operator()(int pairs, int losses, int gains) const {
    if (fail.Rejects(losses + gains, losses)) return Verdict::kFail;
    if (pass.Rejects(pairs, losses, gains)) return Verdict::kPass;
    return std::nullopt;
  }

  SignTest fail;
  NetLossTest pass;
};

// The shares of both verdicts, and the pairs until then, of a build that loses and gains these
// shares: by all counts of losses and gains.
struct Shares {
  double fail = 0, pass = 0, pairs = 0;
};
Shares SharesOf(const auto& decide, double loss, double gain, int max_pairs) {
  const auto size = static_cast<size_t>(max_pairs) + 1;
  std::vector<std::vector<double>> paths(size, std::vector<double>(size, 0.0));
  paths[0][0] = 1;
  Shares shares;
  double left = 1;
  for (int n = 1; n <= max_pairs; ++n) {
    shares.pairs += left;
    left = 0;
    for (size_t l = static_cast<size_t>(n) + 1; l-- > 0;)
      for (size_t g = static_cast<size_t>(n) + 1 - l; g-- > 0;) {
        double& p = paths[l][g];
        p = (1 - loss - gain) * p + (l > 0 ? loss * paths[l - 1][g] : 0) +
            (g > 0 ? gain * paths[l][g - 1] : 0);
        if (p == 0) continue;
        if (const std::optional<Verdict> verdict =
                decide(n, static_cast<int>(l), static_cast<int>(g)))
          (*verdict == Verdict::kFail ? shares.fail : shares.pass) += std::exchange(p, 0.0);
        left += p;
      }
  }
  return shares;
}

// The probability of ever rejecting when a hit has probability p.
double RejectionRate(const SignTest& test, double p) {
  const auto decide = [&test](int pairs, int hits, int) {
    return test.Rejects(pairs, hits) ? std::optional(Verdict::kFail) : std::nullopt;
  };
  return SharesOf(decide, p, 1 - p, test.max_trials()).fail;
}

// And when a pair is lost or gained with these probabilities.
double RejectionRate(const NetLossTest& test, double loss, double gain, int max_pairs) {
  const auto decide = [&test](int pairs, int losses, int gains) {
    return test.Rejects(pairs, losses, gains) ? std::optional(Verdict::kPass) : std::nullopt;
  };
  return SharesOf(decide, loss, gain, max_pairs).pass;
}

// Of all sequences of twelve fair hits, those in which it ever rejects are within the level and not
// far from it.
TEST(SignTest, RejectsAsOftenAsItsLevelAllows) {
  constexpr int kTrials = 12;
  for (const double level : {0.3, 0.2, 0.05, 0.01}) {
    const SignTest test(level, kTrials);
    int rejected = 0;
    for (int sequence = 0; sequence < 1 << kTrials; ++sequence) {
      int hits = 0;
      bool rejects = false;
      for (int n = 1; n <= kTrials; ++n) {
        hits += sequence >> (n - 1) & 1;
        rejects = rejects || test.Rejects(n, hits);
      }
      rejected += rejects;
    }
    const double rate = rejected / std::pow(2.0, kTrials);
    EXPECT_NEAR(RejectionRate(test, 0.5), rate, 1e-12);
    EXPECT_LE(rate, level);
    EXPECT_GT(rate, 0.4 * level);
  }
}

TEST(SignTest, NeverExceedsItsLevelAndIsNotIdle) {
  for (const double level : {0.2, 0.05, 0.001})
    for (const int max_trials : {1, 2, 7, 40, 500}) {
      const SignTest test(level, max_trials);
      const double rate = RejectionRate(test, 0.5);
      EXPECT_LE(rate, level);
      // a smaller probability of a hit is further from being rejected
      EXPECT_LE(RejectionRate(test, 0.25), rate);
      EXPECT_GE(RejectionRate(test, 0.75), rate);
      // the least probable path alone, all hits, is worth rejecting as soon as it is rare enough
      if (std::pow(0.5, max_trials) < 0.1 * level) {
        EXPECT_GT(rate, 0);
        EXPECT_TRUE(test.Rejects(max_trials, max_trials));
      }
    }
}

// A sign test of a hundred pairs spends its level and sees what it is designed for.
TEST(SignTest, SpendsItsLevelAndHasPower) {
  const SignTest test(0.05, 100);
  EXPECT_GT(RejectionRate(test, 0.5), 0.04);
  EXPECT_LE(RejectionRate(test, 0.5), 0.05);
  EXPECT_GT(RejectionRate(test, 0.75), 0.98);
}

TEST(SignTestDeathTest, RefusesWhatIsNoDesign) {
  for (const double level : {0.0, 1.0}) EXPECT_DEATH(SignTest(level, 10), "design is impossible");
  EXPECT_DEATH(SignTest(0.05, 0), "design is impossible");
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

TEST(NetLossTest, NeverExceedsItsLevelHoweverManyPairsDiffer) {
  for (const double margin : {0.05, 0.2, 0.5})
    for (const double level : {0.1, 0.01}) {
      const NetLossTest test(margin, level);
      for (const double p_gain : {0.0, 0.02, 0.1, (1 - margin) / 2})
        EXPECT_LE(RejectionRate(test, p_gain + margin, p_gain, 90), level)
            << margin << " " << p_gain;
      // and it does reject when nothing is lost
      EXPECT_EQ(RejectionRate(test, 0, 0, 200), 1);
    }
}

TEST(NetLossTest, TheLargestStakeIsTheLimit) {
  // One loss more than the stakes allow would make a wealth negative: more losses never help.
  const NetLossTest test(0.2, 0.05);
  for (int pairs = 1; pairs < 60; ++pairs)
    for (int losses = 1; losses <= pairs; ++losses)
      EXPECT_LE(test.Rejects(pairs, losses, 0), test.Rejects(pairs, losses - 1, 0));
}

// Builds that are alike, of which the new one loses what the old one did not, and builds that have
// nothing to do with each other.
TEST(RateTest, KeepsAlphaAndBetaInEverySetting) {
  struct Case {
    double rate, margin, error;
  };
  for (const Case& c : {Case{0.95, 0.1, 0.05}, Case{0.8, 0.2, 0.1}, Case{0.95, 0.1, 0.01}})
    for (const bool alike : {true, false}) {
      const RateTest test(c.margin, c.error, c.error, 200);
      const auto shares = [&](double new_rate) {
        const double gain = alike ? 0 : (1 - c.rate) * new_rate;
        return SharesOf(test, c.rate - new_rate + gain, gain, 200);
      };
      EXPECT_LE(shares(c.rate).fail, c.error) << alike;
      EXPECT_LE(shares(c.rate - c.margin).pass, c.error) << alike;
    }
}

TEST(RateTest, StandsAtTheLimitsOfWhatMayBeAsked) {
  constexpr double kLeast = kLeastProbability;
  for (const double margin : {kLeast, 0.5, 1 - kLeast})
    for (const double level : {kLeast, 1 - kLeast})
      for (const int max_pairs : {1, 120}) {
        const RateTest test(margin, level, level, max_pairs);
        EXPECT_LE(SharesOf(test, margin, 0, max_pairs).pass, level) << margin << ' ' << level;
        EXPECT_LE(SharesOf(test, 0.1, 0.1, max_pairs).fail, level) << margin << ' ' << level;
      }
}

constexpr PairedDesign kDesign{.margin = 0.15, .alpha = 0.02, .beta = 0.1, .most = 60};

TEST(RateTest, WhatItSaysOfABuildIsTheSumOverAllCounts) {
  const RateTest test(0.15, 0.02, 0.1, 60);
  for (const double loss : {0.0, 0.05, 0.15, 0.3, 1.0}) {
    const Shares all = SharesOf(test, loss, 0, 60);
    EXPECT_NEAR(FailRate(kDesign, loss), all.fail, 1e-12) << loss;
  }
  EXPECT_LE(SharesOf(test, 0.15, 0, 60).pass, 0.1);
}

// As in assets/measured/gate.md, where these were counted in 10,000 sequences.
TEST(RateTest, TakesAsManyTrialsAsWasMeasured) {
  const RateTest test(0.1, 0.05, 0.05, 169);
  EXPECT_NEAR(SharesOf(test, 0, 0, 169).pairs, 35, 1e-9);
  const Shares worse = SharesOf(test, 0.1, 0, 169);
  EXPECT_NEAR(worse.pairs, 77.9, 1);
  EXPECT_LE(worse.pass, 0.05);
}

// What it fails with 80 %: a little less it fails less often.
TEST(RateTest, TheLeastLossThatItSees) {
  const RateTest test(0.15, 0.02, 0.1, 60);
  const double loss = *LeastLossSeen(kDesign, 0.8);
  EXPECT_NEAR(SharesOf(test, loss, 0, 60).fail, 0.8, 1e-3);
  EXPECT_GT(loss, 0.1);
  EXPECT_LT(loss, 0.3);
  PairedDesign few = kDesign;
  few.most = 4;
  EXPECT_FALSE(LeastLossSeen(few, 0.8)) << "four cannot tell";
}

// A measure says what the counts say, and when: of random pairs of all kinds.
TEST(PairedMeasure, DecidesARateByTheCountsOfItsPairs) {
  const RateTest test(kDesign.margin, kDesign.alpha, kDesign.beta, kDesign.most);
  Rng rng = SeedTree(3).Stream("pairs");
  int failed = 0, passed = 0;
  for (int sequence = 0; sequence < 300; ++sequence) {
    PairedMeasure measure(MeasureKind::kRate, -1, kDesign);
    const double rate_a = rng.Uniform(), rate_b = rng.Uniform();
    std::optional<Verdict> verdict;
    int losses = 0, gains = 0, decided = 0;
    for (int pairs = 1; pairs <= kDesign.most; ++pairs) {
      const bool a = rng.Uniform() < rate_a, b = rng.Uniform() < rate_b;
      measure.Add(a, b, 10 * pairs, pairs);
      losses += a && !b;
      gains += !a && b;
      if (verdict) continue;
      verdict = test(pairs, losses, gains);
      decided = 10 * pairs;
    }
    const PairedResult result = measure.Result();
    ASSERT_EQ(measure.verdict(), verdict);
    EXPECT_EQ(result.worse, losses);
    EXPECT_EQ(result.better, gains);
    EXPECT_NEAR(*result.difference, (gains - losses) / 60.0, 1e-12);
    if (verdict) {
      EXPECT_EQ(result.decided_after, decided);
    }
    failed += verdict == Verdict::kFail;
    passed += verdict == Verdict::kPass;
  }
  EXPECT_GT(failed, 50);
  EXPECT_GT(passed, 50);
}

// What rises is worse, or better where less is: a median's two sides are each other's mirror.
TEST(PairedMeasure, DecidesAMedianByHowManyPairsAreWithinTheMargin) {
  for (const double worse : {1.0, -1.0})
    for (const double change : {0.0, 0.4, 0.6, -0.6}) {
      PairedMeasure measure(MeasureKind::kMedian, worse,
                            PairedDesign{.margin = 0.5, .alpha = 0.01, .beta = 0.1, .most = 60});
      for (int i = 0; i < 60; ++i) measure.Add(i, i + worse * change, i, i);
      EXPECT_EQ(measure.verdict(), change > 0.5 ? Verdict::kFail : Verdict::kPass) << change;
      EXPECT_NEAR(*measure.Result().difference, worse * change, 1e-12);
      EXPECT_EQ(measure.Result().worse, change > 0 ? 60 : 0);
    }
}

}  // namespace
}  // namespace turbidock::statistics
