// F by the production kernel against F written down from its definition, and the search's optimum
// against an exhaustive grid.

#include <gtest/gtest.h>

#include <cmath>

#include "sim/base/random.h"
#include "tests/support/paint_marker.h"
#include "vision/rm_ga.h"

namespace turbidock::vision {
namespace {

// The definition, one point after the other in double precision.
double PlainFitness(const MarkerParams& marker, const StereoRig& rig,
                    const Stereo<Image1u8>& stereo_labels, const Pose& X_HM) {
  double sum = 0;
  for (const Side side : kSides) {
    const MountedCamera& camera = rig[side];
    const Image1u8& labels = stereo_labels[side];
    const Pose X_CM = camera.X_HC.Inverse() * X_HM;
    for (size_t b = 0; b < marker.balls.size(); ++b) {
      const Eigen::Vector3d p_CQ = X_CM * marker.balls[b].p_MQ_m;
      double ball_sum = 0;
      for (const auto& [points, ratio, sign] :
           {std::tuple{6, 1.0 / 3, 1}, {12, 2.0 / 3, 1}, {18, 0.95, 1}, {24, 1.4, -1}})
        for (int i = 0; i < points; ++i) {
          const double angle_rad = 2 * std::numbers::pi * i / points;
          const double radius_px = ratio * camera.fx_px * marker.balls[b].radius_m / p_CQ.z();
          const Eigen::Vector2d at =
              camera.Project(p_CQ) +
              radius_px * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad));
          const int u = static_cast<int>(std::floor(at.x() + 0.5));
          const int v = static_cast<int>(std::floor(at.y() + 0.5));
          const bool match = labels.Contains(u, v) && (*labels.at(u, v) >> b & 1);
          ball_sum += sign * (match ? 1 : -1);
        }
      sum += ball_sum / 60;
    }
  }
  return sum / (2.0 * static_cast<double>(marker.balls.size()));
}

TEST(FitnessTwoRoutes, KernelAndDefinitionAgree) {
  const MarkerParams marker;
  const StereoRig rig = RigParams{}.MakeRig();
  Rng rng = SeedTree(8).Stream("labels");
  Stereo<Image1u8> labels{{640, 480}, {640, 480}};
  for (size_t i = 0; i < labels.left.pixels(); ++i) {
    labels.left.data()[i] = static_cast<uint8_t>(rng.Below(8));
    labels.right.data()[i] = static_cast<uint8_t>(rng.Below(8));
  }
  const Fitness fitness(marker, rig, labels);
  int equal = 0;
  constexpr int kPoses = 500;
  for (int i = 0; i < kPoses; ++i) {
    // Many of these reach over the edge of the images.
    const Pose X_HM = Pose::FromVectorPart(
        {rng.Uniform(0.3, 1.6), rng.Uniform(-0.4, 0.4), rng.Uniform(-0.3, 0.3)},
        {rng.Uniform(-0.15, 0.15), rng.Uniform(-0.15, 0.15), rng.Uniform(-0.15, 0.15)});
    const double plain = PlainFitness(marker, rig, labels, X_HM);
    const double kernel = fitness.Evaluate(X_HM);
    // A point within float rounding of a pixel border may fall on either side: one of 360 changes
    // F by 2 / 360.
    EXPECT_NEAR(kernel, plain, 2.5 / 360);
    equal += std::abs(kernel - plain) < 1e-9;
  }
  EXPECT_GE(equal, kPoses - 15);
}

TEST(RmGaTwoRoutes, OptimumIsNotBelowAnExhaustiveGrid) {
  const MarkerParams marker;
  const StereoRig rig = RigParams{}.MakeRig();
  const Pose true_X_HM = Pose::FromVectorPart({0.62, 0.021, -0.034}, {0.02, -0.03, 0.04});
  const StereoImage seen = testing::PaintMarker(marker, rig, true_X_HM, {}, nullptr);

  HueLabeller labeller(HueParams{}, marker);
  Stereo<Image1u8> labels;
  for (const Side side : kSides) labeller.Label(seen[side], &labels[side]);
  const Fitness fitness(marker, rig, labels);
  // 5^6 poses about the true one: +-6 mm in x, +-2 mm in y and z, +-0.02 in eps.
  double grid_best = -1;
  int64_t evaluated = 0;
  for (int64_t code = 0; code < 15625; ++code, ++evaluated) {
    std::array<int, 6> step;
    for (int64_t i = 0, rest = code; i < 6; ++i, rest /= 5)
      step[static_cast<size_t>(i)] = static_cast<int>(rest % 5) - 2;
    const Pose X_HM = Pose::FromVectorPart(
        true_X_HM.p + Eigen::Vector3d(0.003 * step[0], 0.001 * step[1], 0.001 * step[2]),
        true_X_HM.q.vec() + 0.01 * Eigen::Vector3d(step[3], step[4], step[5]));
    grid_best = std::max(grid_best, fitness.Evaluate(X_HM));
  }
  ASSERT_EQ(evaluated, 15625);
  ASSERT_GT(grid_best, 0.95);

  RmGa search(RmGaOptions{}, marker, HueParams{}, rig, SeedTree(4).Stream("ga"));
  PoseEstimate estimate;
  for (int frame = 0; frame < 60; ++frame) estimate = search.Update(seen);
  EXPECT_GE(estimate.fitness, grid_best - 2.0 / 180);  // two steps of F
  EXPECT_LT((estimate.X_HM.p - true_X_HM.p).norm(), 0.012);
  EXPECT_EQ(estimate.fitness, fitness.Evaluate(estimate.X_HM));
}

}  // namespace
}  // namespace turbidock::vision
