#include "vision/refinement_arbiter.h"

#include <gtest/gtest.h>

#include "sim/base/units.h"
#include "tests/support/paint_marker.h"
#include "vision/hue_labels.h"

namespace turbidock::vision {
namespace {

const StereoRig kRig = RigParams{}.MakeRig();
const Pose kTrue = Pose::FromVectorPart({0.6, 0.03, -0.02}, {0.03, -0.06, 0.09});

// X_HM turned by so much about the line of the two last balls, which stay where they are.
Pose Turned(double turn_rad) {
  const MarkerParams marker;
  const Eigen::Vector3d &p = marker.balls[1].p_MQ_m, &other = marker.balls[2].p_MQ_m;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(turn_rad, (other - p).normalized()));
  return kTrue * Pose{turn, p - turn * p};
}

// The search was drawn from one frame to the next to where two balls are seen and the third is
// not. What was seen before is believed, though there is no evaluation to compare the two.
TEST(RefinementArbiter, KeepsAPoseThatAllBallsSupport) {
  const MarkerParams marker;
  Rng rng = SeedTree(4).Stream("noise");
  const StereoImage seen = testing::PaintMarker(marker, kRig, kTrue, {.noise_dn = 1.5}, &rng);
  HueLabeller labeller({}, marker);
  Stereo<Image1u8> labels;
  for (const Side side : kSides) labeller.Label(seen[side], &labels[side]);
  const Fitness fitness(marker, kRig, labels);
  RefinementArbiter arbiter(marker, kRig);
  const auto judge = [&](const Pose& found) {
    PoseEstimate estimate;
    estimate.X_HM = found;
    estimate.fitness = 0.7;
    estimate.ball_fitness = {0.5, 0.9, 0.9};
    return arbiter.Judge(seen, WholeImages(kRig), fitness, estimate, arbiter.MostEvaluations(),
                         &rng);
  };
  const auto right = judge(kTrue);
  ASSERT_TRUE(right.refined);
  ASSERT_EQ(arbiter.MostEvaluations(), 1);
  const auto after = judge(Turned(0.35));
  ASSERT_TRUE(after.refined);
  EXPECT_EQ(after.evaluations, 1);
  EXPECT_LT(AngleBetween(after.refined->X_HM.q, kTrue.q), units::RadFromDeg(1));
  EXPECT_GT(arbiter.MostEvaluations(), 1);  // the next frame compares
}

}  // namespace
}  // namespace turbidock::vision
