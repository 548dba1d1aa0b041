// Sequential tests: their error rates, by sums over all paths that share nothing with the tests'
// own sums, and counted in simulated sequences.

#include "experiments/statistics/sequential_test.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "experiments/studies/gate/error_rates.h"
#include "tests/support/binomial.h"

namespace turbidock::gate {
namespace {

// Probability to reject within max_trials: every sequence of hits and misses by itself.
double RejectionByEnumeration(const statistics::HitTest& test, double p) {
  double rate = 0;
  const int n = test.max_trials();
  for (uint32_t sequence = 0; sequence < (1u << n); ++sequence) {
    int hits = 0;
    bool rejected = false;
    for (int trial = 1; trial <= n; ++trial) {
      hits += (sequence >> (trial - 1)) & 1;
      rejected = rejected || test.Rejects(trial, hits);
    }
    if (rejected) rate += std::pow(p, hits) * std::pow(1 - p, n - hits);
  }
  return rate;
}

TEST(HitTest, ItsRejectionRateIsTheSumOverAllSequences) {
  int compared = 0;
  for (const double p_null : {0.1, 0.5, 0.8})
    for (const double level : {0.3, 0.05}) {
      const statistics::HitTest test(
          {.p_null = p_null, .p_alternative = (1 + p_null) / 2, .level = level, .max_trials = 14});
      for (const double p : {0.02, p_null, 0.9}) {
        EXPECT_NEAR(test.RejectionRate(p), RejectionByEnumeration(test, p), 1e-12);
        ++compared;
      }
      EXPECT_LE(RejectionByEnumeration(test, p_null), level);
    }
  EXPECT_EQ(compared, 18);
}

TEST(HitTest, NeverExceedsItsLevelAndIsNotIdle) {
  for (const double p_null : {0.01, 0.3, 0.5, 0.9, 0.99})
    for (const double level : {0.2, 0.05, 0.001})
      for (const int max_trials : {1, 2, 7, 40, 500}) {
        const statistics::HitTest test({.p_null = p_null,
                                        .p_alternative = p_null + (1 - p_null) / 2,
                                        .level = level,
                                        .max_trials = max_trials});
        EXPECT_LE(test.RejectionRate(p_null), level);
        // a smaller probability of a hit is further from being rejected
        EXPECT_LE(test.RejectionRate(p_null / 2), test.RejectionRate(p_null));
        EXPECT_GE(test.RejectionRate((1 + p_null) / 2), test.RejectionRate(p_null));
        // the least probable path alone, all hits, is worth rejecting as soon as it is rare enough
        if (std::pow(p_null, max_trials) < 0.1 * level) {
          EXPECT_GT(test.RejectionRate(p_null), 0);
          EXPECT_LE(test.least_hits(max_trials), max_trials);
        }
      }
}

// P(ever rejecting) when a pair is lost or gained with these probabilities: over all counts.
double RejectionRate(const statistics::NetLossTest& test, double p_loss, double p_gain,
                     int max_pairs) {
  const auto size = static_cast<size_t>(max_pairs) + 1;
  std::vector<std::vector<double>> now(size, std::vector<double>(size, 0.0));
  now[0][0] = 1;
  double rate = 0;
  for (int n = 1; n <= max_pairs; ++n) {
    std::vector<std::vector<double>> next(size, std::vector<double>(size, 0.0));
    for (int l = 0; l < n; ++l)
      for (int g = 0; l + g < n; ++g) {
        const double p = now[l][g];
        if (p == 0) continue;
        next[l][g] += p * (1 - p_loss - p_gain);
        next[l + 1][g] += p * p_loss;
        next[l][g + 1] += p * p_gain;
      }
    for (int l = 0; l <= n; ++l)
      for (int g = 0; l + g <= n; ++g)
        if (next[l][g] > 0 && test.Rejects(n, l, g)) {
          rate += next[l][g];
          next[l][g] = 0;
        }
    now.swap(next);
  }
  return rate;
}

TEST(NetLossTest, NeverExceedsItsLevelHoweverManyPairsDiffer) {
  for (const double margin : {0.05, 0.2, 0.5})
    for (const double level : {0.1, 0.01}) {
      const statistics::NetLossTest test(margin, level);
      for (const double p_gain : {0.0, 0.02, 0.1, (1 - margin) / 2})
        EXPECT_LE(RejectionRate(test, p_gain + margin, p_gain, 90), level)
            << margin << " " << p_gain;
      // and it does reject when nothing is lost
      EXPECT_EQ(RejectionRate(test, 0, 0, 200), 1);
    }
}

TEST(NetLossTest, TheLargestStakeIsTheLimit) {
  // One loss more than the stakes allow would make a wealth negative: more losses never help.
  const statistics::NetLossTest test(0.2, 0.05);
  for (int pairs = 1; pairs < 60; ++pairs)
    for (int losses = 1; losses <= pairs; ++losses)
      EXPECT_LE(test.Rejects(pairs, losses, 0), test.Rejects(pairs, losses - 1, 0));
}

TEST(RateTest, ItsVerdictsAreTheSumOverAllSequences) {
  const statistics::RateTest test(
      {.no_worse = 0.8, .worse = 0.3, .alpha = 0.1, .beta = 0.2, .max_trials = 14});
  for (const double p : {0.1, 0.3, 0.55, 0.8}) {
    double fail = 0, pass = 0, trials = 0;
    for (uint32_t sequence = 0; sequence < (1u << 14); ++sequence) {
      const int all = __builtin_popcount(sequence);
      const double probability = std::pow(p, all) * std::pow(1 - p, 14 - all);
      int n = 0, successes = 0;
      std::optional<statistics::Verdict> verdict;
      while (!verdict && n < 14) {
        successes += (sequence >> n) & 1;
        verdict = test.Decide(++n, successes);
      }
      fail += verdict == statistics::Verdict::kFail ? probability : 0;
      pass += verdict == statistics::Verdict::kPass ? probability : 0;
      trials += n * probability;
    }
    const statistics::RateTest::Characteristic c = test.At(p);
    EXPECT_NEAR(c.p_fail, fail, 1e-12);
    EXPECT_NEAR(c.p_pass, pass, 1e-12);
    EXPECT_NEAR(c.p_inconclusive, 1 - fail - pass, 1e-12);
    EXPECT_NEAR(c.expected_trials, trials, 1e-10);
  }
}

TEST(FixedSampleTest, IsTheSmallest) {
  const statistics::RateTestDesign design{
      .no_worse = 0.95, .worse = 0.85, .alpha = 0.05, .beta = 0.05};
  const statistics::FixedTest fixed = statistics::FixedSampleTest(design);
  EXPECT_LE(testing::BinomialAtMost(fixed.fail_at_most, fixed.trials, 0.95), 0.05);
  EXPECT_LE(1 - testing::BinomialAtMost(fixed.fail_at_most, fixed.trials, 0.85), 0.05);
  for (int n = 1; n < fixed.trials; ++n)
    for (int k = 0; k < n; ++k)
      EXPECT_FALSE(testing::BinomialAtMost(k, n, 0.95) <= 0.05 &&
                   1 - testing::BinomialAtMost(k, n, 0.85) <= 0.05)
          << n << " " << k;
}

TEST(RateTest, TakesAtLeastThirtyPercentFewerTrialsThanATestOfFixedSize) {
  for (const double error : {0.1, 0.05, 0.01}) {
    statistics::RateTestDesign design{
        .no_worse = 0.95, .worse = 0.85, .alpha = error, .beta = error};
    design.max_trials = statistics::TrialsToDecide(design, 0.01);
    const statistics::RateTest test(design);
    const double fixed = statistics::FixedSampleTest(design).trials;
    for (const double p : {0.95, 0.85}) {
      EXPECT_LE(test.At(p).expected_trials, 0.7 * fixed) << error << " " << p;
      EXPECT_LE(test.At(p).p_inconclusive, 0.01);
    }
    EXPECT_LE(test.At(0.95).p_fail, error);
    EXPECT_LE(test.At(0.85).p_pass, error);
    design.max_trials -= 1;
    const statistics::RateTest shorter(design);
    EXPECT_GT(std::max(shorter.At(0.95).p_inconclusive, shorter.At(0.85).p_inconclusive), 0.01);
  }
}

TEST(ErrorRates, TenThousandSequencesKeepAlphaAndBetaInEverySetting) {
  struct Case {
    double rate, margin, error;
  };
  int settings = 0;
  for (const Case& c : {Case{0.95, 0.1, 0.05}, Case{0.8, 0.2, 0.1}, Case{0.95, 0.1, 0.01}}) {
    statistics::RateTestDesign design{
        .no_worse = c.rate, .worse = c.rate - c.margin, .alpha = c.error, .beta = c.error};
    design.max_trials = statistics::TrialsToDecide(design, 0.01);
    for (const gate::ErrorRateSetting& setting : gate::StatedSettings(design)) {
      const ErrorRates rates = gate::SimulateSequences(setting, design, 10000, 1);
      if (setting.new_rate == design.no_worse)
        EXPECT_LE(rates.fail_rate(), c.error) << NameOf(setting.coupling);
      else
        EXPECT_LE(rates.pass_rate(), c.error) << NameOf(setting.coupling);
      EXPECT_LE(rates.mean_trials, design.max_trials);
      ++settings;
    }
  }
  EXPECT_EQ(settings, 18);
}

}  // namespace
}  // namespace turbidock::gate
