#include "sim/base/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

namespace turbidock {
namespace {

constexpr int kDraws = 200000;

TEST(Random, PhiloxKnownAnswer) {
  // Random123's known-answer test vectors for philox4x32-10.
  EXPECT_EQ(PhiloxBlock(0, 0, 0),
            (std::array<uint32_t, 4>{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(PhiloxBlock(~0ull, ~0ull, ~0ull),
            (std::array<uint32_t, 4>{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
}

TEST(Random, StreamsOfTheSameNameRepeatAndOthersDiffer) {
  const SeedTree seeds(42);
  Rng a = seeds.Stream("camera.left"), b = seeds.Stream("camera.left");
  Rng c = seeds.Stream("camera.right"), d = SeedTree(43).Stream("camera.left");
  int equal_c = 0, equal_d = 0;
  for (int i = 0; i < 1000; ++i) {
    const uint64_t x = a.NextU64();
    EXPECT_EQ(x, b.NextU64());
    equal_c += x == c.NextU64();
    equal_d += x == d.NextU64();
  }
  EXPECT_EQ(equal_c, 0);
  EXPECT_EQ(equal_d, 0);
}

TEST(Random, SkippingIsDrawing) {
  for (const int drawn : {0, 1, 2, 3})  // 32 bits each, before it skips
    for (const uint64_t count : {0, 1, 2, 3, 4, 7, 100}) {
      Rng skips = SeedTree(7).Stream("skip"), draws = skips;
      for (int i = 0; i < drawn; ++i) EXPECT_EQ(skips.NextU32(), draws.NextU32());
      skips.SkipU64(count);
      for (uint64_t i = 0; i < count; ++i) draws.NextU64();
      for (int i = 0; i < 5; ++i) EXPECT_EQ(skips.NextU32(), draws.NextU32()) << drawn << count;
    }
}

TEST(Random, UniformMomentsAndRange) {
  Rng rng = SeedTree(1).Stream("uniform");
  double sum = 0, squares = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = rng.Uniform();
    ASSERT_GE(x, 0);
    ASSERT_LT(x, 1);
    sum += x;
    squares += x * x;
  }
  // Four standard errors: sqrt(1/12/n) and sqrt((1/5 - 1/9)/n).
  EXPECT_NEAR(sum / kDraws, 0.5, 4 * std::sqrt(1.0 / 12 / kDraws));
  EXPECT_NEAR(squares / kDraws, 1.0 / 3, 4 * std::sqrt(4.0 / 45 / kDraws));
}

TEST(Random, NormalMoments) {
  Rng rng = SeedTree(2).Stream("normal");
  double sum = 0, squares = 0, fourth = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = rng.Normal();
    sum += x;
    squares += x * x;
    fourth += x * x * x * x;
  }
  EXPECT_NEAR(sum / kDraws, 0, 4 / std::sqrt(kDraws));
  EXPECT_NEAR(squares / kDraws, 1, 4 * std::sqrt(2.0 / kDraws));
  EXPECT_NEAR(fourth / kDraws, 3, 4 * std::sqrt(96.0 / kDraws));
}

TEST(Random, BelowIsUnbiasedAndBounded) {
  Rng rng = SeedTree(3).Stream("below");
  std::vector<int> counts(7);
  for (int i = 0; i < kDraws; ++i) ++counts.at(rng.Below(7));
  double chi_squared = 0;
  for (const int n : counts)
    chi_squared += (n - kDraws / 7.0) * (n - kDraws / 7.0) / (kDraws / 7.0);
  EXPECT_LT(chi_squared, 22.5);  // 99.9 % point with 6 degrees of freedom
  EXPECT_EQ(rng.Below(1), 0u);
}

TEST(Random, TrialSeedsAreDistinct) {
  const SeedTree master(7);
  std::set<int64_t> seen;
  for (int64_t i = 0; i < 10000; ++i) seen.insert(master.TrialSeed(i));
  EXPECT_GE(*seen.begin(), 0);
  EXPECT_EQ(seen.size(), 10000u);
  EXPECT_EQ(master.TrialSeed(3), SeedTree(7).TrialSeed(3));
  EXPECT_NE(master.TrialSeed(3), SeedTree(8).TrialSeed(3));
}

}  // namespace
}  // namespace turbidock
