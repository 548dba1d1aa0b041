#include <gtest/gtest.h>

#include "vision/overlay.h"

namespace turbidock::vision {
namespace {

constexpr double kFocal_px = 554.2562584220408;  // 320 / tan 30 degrees

TEST(ProjectBalls, SquareOnMarkerHasClosedForms) {
  const MarkerParams marker;
  const StereoRig rig = RigParams{}.MakeRig();
  const Pose X_HM = Pose::Translation(0.6, 0, 0);
  const auto left = ProjectBalls(marker, rig.left, X_HM);
  const auto right = ProjectBalls(marker, rig.right, X_HM);
  ASSERT_EQ(left.size(), 3u);
  ASSERT_EQ(right.size(), 3u);
  const double depth_m[] = {0.53, 0.6, 0.6};  // green is 70 mm nearer
  for (int b = 0; b < 3; ++b) {
    EXPECT_NEAR(left[b].radius_px, kFocal_px * 0.02 / depth_m[b], 1e-9);
    // Disparity f b / z; the rows agree.
    EXPECT_NEAR(left[b].center_px.x() - right[b].center_px.x(), kFocal_px * 0.12 / depth_m[b],
                1e-9);
    EXPECT_NEAR(left[b].center_px.y(), right[b].center_px.y(), 1e-9);
  }
  // The left camera is left of the marker, so it sees it right of the middle.
  EXPECT_NEAR(left[0].center_px.x(), 319.5 + kFocal_px * 0.06 / 0.53, 1e-9);
  EXPECT_NEAR(left[0].center_px.y(), 239.5, 1e-9);
  // Red is on top: above the middle. Blue is on the vehicle's right: farther right.
  EXPECT_NEAR(left[1].center_px.y(), 239.5 - kFocal_px * 0.07 / 0.6, 1e-9);
  EXPECT_NEAR(left[2].center_px.x(), 319.5 + kFocal_px * 0.13 / 0.6, 1e-9);
}

TEST(ProjectBalls, YawTurnsTheFrontBallSideways) {
  // A marker turned to its left (about z, up) shows its front ball farther to the right.
  const Eigen::Quaterniond q = FromYawPitchRoll(0.2, 0, 0);
  const auto left = ProjectBalls(MarkerParams{}, RigParams{}.MakeRig().left, {q, {0.6, 0.06, 0}});
  const double depth_m = 0.6 - 0.07 * std::cos(0.2);
  EXPECT_NEAR(left[0].center_px.x(), 319.5 + kFocal_px * 0.07 * std::sin(0.2) / depth_m, 1e-9);
}

TEST(ProjectBalls, BallsBehindTheCameraAreLeftOut) {
  const auto behind =
      ProjectBalls(MarkerParams{}, RigParams{}.MakeRig().right, Pose::Translation(-0.02, 0, 0));
  EXPECT_TRUE(behind.empty());
  const auto partly =
      ProjectBalls(MarkerParams{}, RigParams{}.MakeRig().right, Pose::Translation(0.05, 0, 0));
  EXPECT_EQ(partly.size(), 2u);  // the front ball is at -0.02
}

TEST(ProjectBalls, ColoursAreTheDisplayColours) {
  MarkerParams marker;
  marker.balls[0].display_rgb = {0, 0.5, 1};
  const auto left = ProjectBalls(marker, RigParams{}.MakeRig().left, Pose::Translation(0.6, 0, 0));
  EXPECT_EQ(left.at(0).rgb, (std::array<uint8_t, 3>{0, 128, 255}));
}

}  // namespace
}  // namespace turbidock::vision
