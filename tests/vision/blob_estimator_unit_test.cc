#include "vision/blob_estimator.h"

#include <gtest/gtest.h>

#include "sim/base/units.h"
#include "tests/support/paint_marker.h"

namespace turbidock::vision {
namespace {

const StereoRig kRig = RigParams{}.MakeRig();

TEST(Triangulate, MeetsThePointThatBothRaysSee) {
  const Eigen::Vector3d point(0.7, -0.1, 0.05);
  const auto pixels = kRig.Each([&](const MountedCamera& camera) -> Eigen::Vector2d {
    return camera.Project(camera.X_HC.Inverse() * point);
  });
  const auto found = Triangulate(kRig, pixels);
  ASSERT_TRUE(found);
  EXPECT_LT((*found - point).norm(), 1e-12);
  // Half way between two rays that miss each other.
  const Eigen::Vector3d up(0, 0, 0.01);
  StereoRig raised = kRig;
  raised.right.X_HC.p += up;
  EXPECT_LT((*Triangulate(raised, pixels) - point - 0.5 * up).norm(), 1e-3);
  EXPECT_FALSE(Triangulate(kRig, {{320, 240}, {320, 240}}));  // parallel
  EXPECT_FALSE(Triangulate(kRig, {{300, 240}, {340, 240}}));  // behind
}

TEST(BlobEstimator, FindsAWhollyVisibleMarker) {
  const Pose X_HM = Pose::FromVectorPart({0.6, 0.03, -0.02}, {0.01, -0.02, 0.05});
  BlobEstimator estimator({}, MarkerParams{}, HueParams{}, kRig);
  const StereoImage seen = testing::PaintMarker(MarkerParams{}, kRig, X_HM, {}, nullptr);
  const PoseEstimate& estimate = estimator.Update(seen);
  EXPECT_TRUE(estimate.detected);
  EXPECT_LT((estimate.X_HM.p - X_HM.p).norm(), 0.003);
  EXPECT_LT(units::DegFromRad(AngleBetween(estimate.X_HM.q, X_HM.q)), 2);
  EXPECT_GT(estimate.fitness, 0.9);
}

// A ball whose upper middle is hidden is one blob, whichever way it is gone round.
TEST(BlobEstimator, TakesABallWithANotchAsOne) {
  const Pose X_HM = Pose::Translation(0.6, 0, 0);
  const MarkerParams marker;
  StereoImage seen = testing::PaintMarker(marker, kRig, X_HM, {}, nullptr);
  BlobEstimator estimator({}, marker, HueParams{}, kRig);
  const PoseEstimate whole = estimator.Update(seen);
  for (const Side side : kSides)
    for (const BallParams& ball : marker.balls) {
      const BallCircle circle =
          ProjectBall(kRig[side], kRig[side].X_HC.Inverse() * (X_HM * ball.p_MQ_m), ball.radius_m);
      const auto u = static_cast<int>(circle.u_px), v = static_cast<int>(circle.v_px),
                 r = static_cast<int>(circle.radius_px);
      for (int dv = -r - 2; dv <= 0; ++dv)
        for (int du = -1; du <= 1; ++du)
          for (int k = 0; k < 3; ++k) seen[side].at(u + du, v + dv)[k] = 8;
    }
  const PoseEstimate& notched = estimator.Update(seen);
  EXPECT_TRUE(notched.detected);
  // half a ball only would be seen a third of its radius aside
  EXPECT_LT((notched.X_HM.p - whole.X_HM.p).tail<2>().norm(), 0.002);
}

TEST(BlobEstimator, SaysWhenItSeesTooFewBalls) {
  MarkerParams two;
  two.balls.resize(2);
  BlobEstimator estimator({}, MarkerParams{}, HueParams{}, kRig);
  const StereoImage seen =
      testing::PaintMarker(two, kRig, Pose::Translation(0.6, 0, 0), {}, nullptr);
  EXPECT_FALSE(estimator.Update(seen).detected);
  EXPECT_EQ(estimator.Update(seen).fitness, -1);
}

}  // namespace
}  // namespace turbidock::vision
