#pragma once
// Arithmetic for loops that the compiler is to vectorise: without calls, branches or tables. Each
// function states its error; results are the same bits with every instruction set.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace turbidock {

// 2^x within 3e-7 of itself for |x| <= 125; beyond, that of the nearer bound.
[[gnu::always_inline]] inline float Exp2(float x) {
  x = x < -125.0f ? -125.0f : x;
  x = x > 125.0f ? 125.0f : x;
  // Adding 1.5 x 2^23 leaves the nearest whole number in the low bits.
  constexpr float kRound = 12582912.0f;
  const float shifted = x + kRound;
  const float f = x - (shifted - kRound);
  // minimax on [-1/2, 1/2]
  const float mantissa =
      1.0000001192f +
      f * (0.6931469440f +
           f * (0.2402212024f + f * (0.0555071309f + f * (0.0096755410f + f * 0.0013276471f))));
  const int32_t exponent = static_cast<int32_t>(std::bit_cast<uint32_t>(shifted) << 23);
  return std::bit_cast<float>(std::bit_cast<int32_t>(mantissa) + exponent);
}

// e^-x for x >= 0, within 3e-7 + 1e-7 x of itself; at least 2e-38.
[[gnu::always_inline]] inline float ExpMinus(float x) { return Exp2(-1.44269504f * x); }

// Base 2 logarithm of a positive normal number within 4e-5; -127 or so for 0.
[[gnu::always_inline]] inline float Log2(float x) {
  // The mantissa in [sqrt(1/2), sqrt(2)).
  constexpr int32_t kSqrtHalf = 0x3f3504f3;
  const int32_t bits = std::bit_cast<int32_t>(x) - kSqrtHalf;
  const float exponent = static_cast<float>(bits >> 23);
  const float f = std::bit_cast<float>((bits & 0x007fffff) + kSqrtHalf) - 1.0f;
  // minimax of log2(1 + f) / f
  return exponent +
         f * (1.4426558018f + f * (-0.7204624414f +
                                   f * (0.4846482873f + f * (-0.3924614191f + f * 0.2611697614f))));
}

// Well-mixed bits from a counter: two rounds of multiply and xor-shift (constants that others found
// in a search for the least bias), begun at one random key and turned to another sequence by a
// second, so that sequences of different keys do not run into each other.
[[gnu::always_inline]] inline uint32_t Mix(uint32_t counter, uint32_t key0, uint32_t key1) {
  uint32_t x = counter * 0x9E3779B9u + key0;
  x = (x ^ (x >> 16)) * 0x21F0AAADu;
  x = (x ^ (x >> 15) ^ key1) * 0xD35A2D97u;
  return x ^ (x >> 15);
}

// The largest that NormalFromBits gives is below.
inline constexpr float kMaxNormal = 4.1f;

// A normal number from 32 bits: the sum of their four bytes, with a cubic term that makes mean,
// variance, skewness and kurtosis those of the normal distribution. The distribution function is
// within 0.0025 of the normal one; the ends are at 4.04 standard deviations (beyond 3: 0.0024 of
// all draws, normal 0.0027).
[[gnu::always_inline]] inline float NormalFromBits(uint32_t bits) {
  const uint32_t pairs = (bits & 0x00ff00ffu) + ((bits >> 8) & 0x00ff00ffu);
  const float sum =
      static_cast<float>(static_cast<int32_t>((pairs + (pairs >> 16)) & 0xffffu) - 510);
  return sum * (6.421040613e-3f + 5.773954283e-9f * (sum * sum));
}

// Cut off to a whole number and held within 0 to 255. Whole numbers are clamped by one instruction,
// other ones by two.
[[gnu::always_inline]] inline uint8_t ToByte(float value) {
  return static_cast<uint8_t>(std::clamp(static_cast<int32_t>(value), 0, 255));
}

}  // namespace turbidock
