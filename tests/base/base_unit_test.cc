#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "sim/base/axes_pose.h"
#include "sim/base/camera.h"
#include "sim/base/clock.h"
#include "sim/base/digest.h"
#include "sim/base/image.h"
#include "sim/base/units.h"

namespace turbidock {
namespace {

TEST(Camera, DefaultRigIsTheSpecified) {
  const StereoRig rig = RigParams{}.MakeRig();
  EXPECT_NEAR(rig.left.fx_px, 554.26, 0.005);
  EXPECT_EQ(rig.left.cx_px, 319.5);
  EXPECT_EQ(rig.left.cy_px, 239.5);
  EXPECT_EQ(rig.left.X_HC.p, Eigen::Vector3d(0, 0.06, 0));
  EXPECT_NEAR(units::DegFromRad(rig.left.vertical_fov_rad()), 46.8, 0.05);
}

TEST(Camera, LeftAndUpInTheHeadAreLeftAndUpInTheImage) {
  const StereoRig rig = RigParams{}.MakeRig();
  const auto ahead = rig.left.Project(rig.left.X_HC.Inverse() * Eigen::Vector3d(1, 0.06, 0));
  EXPECT_NEAR(ahead.x(), 319.5, 1e-9);
  EXPECT_NEAR(ahead.y(), 239.5, 1e-9);
  const auto up_left = rig.left.Project(rig.left.X_HC.Inverse() * Eigen::Vector3d(1, 0.16, 0.1));
  EXPECT_LT(up_left.x(), 319.5);
  EXPECT_LT(up_left.y(), 239.5);
}

TEST(Camera, DisparityIsFocalLengthTimesBaselineOverDepth) {
  const StereoRig rig = RigParams{}.MakeRig();
  for (const double depth_m : {0.35, 0.6, 1.5}) {
    const Eigen::Vector3d p_HQ(depth_m, 0.05, -0.02);
    const double disparity_px = rig.left.Project(rig.left.X_HC.Inverse() * p_HQ).x() -
                                rig.right.Project(rig.right.X_HC.Inverse() * p_HQ).x();
    EXPECT_NEAR(disparity_px, rig.left.fx_px * 0.12 / depth_m, 1e-9);
  }
}

TEST(Camera, RayAndProjectAreInverse) {
  const CameraIntrinsics camera;
  EXPECT_LE((camera.Project(2.5 * camera.RayAt(17, 400)) - Eigen::Vector2d(17, 400)).norm(), 1e-9);
}

TEST(Clock, FramesAreWholeNumbersOfTicks) {
  const ClockParams clock;
  EXPECT_DOUBLE_EQ(clock.TimeOfTick(clock.ticks_per_frame * 30), 1.0);
  EXPECT_DOUBLE_EQ(clock.TimeOfFrame(30), 1.0);
  EXPECT_EQ(clock.FramesFor(0.1), 3);
  EXPECT_EQ(clock.FramesFor(0.101), 4);
  EXPECT_EQ(clock.FramesFor(0), 0);
}

TEST(DigestTest, SeesEveryValueAndIgnoresTheSignsThatMeanNothing) {
  const auto of = [](auto... values) {
    Digest digest;
    (digest.Add(values), ...);
    return digest.Hex();
  };
  EXPECT_EQ(of(0.0), of(-0.0));
  EXPECT_NE(of(1.0), of(std::nextafter(1.0, 2.0)));
  EXPECT_NE(of(1.0, 2.0), of(2.0, 1.0));
  const Pose X = {Eigen::Quaterniond(0.6, 0.8, 0, 0), {1, 2, 3}};
  const Pose same = {Eigen::Quaterniond(-0.6, -0.8, 0, 0), {1, 2, 3}};
  EXPECT_EQ(of(X), of(same));
  EXPECT_EQ(of(X).size(), 16u);
}

TEST(Fields, DefaultsAreInRangeAndTheFirstViolationIsNamed) {
  CheckFields(RigParams{}, "cameras.rig");
  CheckFields(ClockParams{}, "trial.clock");
  RigParams rig;
  rig.baseline_m = -0.1;
  try {
    CheckFields(rig, "cameras.rig");
    FAIL() << "a negative baseline was accepted";
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.key(), "cameras.rig.baseline_m");
    EXPECT_STREQ(error.what(), "cameras.rig.baseline_m: -0.1 must be in [0.01, 1]");
  }
  rig.baseline_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(CheckFields(rig, "cameras.rig"), ConfigError);
}

TEST(ImageTest, RowsStartAtTheTopAndChannelsAreInterleaved) {
  Image3u8 image(4, 3);
  image.at(2, 1)[1] = 7;
  EXPECT_EQ(image.data()[(1 * 4 + 2) * 3 + 1], 7);
  EXPECT_TRUE(image.Contains(3, 2));
  EXPECT_FALSE(image.Contains(4, 2));
  const uint8_t* before = image.data();
  image.Resize(4, 3);
  EXPECT_EQ(image.data(), before);
}

TEST(AxesPose, DifferenceOfHeadingsIsTheShorterWayRound) {
  const AxesPose a{.x_m = 1, .yaw_rad = 3}, b{.y_m = 2, .yaw_rad = -3};
  const AxesPose difference = a - b;
  EXPECT_EQ(difference.x_m, 1);
  EXPECT_EQ(difference.y_m, -2);
  EXPECT_NEAR(difference.yaw_rad, 6 - 2 * std::numbers::pi, 1e-12);
}

TEST(Stereo, IsReachedBySide) {
  Stereo<int> pair{1, 2};
  for (const Side side : kSides) pair[side] *= 10;
  EXPECT_EQ(pair, (Stereo<int>{10, 20}));
  EXPECT_EQ(pair.Each([](int x) { return x > 15; }), (Stereo<bool>{false, true}));
}

TEST(Dotted, AKeyAtTheTopStandsAlone) {
  EXPECT_EQ(JoinKey("", "seed"), "seed");
  EXPECT_EQ(JoinKey("sea.tether", "length_m"), "sea.tether.length_m");
}

}  // namespace
}  // namespace turbidock
