// Pairs of one seed in several cells are alike: what is sure follows from the seeds.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "experiments/statistics/paired_measure.h"
#include "experiments/statistics/paired_tests.h"
#include "sim/base/random.h"

namespace turbidock::statistics {
namespace {

// Over all signs that the sums could have had.
double SignFlipByCounting(const std::vector<int64_t>& sums) {
  int64_t total = 0;
  for (const int64_t sum : sums) total += sum;
  const int ways = 1 << sums.size();
  int as_far = 0;
  for (int signs = 0; signs < ways; ++signs) {
    int64_t flipped = 0;
    for (size_t i = 0; i < sums.size(); ++i) flipped += (signs >> i) & 1 ? sums[i] : -sums[i];
    as_far += std::abs(flipped) >= std::abs(total);
  }
  return static_cast<double>(as_far) / ways;
}

TEST(SignFlip, IsWhatCountingGives) {
  Rng rng = SeedTree(5).Stream("sums");
  for (int draw = 0; draw < 200; ++draw) {
    std::vector<int64_t> sums(static_cast<size_t>(1 + draw % 10));
    for (int64_t& sum : sums) sum = std::lround(rng.Uniform(-4, 4));
    EXPECT_NEAR(SignFlipP(sums), SignFlipByCounting(sums), 1e-12);
  }
}

TEST(SignFlip, OfManySeedsIsNearItsExactValue) {
  Rng rng = SeedTree(6).Stream("sums");
  std::vector<int64_t> sums(1000);
  for (int64_t& sum : sums) sum = 1 + (rng.Uniform() < 0.5 ? 1 : 0);
  for (size_t i = 0; i < 470; ++i) sums[i] *= -1;
  const double exact = SignFlipP(sums);
  sums.push_back(1);  // by the normal approximation
  sums.push_back(-1);
  EXPECT_NEAR(SignFlipP(sums), exact, 0.003);
  EXPECT_GT(exact, 0.02);
}

// Each pair so many times, as cells that do not differ would bring it.
PairedResult Copied(MeasureKind kind, int copies) {
  PairedMeasure measure(kind, -1);
  for (int seed = 0; seed < 14; ++seed)
    for (int copy = 0; copy < copies; ++copy) {
      if (kind == MeasureKind::kRate)
        measure.Add(seed < 12, seed >= 5, seed, seed);
      else
        measure.Add(10, 10 + seed * seed - 30, seed, seed);
    }
  return measure.Result();
}

TEST(PairedMeasure, CopiesOfPairsSayNothingNew) {
  for (const MeasureKind kind : {MeasureKind::kRate, MeasureKind::kMedian}) {
    const PairedResult once = Copied(kind, 1), often = Copied(kind, 8);
    EXPECT_EQ(often.pairs, 8 * once.pairs);
    EXPECT_EQ(often.seeds, once.seeds);
    EXPECT_NEAR(often.p_value, once.p_value, 1e-12);
    EXPECT_NEAR(*often.difference, *once.difference, 1e-12);
    EXPECT_EQ(once.cluster_effect, 1);
    // With a half in each cell added once and not to each copy.
    EXPECT_NEAR(often.interval_95->low, once.interval_95->low,
                kind == MeasureKind::kRate ? 0.02 : 0);
    EXPECT_NEAR(often.interval_95->high, once.interval_95->high,
                kind == MeasureKind::kRate ? 0.02 : 0);
  }
}

// Four seeds cannot tell at 5 %, however many cells they lose.
TEST(PairedMeasure, IntervalAndTestSayTheSame) {
  for (const int seeds : {4, 6}) {
    PairedMeasure measure(MeasureKind::kRate, -1);
    for (int seed = 0; seed < seeds; ++seed)
      for (int cell = 0; cell < 6; ++cell) measure.Add(1, cell < 2, cell, seed);
    const PairedResult result = measure.Result();
    EXPECT_EQ(result.p_value, std::pow(2.0, 1 - seeds));
    EXPECT_EQ(result.interval_95->high < 0, seeds == 6);
    EXPECT_LT(result.interval_95->low, *result.difference);
  }
}

TEST(SuccessInterval, IsOfTheSeedsWhereCellsDoNotDiffer) {
  std::vector<RatedTrial> once, often;
  for (int seed = 0; seed < 20; ++seed)
    for (int copy = 0; copy < 6; ++copy) {
      const RatedTrial trial{.success = seed % 4 != 0, .stratum = 0, .seed = seed};
      if (copy == 0) once.push_back(trial);
      often.push_back(trial);
    }
  const Interval plain = WilsonInterval(15, 20);
  EXPECT_EQ(SuccessInterval(once).AsList(), plain.AsList());
  // 20 / 19 is what the mean of twenty varies more than that of six times as many would let expect
  EXPECT_NEAR(SuccessInterval(often).low, plain.low, 0.01);
  EXPECT_NEAR(SuccessInterval(often).high, plain.high, 0.01);
  for (RatedTrial& trial : often) trial.success = true;
  EXPECT_NEAR(SuccessInterval(often).low, WilsonInterval(20, 20).low, 1e-12);
  for (size_t i = 0; i < often.size(); ++i) often[i].seed = static_cast<int64_t>(i);
  EXPECT_EQ(SuccessInterval(often).AsList(), WilsonInterval(120, 120).AsList());
}

// Four seeds in four cells: whatever few fail, the interval holds what it would if none did.
TEST(SuccessInterval, IsNotSurerOfMixedEndsThanOfEqualOnes) {
  std::vector<RatedTrial> trials;
  for (int seed = 0; seed < 4; ++seed)
    for (int cell = 0; cell < 4; ++cell)
      trials.push_back({.success = true, .stratum = 0, .seed = seed});
  const double best = SuccessInterval(trials).low;
  EXPECT_NEAR(best, WilsonInterval(4, 4).low, 1e-12);
  for (unsigned failed = 1; failed < 1u << 16; failed += 7) {
    for (size_t i = 0; i < trials.size(); ++i) trials[i].success = (failed >> i & 1) == 0;
    const Interval interval = SuccessInterval(trials);
    EXPECT_LE(interval.low, best) << failed;
    EXPECT_GE(interval.high, 1 - best) << failed;
  }
}

TEST(ComparePairs, CopiesOfPairsSayNothingNew) {
  const std::vector<double> a = {3, 1, 4, 1, 5, 9}, b = {2, 7, 1, 8, 2, 8};
  std::vector<double> more_a, more_b;
  std::vector<int64_t> units;
  for (int copy = 0; copy < 5; ++copy)
    for (size_t i = 0; i < a.size(); ++i) {
      more_a.push_back(a[i]);
      more_b.push_back(b[i]);
      units.push_back(static_cast<int64_t>(i));
    }
  const PairedComparison once = ComparePairs(a, b), often = ComparePairs(more_a, more_b, units);
  EXPECT_NEAR(often.t_p, once.t_p, 1e-12);
  EXPECT_NEAR(often.confidence.low, once.confidence.low, 1e-12);
  EXPECT_EQ(ComparePairs({1, 2}, {2, 4}, {7, 7}).t_p, 1) << "one seed says nothing";
}

// Twelve seeds in six cells, each of which is hard or easy on both sides, which do the same: the
// test by seeds keeps its level and the intervals hold, where pairs by themselves do not.
TEST(PairedMeasure, KeepsItsLevelWhereCellsShareSeeds) {
  Rng rng = SeedTree(7).Stream("cells");
  constexpr int kDraws = 2000, kSeeds = 12, kCells = 6;
  int by_seed = 0, by_pair = 0, held = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    PairedMeasure measure(MeasureKind::kRate, -1);
    for (int seed = 0; seed < kSeeds; ++seed) {
      const double rate_a = rng.Uniform() < 0.5 ? 0.9 : 0.3,
                   rate_b = rng.Uniform() < 0.5 ? 0.9 : 0.3;
      for (int cell = 0; cell < kCells; ++cell)
        measure.Add(rng.Uniform() < rate_a, rng.Uniform() < rate_b, 0, seed);
    }
    const PairedResult result = measure.Result();
    by_seed += result.p_value <= 0.05;
    by_pair += McNemarExactP(result.worse, result.better) <= 0.05;
    held += result.interval_95->low <= 0 && result.interval_95->high >= 0;
  }
  const double error = 3 * std::sqrt(0.05 * 0.95 * kDraws);
  EXPECT_LE(by_seed, 0.05 * kDraws + error);
  EXPECT_GE(by_seed, 0.02 * kDraws);
  EXPECT_GE(held, 0.92 * kDraws);
  EXPECT_GT(by_pair, 0.1 * kDraws);
}

}  // namespace
}  // namespace turbidock::statistics
