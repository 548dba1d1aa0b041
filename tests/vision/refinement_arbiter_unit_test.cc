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

// Shading and coarse colour let balls look smaller or larger by a share of their size: near the
// dock by more pixels than anywhere else.
TEST(RefinementArbiter, BelievesLargeBallsThatAreOffByAShare) {
  const MarkerParams marker;
  MarkerParams off = marker;
  off.balls[0].radius_m *= 0.95;
  off.balls[2].radius_m *= 1.05;
  const Pose near{kTrue.q, {0.32, 0.01, -0.01}};
  Rng rng = SeedTree(6).Stream("noise");
  const StereoImage seen = testing::PaintMarker(off, kRig, near, {.noise_dn = 1.5}, &rng);
  HueLabeller labeller({}, marker);
  Stereo<Image1u8> labels;
  for (const Side side : kSides) labeller.Label(seen[side], &labels[side]);
  const Fitness fitness(marker, kRig, labels);
  RefinementArbiter arbiter(marker, kRig);
  PoseEstimate estimate;
  estimate.X_HM = near;
  estimate.fitness = fitness.Evaluate(near);
  estimate.ball_fitness = {0.9, 0.9, 0.9};
  const auto verdict = arbiter.Judge(seen, WholeImages(kRig), fitness, estimate, 1, &rng);
  ASSERT_TRUE(verdict.refined);
  EXPECT_LT((verdict.refined->X_HM.p - near.p).norm(), 0.005);
}

// The green ball is dark: the turn about the line of the others is anyone's guess.
TEST(RefinementArbiter, TellsOfASecondPoseWhereABallIsDark) {
  const MarkerParams all;
  MarkerParams lit = all;
  lit.balls.erase(lit.balls.begin());
  Rng rng = SeedTree(5).Stream("noise");
  const StereoImage whole = testing::PaintMarker(all, kRig, kTrue, {.noise_dn = 1.5}, &rng),
                    dark = testing::PaintMarker(lit, kRig, kTrue, {.noise_dn = 1.5}, &rng);
  HueLabeller labeller({}, all);
  Stereo<Image1u8> labels;
  const Fitness fitness(all, kRig, labels);
  const auto judge = [&](const StereoImage& seen) {
    for (const Side side : kSides) labeller.Label(seen[side], &labels[side]);
    const FitnessByBall by_ball = fitness.EvaluateByBall(kTrue);
    PoseEstimate estimate;
    estimate.X_HM = kTrue;
    estimate.fitness = by_ball.fitness;
    estimate.ball_fitness = {by_ball.ball(0), by_ball.ball(1), by_ball.ball(2)};
    RefinementArbiter arbiter(all, kRig);
    return arbiter.Judge(seen, WholeImages(kRig), fitness, estimate, arbiter.MostEvaluations(),
                         &rng);
  };
  EXPECT_FALSE(judge(whole).second);
  const auto verdict = judge(dark);
  ASSERT_TRUE(verdict.refined);
  ASSERT_TRUE(verdict.second);
  EXPECT_NEAR(verdict.second->weight, 0.5, 0.01);
  const Pose &first = verdict.refined->X_HM, &second = verdict.second->X_HM;
  EXPECT_GT(AngleBetween(first.q, second.q), units::RadFromDeg(3));
  for (const size_t b : {1, 2}) {
    const Eigen::Vector3d& p_MQ = all.balls[b].p_MQ_m;
    EXPECT_LT((first * p_MQ - second * p_MQ).norm(), 1e-4) << "where both are seen, they agree";
  }
}

}  // namespace
}  // namespace turbidock::vision
