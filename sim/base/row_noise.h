#pragma once
// Normal numbers for rows of pixels, at two loads and an addition each.
//
// A row's numbers are the sum of two stretches of a fixed table, each begun anywhere in one half of
// it: 2^30 different rows, every one of them white and normal. Rows whose stretches overlap are
// alike in part, shifted along the row.

#include <cstdint>
#include <vector>

namespace turbidock {

class RowNoise {
 public:
  static constexpr uint32_t kHalf = 1u << 15;
  // No number is larger.
  static constexpr float kMost = 5.9f;

  // The numbers of a row, of mean 0 and variance 1.
  struct Row {
    const float *first, *second;
    float operator[](int i) const { return first[i] + second[i]; }
    Row From(int i) const { return {first + i, second + i}; }
  };

  // For rows of at most so many numbers.
  explicit RowNoise(int row_values = 0);

  int row_values() const { return row_values_; }
  // The row that belongs to a key.
  Row Of(uint32_t key) const {
    return {table_.data() + key % kHalf, table_.data() + kHalf + key / kHalf % kHalf};
  }

 private:
  int row_values_;
  std::vector<float> table_;
};

}  // namespace turbidock
