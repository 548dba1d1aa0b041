// The stated errors of arithmetic without libraries, and the noise made with it.
#include "sim/base/vector_math.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace turbidock {
namespace {

TEST(Exp2, IsWithinItsError) {
  double worst = 0;
  for (int i = -125000; i <= 125000; ++i) {
    const float x = static_cast<float>(i) / 1000;
    worst = std::max(worst, std::abs(Exp2(x) / std::exp2(double{x}) - 1));
  }
  EXPECT_LT(worst, 3e-7);
  EXPECT_EQ(Exp2(-1e9f), Exp2(-125));
  EXPECT_EQ(Exp2(1e9f), Exp2(125));
}

TEST(ExpMinus, IsWithinItsError) {
  for (int i = 0; i <= 80000; ++i) {
    const float x = static_cast<float>(i) / 1000;
    ASSERT_LE(std::abs(ExpMinus(x) / std::exp(-double{x}) - 1), 3e-7 + 1e-7 * x) << x;
  }
  EXPECT_LT(ExpMinus(INFINITY), 3e-38f);
}

TEST(Log2, IsWithinItsError) {
  double worst = 0;
  for (float x = 1e-30f; x < 1e30f; x *= 1.0003f)
    worst = std::max(worst, std::abs(Log2(x) - std::log2(double{x})));
  EXPECT_LT(worst, 4e-5);
  EXPECT_GT(worst, 1e-7);
  EXPECT_LT(Log2(0), -126);
  EXPECT_GT(Log2(0), -130);
}

// All sums of four bytes with their weights: the distribution exactly.
TEST(NormalFromBits, EndsBelowItsBound) {
  for (const uint32_t bits : {0u, 0xffffffffu}) {
    EXPECT_LT(std::abs(NormalFromBits(bits)), kMaxNormal);
    EXPECT_GT(std::abs(NormalFromBits(bits)), 0.98f * kMaxNormal);
  }
}

TEST(NormalFromBits, HasTheNormalMoments) {
  std::vector<double> weight(1021, 0), next;
  weight[0] = 1;
  for (int byte = 0; byte < 4; ++byte) {
    next.assign(1021, 0);
    for (size_t sum = 0; sum + 255 < 1021; ++sum)
      for (size_t value = 0; value < 256; ++value) next[sum + value] += weight[sum] / 256;
    weight = next;
  }
  double mean = 0, m2 = 0, m3 = 0, m4 = 0, beyond3 = 0, below = 0, distance = 0, most = 0;
  for (size_t sum = 0; sum < 1021; ++sum) {
    // some word whose bytes have that sum
    uint32_t bits = 0;
    for (size_t rest = sum, byte = 0; byte < 4; ++byte) {
      const size_t value = std::min<size_t>(rest, 255);
      bits |= static_cast<uint32_t>(value << (8 * byte));
      rest -= value;
    }
    const double z = NormalFromBits(bits), w = weight[sum];
    mean += w * z;
    m2 += w * z * z;
    m3 += w * z * z * z;
    m4 += w * z * z * z * z;
    if (std::abs(z) > 3) beyond3 += w;
    most = std::max(most, z);
    distance =
        std::max(distance, std::abs(below + w / 2 - 0.5 * std::erfc(-z / std::numbers::sqrt2)));
    below += w;
  }
  EXPECT_NEAR(below, 1, 1e-12);
  EXPECT_NEAR(mean, 0, 1e-7);
  EXPECT_NEAR(m2, 1, 1e-6);
  EXPECT_NEAR(m3, 0, 1e-6);
  EXPECT_NEAR(m4, 3, 1e-5);
  EXPECT_NEAR(beyond3, 0.0024, 0.0001);
  EXPECT_NEAR(most, 4.04, 0.005);
  EXPECT_LT(distance, 0.0025);
}

// Every bit of the result changes for half of the flips of any bit of the counter or the key it
// begins at: 4000 trials know the share to 0.008; five of these.
TEST(Mix, AvalanchesFromEveryBit) {
  constexpr int kTrials = 4000;
  int worst = 0, compared = 0;
  for (int input = 0; input < 64; ++input) {
    std::array<int, 32> flips{};
    for (int trial = 0; trial < kTrials; ++trial) {
      const uint32_t t = static_cast<uint32_t>(trial);
      std::array<uint32_t, 2> in = {t, 77777u * t + 5u};
      const uint32_t before = Mix(in[0], in[1], 1234567u * t + 99u);
      in[static_cast<size_t>(input / 32)] ^= 1u << (input % 32);
      const uint32_t change = before ^ Mix(in[0], in[1], 1234567u * t + 99u);
      for (int bit = 0; bit < 32; ++bit) flips[static_cast<size_t>(bit)] += (change >> bit) & 1;
    }
    for (const int count : flips) {
      worst = std::max(worst, std::abs(count - kTrials / 2));
      ++compared;
    }
  }
  EXPECT_EQ(compared, 64 * 32);
  EXPECT_LT(worst, 5 * 32) << "of " << kTrials;
}

}  // namespace
}  // namespace turbidock
