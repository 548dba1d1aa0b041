#pragma once
// Counter-based random streams. One 64-bit seed; every consumer draws from a stream of its own
// name, so that a new consumer never shifts another's numbers. The transforms to uniform and normal
// are written out here because the standard library's are not specified bit for bit.

#include <array>
#include <cstdint>
#include <string_view>

namespace turbidock {

// One stream: Philox4x32-10 (Salmon et al., SC 2011) keyed by seed and name.
class Rng {
 public:
  Rng(uint64_t key, uint64_t stream) : key_(key), stream_(stream) {}

  uint32_t NextU32();
  uint64_t NextU64() { return (static_cast<uint64_t>(NextU32()) << 32) | NextU32(); }
  // As so many calls of NextU64, at the cost of two at most from the stream's beginning.
  void SkipU64(uint64_t count);
  double Uniform();  // [0, 1), 53 bits
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  uint32_t Below(uint32_t n);  // {0, ..., n - 1}, unbiased; n > 0
  double Normal();             // mean 0, variance 1 (Box-Muller)

 private:
  uint64_t key_, stream_, counter_ = 0;
  std::array<uint32_t, 4> block_{};
  int used_ = 4;
  double spare_normal_ = 0;
  bool has_spare_normal_ = false;
};

// The root of all randomness of a trial.
class SeedTree {
 public:
  explicit SeedTree(uint64_t seed) : seed_(seed) {}

  uint64_t seed() const { return seed_; }
  // The stream of that name, from its beginning. The same name gives the same numbers.
  Rng Stream(std::string_view name) const;
  // Seed of trial `index` of a batch whose master seed this is; never negative.
  int64_t TrialSeed(int64_t index) const;

 private:
  uint64_t seed_;
};

// 64 well-mixed bits at random access from a key and two counters: noise that depends on place and
// time only, never on the order of evaluation.
std::array<uint32_t, 4> PhiloxBlock(uint64_t key, uint64_t counter_high, uint64_t counter_low);

}  // namespace turbidock
