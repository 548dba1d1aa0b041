// Sequential tests: their error rates, by sums over all paths that share nothing with the tests'
// own sums, and counted in simulated sequences.

#include "experiments/statistics/sequential_test.h"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "sim/base/random.h"
#include "tests/statistics/rate_test.h"

namespace turbidock::statistics {
namespace {

// P(ever rejecting) when a pair is lost or gained with these probabilities: over all counts.
double RejectionRate(const NetLossTest& test, double p_loss, double p_gain, int max_pairs) {
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

// How often pairs of trials, drawn by chance and judged one after another, come to each verdict.
struct Counted {
  double fail = 0, pass = 0;
};
Counted Count(const RateTest& test, bool alike, double old_rate, double new_rate, int max_pairs) {
  constexpr int kSequences = 10000;
  Rng rng = SeedTree(1).Stream("gate.sequences");
  Counted counted;
  for (int s = 0; s < kSequences; ++s) {
    int pairs = 0, losses = 0, gains = 0;
    std::optional<Verdict> verdict;
    while (!verdict && pairs < max_pairs) {
      const bool was = rng.Uniform() < old_rate;
      const double u = rng.Uniform();
      // of builds that are alike the new one loses what docked with the probability that gives its
      // rate; others have nothing to do with each other
      const bool is = alike ? was && u < new_rate / old_rate : u < new_rate;
      ++pairs;
      losses += was && !is;
      gains += !was && is;
      verdict = test.Decide(pairs, losses, gains);
    }
    counted.fail += verdict == Verdict::kFail;
    counted.pass += verdict == Verdict::kPass;
  }
  return {counted.fail / kSequences, counted.pass / kSequences};
}

TEST(RateTest, TenThousandSequencesKeepAlphaAndBetaInEverySetting) {
  struct Case {
    double rate, margin, error;
  };
  for (const Case& c : {Case{0.95, 0.1, 0.05}, Case{0.8, 0.2, 0.1}, Case{0.95, 0.1, 0.01}})
    for (const bool alike : {true, false}) {
      const RateTest test(c.margin, c.error, c.error, 200);
      EXPECT_LE(Count(test, alike, c.rate, c.rate, 200).fail, c.error) << alike;
      EXPECT_LE(Count(test, alike, c.rate, c.rate - c.margin, 200).pass, c.error) << alike;
    }
}

}  // namespace
}  // namespace turbidock::statistics
