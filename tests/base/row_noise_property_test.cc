// The noise of rows: normal, white, and another for every key.
#include "sim/base/row_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/base/random.h"

namespace turbidock {
namespace {

constexpr int kValues = 1920, kRows = 400;

std::vector<std::vector<double>> Rows() {
  const RowNoise noise(kValues);
  Rng rng = SeedTree(4).Stream("keys");
  std::vector<std::vector<double>> rows(kRows);
  for (auto& row : rows) {
    const RowNoise::Row numbers = noise.Of(rng.NextU32());
    for (int i = 0; i < kValues; ++i) row.push_back(double{numbers[i]});
  }
  return rows;
}

// 768000 numbers know a mean to 0.0011, a variance to 0.0016, a fourth moment to 0.011 and a share
// of 0.0027 to 0.00006; five of these.
TEST(RowNoise, IsNormal) {
  double sum = 0, squares = 0, fourth = 0, beyond = 0, most = 0;
  for (const auto& row : Rows())
    for (const double x : row) {
      sum += x, squares += x * x, fourth += x * x * x * x, beyond += std::abs(x) > 3;
      most = std::max(most, std::abs(x));
    }
  constexpr double kCount = double{kRows} * kValues;
  EXPECT_NEAR(sum / kCount, 0, 0.0057);
  EXPECT_NEAR(squares / kCount, 1, 0.008);
  EXPECT_NEAR(fourth / kCount, 3, 0.06);
  EXPECT_NEAR(beyond / kCount, 0.0027, 0.0003);
  EXPECT_GT(most, 4);
  EXPECT_LT(most, double{RowNoise::kMost});
}

// Along a row, between rows and between their squares. That the table is fixed leaves a correlation
// of 0.004 (one sigma) at any one distance; five of these.
TEST(RowNoise, IsWhite) {
  const auto rows = Rows();
  const auto correlation = [&](size_t rows_apart, int apart, bool squared) {
    double sum = 0;
    size_t count = 0;
    const auto value = [&](size_t row, int i) {
      const double x = rows[row][static_cast<size_t>(i)];
      return squared ? (x * x - 1) / std::sqrt(2) : x;
    };
    for (size_t row = 0; row + rows_apart < kRows; ++row)
      for (int i = 0; i + apart < kValues; ++i, ++count)
        sum += value(row, i) * value(row + rows_apart, i + apart);
    return sum / static_cast<double>(count);
  };
  EXPECT_NEAR(correlation(0, 0, false), 1, 0.01);  // the measure works
  for (const int apart : {1, 2, 3, 7, 640, 1280})
    for (const bool squared : {false, true})
      EXPECT_LT(std::abs(correlation(0, apart, squared)), 0.02) << apart;
  for (const size_t rows_apart : {1, 2, 100})
    for (const int apart : {0, 1})
      for (const bool squared : {false, true})
        EXPECT_LT(std::abs(correlation(rows_apart, apart, squared)), 0.02) << rows_apart;
}

TEST(RowNoise, DependsOnTheKeyAlone) {
  const RowNoise noise(10), longer(1000);
  EXPECT_EQ(noise.Of(5)[3], noise.Of(5)[3]);
  EXPECT_NE(noise.Of(5)[3], noise.Of(6)[3]);
  EXPECT_NE(noise.Of(5)[3], noise.Of(5 + RowNoise::kHalf)[3]);
  EXPECT_EQ(noise.Of(5).From(2)[1], noise.Of(5)[3]);
  EXPECT_EQ(longer.row_values(), 1000);
}

}  // namespace
}  // namespace turbidock
