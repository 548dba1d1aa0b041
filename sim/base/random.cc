#include "sim/base/random.h"

#include <Random123/philox.h>
#include <xxhash.h>

#include <cmath>
#include <numbers>

namespace turbidock {

std::array<uint32_t, 4> PhiloxBlock(uint64_t key, uint64_t counter_high, uint64_t counter_low) {
  const auto low = [](uint64_t x) { return static_cast<uint32_t>(x); };
  const auto high = [](uint64_t x) { return static_cast<uint32_t>(x >> 32); };
  const r123::Philox4x32::ctr_type counter = {
      {low(counter_low), high(counter_low), low(counter_high), high(counter_high)}};
  const r123::Philox4x32::key_type philox_key = {{low(key), high(key)}};
  const auto out = r123::Philox4x32()(counter, philox_key);
  return {out[0], out[1], out[2], out[3]};
}

uint32_t Rng::NextU32() {
  if (used_ == 4) {
    block_ = PhiloxBlock(key_, stream_, counter_++);
    used_ = 0;
  }
  return block_[used_++];
}

void Rng::SkipU64(uint64_t count) {
  for (; count > 0 && used_ != 4; --count) NextU64();
  counter_ += count / 2;  // a block holds two
  if (count % 2 == 1) NextU64();
}

double Rng::Uniform() { return static_cast<double>(NextU64() >> 11) * 0x1.0p-53; }

uint32_t Rng::Below(uint32_t n) {
  // Lemire's multiply-and-reject.
  uint64_t product = static_cast<uint64_t>(NextU32()) * n;
  if (static_cast<uint32_t>(product) < n) {
    const uint32_t threshold = -n % n;
    while (static_cast<uint32_t>(product) < threshold)
      product = static_cast<uint64_t>(NextU32()) * n;
  }
  return static_cast<uint32_t>(product >> 32);
}

double Rng::Normal() {
  if (has_spare_normal_) {
    has_spare_normal_ = false;
    return spare_normal_;
  }
  const double radius = std::sqrt(-2 * std::log(1 - Uniform()));
  const double angle_rad = 2 * std::numbers::pi * Uniform();
  spare_normal_ = radius * std::sin(angle_rad);
  has_spare_normal_ = true;
  return radius * std::cos(angle_rad);
}

Rng SeedTree::Stream(std::string_view name) const {
  return Rng(seed_, XXH64(name.data(), name.size(), 0));
}

int64_t SeedTree::TrialSeed(int64_t index) const {
  const auto block = PhiloxBlock(seed_, XXH64("trial", 5, 0), static_cast<uint64_t>(index));
  return (static_cast<int64_t>(block[0] & 0x7fffffffu) << 32) | block[1];
}

}  // namespace turbidock
