#include "vision/marker_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace turbidock::vision {
namespace {

using ::testing::HasSubstr;

std::string ProblemOf(const MarkerParams& marker) {
  try {
    CheckFields(marker, "marker");
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(MarkerParams, DefaultsAreValid) { EXPECT_EQ(ProblemOf(MarkerParams{}), ""); }

TEST(MarkerParams, NeedsOneToEightBalls) {
  MarkerParams marker;
  marker.balls.clear();
  EXPECT_THAT(ProblemOf(marker), HasSubstr("marker.balls: a marker needs at least one ball"));
  marker.balls.resize(8);
  EXPECT_EQ(ProblemOf(marker), "");
  marker.balls.resize(9);
  EXPECT_THAT(ProblemOf(marker), HasSubstr("marker.balls: 9 balls, must be at most 8"));
}

TEST(MarkerParams, RefusesABallWithoutSize) {
  MarkerParams marker;
  marker.balls[1].radius_m = 0;
  EXPECT_THAT(ProblemOf(marker), HasSubstr("marker.balls[1].radius_m"));
}

TEST(SamplePoints, LieOnTheRings) {
  const SamplePoints samples{MarkerParams{}};
  struct Ring {
    int points;
    double ratio;
  };
  int i = 0;
  for (const Ring& ring : {Ring{6, 1.0 / 3}, Ring{12, 2.0 / 3}, Ring{18, 0.95}, Ring{24, 1.4}}) {
    const int first = i;
    double sum_u = 0, sum_v = 0;
    for (; i < first + ring.points; ++i) {
      EXPECT_NEAR(std::hypot(samples.u[i], samples.v[i]), ring.ratio, 1e-6) << i;
      sum_u += samples.u[i];
      sum_v += samples.v[i];
      // Evenly spaced: neighbours are one chord apart.
      const int next = first + (i - first + 1) % ring.points;
      EXPECT_NEAR(std::hypot(samples.u[next] - samples.u[i], samples.v[next] - samples.v[i]),
                  2 * ring.ratio * std::sin(std::numbers::pi / ring.points), 1e-6);
    }
    EXPECT_NEAR(sum_u, 0, 1e-5);
    EXPECT_NEAR(sum_v, 0, 1e-5);
  }
  EXPECT_EQ(i, kBallPoints);
  EXPECT_EQ(6 + 12 + 18, kInnerPoints);
}

}  // namespace
}  // namespace turbidock::vision
