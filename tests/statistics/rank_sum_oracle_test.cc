// The rank sum against closed forms and against all ways to split a sample.

#include "experiments/statistics/rank_sum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace turbidock::statistics {
namespace {

TEST(RankSum, OfSamplesApartIsThatOfTheBook) {
  const std::vector<double> high = {7, 8, 9}, low = {1, 2, 3, 4};
  // 12 pairs above, 6 expected; variance 3 * 4 * 8 / 12
  EXPECT_NEAR(RankSumZ(high, low), 6 / std::sqrt(8), 1e-12);
  EXPECT_NEAR(RankSumZ(low, high), -6 / std::sqrt(8), 1e-12);
}

TEST(RankSum, IsZeroWhereNothingIsToBeTold) {
  EXPECT_EQ(RankSumZ({}, std::vector<double>{1, 2}), 0);
  EXPECT_EQ(RankSumZ(std::vector<double>{3, 3}, std::vector<double>{3}), 0);
}

// Over all 35 ways to draw three of seven, with ties: mean 0 and variance 1.
TEST(RankSum, HasMeanZeroAndVarianceOneOverAllSplits) {
  const std::array<double, 7> values = {1, 1, 2, 3, 3, 3, 4};
  std::array<bool, 7> is_first = {false, false, false, false, true, true, true};
  double sum = 0, squares = 0;
  int splits = 0;
  do {
    std::vector<double> a, b;
    for (size_t i = 0; i < values.size(); ++i) (is_first[i] ? a : b).push_back(values[i]);
    const double z = RankSumZ(a, b);
    sum += z, squares += z * z, ++splits;
  } while (std::ranges::next_permutation(is_first).found);
  EXPECT_EQ(splits, 35);
  EXPECT_NEAR(sum, 0, 1e-12);
  EXPECT_NEAR(squares / splits, 1, 1e-12);
}

}  // namespace
}  // namespace turbidock::statistics
