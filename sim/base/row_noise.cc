#include "sim/base/row_noise.h"

#include <cmath>

#include "sim/base/vector_clones.h"
#include "sim/base/vector_math.h"

namespace turbidock {
namespace {

TURBIDOCK_VECTOR_CLONES
void FillNormal(std::vector<float>* table) {
  const auto count = static_cast<uint32_t>(table->size());
  float* out = table->data();
  for (uint32_t i = 0; i < count; ++i) out[i] = NormalFromBits(Mix(i, 0, 0));
}

}  // namespace

RowNoise::RowNoise(int row_values) : row_values_(row_values) {
  if (row_values == 0) return;
  table_.resize(2 * kHalf + static_cast<size_t>(row_values));
  FillNormal(&table_);
  // of what begins rows: mean exactly 0, variance exactly that of half a row
  double sum = 0, squares = 0;
  for (size_t i = 0; i < 2 * kHalf; ++i) {
    sum += double{table_[i]};
    squares += double{table_[i]} * double{table_[i]};
  }
  const double mean = sum / (2 * kHalf), variance = squares / (2 * kHalf) - mean * mean;
  const auto shift = static_cast<float>(mean);
  const auto scale = static_cast<float>(std::sqrt(0.5 / variance));
  for (float& value : table_) value = (value - shift) * scale;
}

}  // namespace turbidock
