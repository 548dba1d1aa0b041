// The filter between readings and pose, against a Kalman filter run to its end and by hand.

#include "control/navigator.h"

#include <gtest/gtest.h>

#include <cmath>

namespace turbidock::control {
namespace {

constexpr ClockParams kClock;  // 30 frames a second

NavigationReading Fix(double x_m, double y_m, double z_m = 0, double heading_rad = 0) {
  return {.z_m = z_m,
          .heading_rad = heading_rad,
          .fix_xy_m = Eigen::Vector2d(x_m, y_m),
          .z_std_m = 0.005,
          .heading_std_rad = 0.005,
          .fix_std_m = 0.01};
}

// The covariance of position and rate until it stays.
TEST(SteadyGains, AreThoseOfTheKalmanFilter) {
  for (const double noise : {0.002, 0.05, 0.5})
    for (const double acceleration : {0.02, 0.3})
      for (const double gap_s : {1.0 / 30, 0.1, 1.0}) {
        Eigen::Matrix2d P = Eigen::Matrix2d::Identity(), A, Q;
        const double t = gap_s, q = acceleration * acceleration;
        A << 1, t, 0, 1;
        Q << q * t * t * t * t / 4, q * t * t * t / 2, q * t * t * t / 2, q * t * t;
        Eigen::Vector2d K;
        for (int i = 0; i < 20000; ++i) {
          P = A * P * A.transpose() + Q;
          K = P.col(0) / (P(0, 0) + noise * noise);
          P -= K * P.row(0);
        }
        const AlphaBeta gains = SteadyGains(noise, acceleration, gap_s);
        EXPECT_NEAR(gains.alpha / K.x(), 1, 1e-6);
        EXPECT_NEAR(gains.beta / gap_s / K.y(), 1, 1e-6);
      }
}

TEST(Navigator, FollowsASteadyMotionWithoutLag) {
  Navigator navigator({}, kClock);
  for (int frame = 0; frame < 1800; ++frame) {
    const double t = frame / 30.0;
    const auto reading = Fix(-5 + 0.05 * t, 0.02 * t, -0.01 * t, 3.1 + 0.01 * t);
    // a fix every second only
    NavigationReading given = reading;
    if (frame % 30) given.fix_xy_m.reset();
    navigator.Update(frame, given);
  }
  const double t = 1799 / 30.0;
  const Navigated now = *navigator.pose();
  EXPECT_NEAR(now.pose_MH.x_m, -5 + 0.05 * t, 1e-4);
  EXPECT_NEAR(now.pose_MH.y_m, 0.02 * t, 1e-4);
  EXPECT_NEAR(now.pose_MH.z_m, -0.01 * t, 1e-6);
  EXPECT_NEAR(WrapAngle(now.pose_MH.yaw_rad - 3.1 - 0.01 * t), 0, 1e-6);
  EXPECT_LE(std::abs(now.pose_MH.yaw_rad), M_PI);
  EXPECT_NEAR(now.rate_M[kSurge], 0.05, 1e-4);
  EXPECT_NEAR(now.rate_M[kYaw], 0.01, 1e-4);
}

TEST(Navigator, KnowsNothingBeforeAFixAndWhenTheLastIsOld) {
  Navigator navigator({.max_age_s = 2}, kClock);
  navigator.Update(0, std::nullopt);
  EXPECT_FALSE(navigator.pose());
  NavigationReading no_fix = Fix(0, 0);
  no_fix.fix_xy_m.reset();
  navigator.Update(1, no_fix);
  EXPECT_FALSE(navigator.pose());
  navigator.Update(2, Fix(-3, 1));
  EXPECT_TRUE(navigator.pose());
  for (int frame = 3; frame <= 62; ++frame) navigator.Update(frame, no_fix);
  EXPECT_TRUE(navigator.pose());
  navigator.Update(63, no_fix);
  EXPECT_FALSE(navigator.pose());
  // from there it begins anew, at rest
  navigator.Update(64, Fix(-1, 0));
  EXPECT_EQ(navigator.pose()->pose_MH.x_m, -1);
  EXPECT_EQ(navigator.pose()->rate_M[kSurge], 0);
}

// Navigation is off by 0.3 m and 5 degrees; the marker says so, and it is remembered.
TEST(Navigator, LearnsFromTheMarkerWhatItIsOffBy) {
  Navigator navigator({}, kClock);
  const AxesPose truth{-0.9, 0.1, 0.05, 0.1};
  const NavigationReading wrong = Fix(-1.2, 0.3, 0, 0.1 - 0.087);
  const auto off = [&] { return navigator.pose()->pose_MH - truth; };
  navigator.Update(-1, wrong);
  EXPECT_NEAR(off().x_m, -0.3, 1e-12);
  for (int frame = 0; frame < 90; ++frame) {
    navigator.Update(frame, wrong);
    navigator.Correct(Inverse(truth));
  }
  // e^-6 of it is left after three seconds
  EXPECT_NEAR(off().x_m, -0.3 * std::exp(-6), 1e-6);
  EXPECT_NEAR(off().yaw_rad, -0.087 * std::exp(-6), 1e-6);
  navigator.Update(90, wrong);
  EXPECT_LT(off().distance_m(), 0.002);
  navigator.DropCorrection();
  EXPECT_NEAR(off().x_m, -0.3, 1e-12);
}

TEST(AxesPose, TheInverseIsThatOfThePose) {
  for (const AxesPose& pose : {AxesPose{1, 2, 3, 0.4}, AxesPose{-0.5, 0.1, -0.2, -3}}) {
    const Pose X{FromYawPitchRoll(pose.yaw_rad, 0, 0), {pose.x_m, pose.y_m, pose.z_m}};
    const AxesPose difference = Inverse(pose) - AxesPose::Of(X.Inverse());
    EXPECT_NEAR(difference.distance_m(), 0, 1e-12);
    EXPECT_NEAR(difference.yaw_rad, 0, 1e-12);
    EXPECT_NEAR((Inverse(Inverse(pose)) - pose).distance_m(), 0, 1e-12);
  }
}

}  // namespace
}  // namespace turbidock::control
