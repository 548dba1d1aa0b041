// Sequential tests: their error rates, by sums over all paths that share nothing with the tests'
// own sums, and counted in simulated sequences.

#include "experiments/statistics/sequential_test.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "tests/studies/gate/simulated_sequences.h"
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

TEST(PairedRateTest, WhatItSaysOfABuildIsTheSumOverAllSequences) {
  constexpr int kPairs = 9;
  const statistics::PairedRateTest test(0.5, 0.2, 0.25, kPairs);
  for (const auto& [loss, gain] : {std::pair{0.0, 0.0}, {0.5, 0.0}, {0.2, 0.3}, {0.7, 0.1}}) {
    const std::array<double, 3> p = {1 - loss - gain, loss, gain};
    double fail = 0, pass = 0, trials = 0, undecided = 0;
    for (int sequence = 0; sequence < static_cast<int>(std::pow(3, kPairs)); ++sequence) {
      double probability = 1;
      std::array<int, 3> counts{};
      std::optional<statistics::Verdict> verdict;
      int pairs = 0, decided_after = kPairs;
      for (int rest = sequence; pairs < kPairs; rest /= 3) {
        const auto kind = static_cast<size_t>(rest % 3);
        probability *= p[kind];
        ++counts[kind];
        ++pairs;
        if (verdict) continue;
        verdict = test.Decide(pairs, counts[1], counts[2]);
        if (verdict) decided_after = pairs;
      }
      fail += verdict == statistics::Verdict::kFail ? probability : 0;
      pass += verdict == statistics::Verdict::kPass ? probability : 0;
      undecided += verdict ? 0 : probability;
      trials += decided_after * probability;
    }
    const statistics::Characteristic c = test.At(loss, gain);
    EXPECT_NEAR(c.p_fail, fail, 1e-12) << loss;
    EXPECT_NEAR(c.p_pass, pass, 1e-12) << loss;
    EXPECT_NEAR(c.p_inconclusive, undecided, 1e-12) << loss;
    EXPECT_NEAR(c.expected_trials, trials, 1e-10) << loss;
    EXPECT_TRUE(loss != 0.2 || (fail > 0.001 && pass > 0.001 && undecided > 0.001));
  }
}

// The smallest test of fixed size with these error rates.
int FixedSize(double no_worse, double worse, double error) {
  int fail_at_most = -1;  // a further trial never takes from it
  for (int n = 1;; ++n) {
    while (testing::BinomialAtMost(fail_at_most + 1, n, no_worse) <= error) ++fail_at_most;
    if (1 - testing::BinomialAtMost(fail_at_most, n, worse) <= error) return n;
  }
}

TEST(RateTest, TakesAtLeastThirtyPercentFewerTrialsThanATestOfFixedSize) {
  EXPECT_EQ(FixedSize(0.95, 0.85, 0.05), 93);
  for (const double error : {0.1, 0.05, 0.01}) {
    constexpr int kMost = 400, kSequences = 4000;
    const statistics::RateTest test(
        {.no_worse = 0.95, .worse = 0.85, .alpha = error, .beta = error, .max_trials = kMost});
    const double fixed = FixedSize(0.95, 0.85, error);
    for (const double rate : {0.95, 0.85}) {
      const Counted counted =
          CountSequences(Coupling::kIndependent, 1, rate, kMost, kSequences, 1,
                         [&](int n, int docked, int, int) { return test.Decide(n, docked); });
      EXPECT_LE(counted.mean_trials, 0.7 * fixed) << error << " " << rate;
      EXPECT_GE(counted.pass + counted.fail, 0.99);
      EXPECT_LE(rate == 0.95 ? counted.fail : counted.pass, error);
    }
  }
}

TEST(PairedRateTest, TenThousandSequencesKeepAlphaAndBetaInEverySetting) {
  struct Case {
    double rate, margin, error;
  };
  for (const Case& c : {Case{0.95, 0.1, 0.05}, Case{0.8, 0.2, 0.1}, Case{0.95, 0.1, 0.01}})
    for (const auto& [coupling, name] : EnumNames<Coupling>::kNames) {
      const statistics::PairedRateTest test(c.margin, c.error, c.error, 200);
      EXPECT_LE(CountPairs(test, coupling, c.rate, c.rate, 10000, 1).fail, c.error) << name;
      EXPECT_LE(CountPairs(test, coupling, c.rate, c.rate - c.margin, 10000, 1).pass, c.error)
          << name;
    }
}

}  // namespace
}  // namespace turbidock::gate
