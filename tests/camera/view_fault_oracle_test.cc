// Dirt, blur and misaligned cameras against closed forms.

#include "sim/camera/view_fault.h"

#include <gtest/gtest.h>

#include <cmath>

namespace turbidock::camera {
namespace {

light::RadianceStereo Even(float left, float right) {
  return {Image3f(160, 120, left), Image3f(160, 120, right)};
}

TEST(DirtFault, TakesItsShareInTheMiddleAndNothingBeyondItsEdge) {
  DirtFault dirt;
  dirt.camera = FaultyCamera::kRight;
  dirt.center = {0.25, 0.5};
  dirt.radius = 0.1;  // 16 pixels about (39.5, 59.5)
  dirt.transmission = 0.2;
  light::RadianceStereo images = Even(1, 2);
  PortFaults{{dirt}, {}}.Spoil(&images);
  EXPECT_EQ(images.left, Image3f(160, 120, 1));
  int covered = 0, between = 0, clear = 0;
  for (int v = 0; v < 120; ++v)
    for (int u = 0; u < 160; ++u) {
      const double distance_px = std::hypot(u - 39.5, v - 59.5);
      const float got = images.right.at(u, v)[1];
      if (distance_px <= 8) {
        EXPECT_FLOAT_EQ(got, 0.4F);
        ++covered;
      } else if (distance_px >= 16) {
        EXPECT_EQ(got, 2);
        ++clear;
      } else {
        EXPECT_GT(got, 0.4F);
        EXPECT_LT(got, 2);
        ++between;
      }
    }
  EXPECT_NEAR(covered, 3.1416 * 64, 12);
  EXPECT_NEAR(covered + between, 3.1416 * 256, 24);
  EXPECT_GT(clear, 18000);
}

TEST(BlurFault, SpreadsAPointAsAGaussianAndLeavesAnEvenImage) {
  BlurFault blur;
  blur.camera = FaultyCamera::kLeft;
  blur.sigma_px = 3;
  light::RadianceStereo images = Even(0, 0);
  images.left.at(70, 50)[2] = 100;
  images.right.at(70, 50)[2] = 100;
  PortFaults{{}, {blur}}.Spoil(&images);
  EXPECT_EQ(images.right.at(70, 50)[2], 100);
  double sum = 0, across = 0, down = 0;
  for (int v = 0; v < 120; ++v)
    for (int u = 0; u < 160; ++u) {
      const double x = images.left.at(u, v)[2];
      sum += x;
      across += x * std::pow(u - 70, 2);
      down += x * std::pow(v - 50, 2);
      EXPECT_EQ(images.left.at(u, v)[0], 0);
    }
  EXPECT_NEAR(sum, 100, 0.01);
  EXPECT_NEAR(across / sum, 9, 0.3);  // cut off at three sigma
  EXPECT_NEAR(down / sum, 9, 0.3);
  EXPECT_NEAR(images.left.at(70, 50)[2], 100 / (2 * 3.14159 * 9), 0.03);
  EXPECT_GT(images.left.at(79, 50)[2], 0);
  EXPECT_EQ(images.left.at(80, 50)[2], 0);

  images = Even(0.5F, 0.5F);
  PortFaults{{}, {blur}}.Spoil(&images);
  for (const int u : {0, 1, 80, 159})
    for (const int v : {0, 60, 119})
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(images.left.at(u, v)[k], 0.5, 1e-5);
}

// A camera turned to the left by an angle sees what was straight ahead so much to the right.
TEST(CameraMisalignment, TurnsTheCameraAboutItsOpticalCentre) {
  const StereoRig rig = RigParams{}.MakeRig();
  const double angle_rad = 0.0349;
  CameraMisalignment aside, down;
  aside.camera = FaultyCamera::kLeft;
  aside.yaw_pitch_roll_rad = {angle_rad, 0, 0};
  down.camera = FaultyCamera::kRight;
  down.yaw_pitch_roll_rad = {0, angle_rad, 0};
  const StereoRig misaligned = Misaligned(rig, {aside, down});
  const auto seen = [&](Side side) -> Eigen::Vector2d {
    EXPECT_EQ(misaligned[side].X_HC.p, rig[side].X_HC.p);
    const Eigen::Vector3d ahead_H = rig[side].X_HC.p + Eigen::Vector3d(0.8, 0, 0);
    return misaligned[side].Project(misaligned[side].X_HC.Inverse() * ahead_H) -
           rig[side].Project(rig[side].X_HC.Inverse() * ahead_H);
  };
  const double way_px = rig.left.fx_px * std::tan(angle_rad);
  EXPECT_NEAR(way_px, 19.3, 0.1);
  EXPECT_NEAR(seen(Side::kLeft).x(), way_px, 1e-6);
  EXPECT_NEAR(seen(Side::kLeft).y(), 0, 1e-6);
  EXPECT_NEAR(seen(Side::kRight).x(), 0, 1e-6);
  EXPECT_NEAR(seen(Side::kRight).y(), -way_px, 1e-6);
}

TEST(HoldingAt, KeepsThoseOfTheInstant) {
  BlurFault early, late;
  early.end_s = 3;
  late.begin_s = 2;
  EXPECT_EQ(HoldingAt<BlurFault>({early, late}, 1).size(), 1U);
  EXPECT_EQ(HoldingAt<BlurFault>({early, late}, 2).size(), 2U);
  EXPECT_EQ(HoldingAt<BlurFault>({early, late}, 3).front().begin_s, 2);
}

}  // namespace
}  // namespace turbidock::camera
