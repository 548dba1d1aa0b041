// Draws and the distributions that they become, against closed forms.

#include "experiments/statistics/sampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "sim/base/random.h"

namespace turbidock::statistics {
namespace {

TEST(Samples, IndependentOnesFillTheRange) {
  Rng rng(1, 0);
  std::vector<double> samples(4000);
  for (double& sample : samples) sample = OpenUniform(&rng);
  double sum = 0, squares = 0;
  for (const double u : samples) {
    ASSERT_GT(u, 0);
    ASSERT_LT(u, 1);
    sum += u;
    squares += u * u;
  }
  EXPECT_NEAR(sum / 4000, 1 / 2.0, 0.02);
  EXPECT_NEAR(squares / 4000, 1 / 3.0, 0.02);
}

TEST(Distribution, UniformAndLogUniform) {
  EXPECT_DOUBLE_EQ(UniformAt(0.25, 2, 10), 4);
  EXPECT_DOUBLE_EQ(UniformAt(0.5, -3, 1), -1);
  EXPECT_DOUBLE_EQ(LogUniformAt(0.5, 1, 100), 10);
  EXPECT_DOUBLE_EQ(LogUniformAt(0.25, 2, 32), 4);
}

// P(X > x) of a standard normal; without cancellation in the upper tail.
double Above(double x) { return std::erfc(x / std::sqrt(2.0)) / 2; }

TEST(Distribution, Normal) {
  EXPECT_NEAR(NormalAt(0.5, 3, 2), 3, 1e-12);
  EXPECT_NEAR(NormalAt(0.975, 3, 2), 3 + 2 * 1.959963984540054, 1e-9);
}

// Within bounds, anywhere: the share of the probability between them that lies below is u.
TEST(Distribution, NormalWithinBounds) {
  const double mean = 0.7, deviation = 2;
  for (const auto& [low, high] :
       {std::pair(-1.0, 2.0), std::pair(-3.0, 0.0), std::pair(5.0, 9.0), std::pair(9.0, 11.0)})
    for (const double u : {0.01, 0.3, 0.5, 0.9}) {
      const double x = NormalAt(u, mean, deviation, low, high);
      ASSERT_GT(x, low);
      ASSERT_LT(x, high);
      const auto above = [&](double y) { return Above((y - mean) / deviation); };
      EXPECT_NEAR((above(low) - above(x)) / (above(low) - above(high)), u, 1e-9)
          << low << ' ' << high;
    }
}

}  // namespace
}  // namespace turbidock::statistics
