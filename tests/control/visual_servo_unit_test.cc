// The visual servo: exact values and signs of the law, its rate filter, and a vehicle that obeys
// it.

#include "control/visual_servo.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "control/thrust_allocation.h"

namespace turbidock::control {
namespace {

constexpr ClockParams kClock;  // 30 frames a second

PoseEstimate Estimate(int64_t frame, double x_m, double y_m, double z_m, double yaw_rad = 0) {
  PoseEstimate estimate;
  estimate.frame = frame;
  estimate.X_HM = {FromYawPitchRoll(yaw_rad, 0, 0), {x_m, y_m, z_m}};
  estimate.fitness = 0.8;
  return estimate;
}

VisualServoParams Proportional() {
  VisualServoParams params;
  params.surge = {.kp_v_per_m = 10, .kd_v_s_per_m = 0, .limit_v = 2.5};
  params.sway = {.kp_v_per_m = 20, .kd_v_s_per_m = 0, .limit_v = 2.5};
  params.heave = {.kp_v_per_m = 30, .kd_v_s_per_m = 0, .limit_v = 2.5};
  params.yaw = {.kp_v = 4, .kd_v_s = 0, .limit_v = 2.5};
  return params;
}

VisualServoParams Derivative(double kd, double filter_s) {
  VisualServoParams params;
  for (AxisGains* axis : {&params.surge, &params.sway, &params.heave})
    *axis = {.kp_v_per_m = 0, .kd_v_s_per_m = kd, .limit_v = 2.5};
  params.yaw = {.kp_v = 0, .kd_v_s = kd, .limit_v = 2.5};
  params.rate_filter_s = filter_s;
  return params;
}

TEST(VisualServo, DefaultsAreValidAndProportional) {
  const VisualServoParams params;
  EXPECT_NO_THROW(CheckFields(params, ""));
  EXPECT_EQ(params.surge.kd_v_s_per_m, 0);
  EXPECT_EQ(params.sway.kd_v_s_per_m, 0);
  EXPECT_EQ(params.heave.kd_v_s_per_m, 0);
  EXPECT_EQ(params.yaw.kd_v_s, 0);
}

TEST(VisualServo, RefusesParametersOutOfRange) {
  VisualServoParams params;
  params.sway.limit_v = 2.6;
  EXPECT_THROW(VisualServo(params, kClock), ConfigError);
}

TEST(VisualServo, ProportionalLawExactly) {
  VisualServo servo(Proportional(), kClock);
  const AxisVolts volts =
      servo.Update(Estimate(0, 0.70, 0.03, -0.02, 0.1), {.x_m = 0.60, .y_m = 0.01, .z_m = 0.01});
  EXPECT_DOUBLE_EQ(volts.surge_v, 10 * (0.70 - 0.60));
  EXPECT_DOUBLE_EQ(volts.sway_v, 20 * (0.03 - 0.01));
  EXPECT_DOUBLE_EQ(volts.heave_v, 30 * (-0.02 - 0.01));
  EXPECT_DOUBLE_EQ(volts.yaw_v, 4 * std::sin(0.05));
}

TEST(VisualServo, EveryAxisGoesTowardsTheMarker) {
  const DesiredPose desired{.x_m = 0.6};
  auto update = [&](double x_m, double y_m, double z_m, double yaw_rad) {
    return VisualServo(Proportional(), kClock).Update(Estimate(0, x_m, y_m, z_m, yaw_rad), desired);
  };
  EXPECT_GT(update(0.7, 0, 0, 0).surge_v, 0);    // farther: forward
  EXPECT_LT(update(0.5, 0, 0, 0).surge_v, 0);    // nearer: back
  EXPECT_GT(update(0.6, 0.1, 0, 0).sway_v, 0);   // left: left
  EXPECT_GT(update(0.6, 0, 0.1, 0).heave_v, 0);  // above: up
  EXPECT_GT(update(0.6, 0, 0, 0.1).yaw_v, 0);    // turned counter-clockwise: turn so
  EXPECT_EQ(update(0.6, 0, 0, 0), AxisVolts{});
}

TEST(VisualServo, HeadingIsHeldAtTheDesiredYawAndIgnoresTheQuaternionsSign) {
  PoseEstimate estimate = Estimate(0, 0.6, 0, 0, 0.2);
  const DesiredPose desired{.x_m = 0.6, .yaw_rad = 0.2};
  EXPECT_NEAR(VisualServo(Proportional(), kClock).Update(estimate, desired).yaw_v, 0, 1e-15);
  estimate.X_HM.q.coeffs() *= -1;
  EXPECT_NEAR(VisualServo(Proportional(), kClock).Update(estimate, desired).yaw_v, 0, 1e-15);
}

TEST(VisualServo, EachAxisIsLimited) {
  VisualServoParams params = Proportional();
  params.surge.limit_v = 1;
  params.sway.limit_v = 0.5;
  params.heave.limit_v = 0.25;
  params.yaw = {.kp_v = 100, .kd_v_s = 0, .limit_v = 0.75};
  const AxisVolts volts = VisualServo(params, kClock).Update(Estimate(0, 9, -9, 9, -1), {});
  EXPECT_EQ(volts, (AxisVolts{.surge_v = 1, .sway_v = -0.5, .heave_v = 0.25, .yaw_v = -0.75}));
}

TEST(VisualServo, RateOfASteadilyMovingMarkerSettlesAtItsSpeed) {
  constexpr double kSpeed_mps = 0.06, kTau_s = 0.2;
  VisualServo servo(Derivative(5, kTau_s), kClock);
  for (int n = 0; n <= 60; ++n) {
    const double x_m = 0.6 + kSpeed_mps * n / 30;
    const AxisVolts volts = servo.Update(Estimate(n, x_m, -x_m, 2 * x_m), {});
    // a first-order filter's answer to a step of the rate, n frames after it
    const double rate = kSpeed_mps * (1 - std::exp(-n / (30 * kTau_s)));
    EXPECT_NEAR(volts.surge_v, 5 * rate, 1e-12) << n;
    EXPECT_NEAR(volts.sway_v, -5 * rate, 1e-12) << n;
    EXPECT_NEAR(volts.heave_v, 10 * rate, 1e-12) << n;
  }
}

TEST(VisualServo, RateOfTheHeadingIsThatOfEps3) {
  VisualServo servo(Derivative(3, 0), kClock);
  servo.Update(Estimate(0, 0.6, 0, 0, 0.10), {});
  EXPECT_NEAR(servo.Update(Estimate(1, 0.6, 0, 0, 0.12), {}).yaw_v,
              3 * 30 * (std::sin(0.06) - std::sin(0.05)), 1e-12);
}

TEST(VisualServo, MissingFramesGiveTheMeanRateOverTheGap) {
  VisualServo every(Derivative(5, 0.2), kClock), gaps(Derivative(5, 0.2), kClock);
  double last_every = 0, last_gaps = 0;
  int compared = 0;
  for (int n = 0; n <= 40; ++n) {
    const PoseEstimate estimate = Estimate(n, 0.6 + 0.002 * n, 0, 0);
    last_every = every.Update(estimate, {}).surge_v;
    if (n % 4 != 0) continue;
    last_gaps = gaps.Update(estimate, {}).surge_v;
    EXPECT_NEAR(last_gaps, last_every, 1e-12)
        << n;  // a steady rate: the filter is exact for any gap
    ++compared;
  }
  EXPECT_EQ(compared, 11);
  EXPECT_GT(last_gaps, 0.2);
}

TEST(VisualServo, NoKickAtTheFirstFrameNorAfterResetOrALongGap) {
  VisualServoParams params = Derivative(50, 0);
  params.rate_restart_s = 0.3;
  VisualServo servo(params, kClock);
  EXPECT_EQ(servo.Update(Estimate(100, 1.2, 0.3, 0.2, 0.1), {}), AxisVolts{});
  EXPECT_NE(servo.Update(Estimate(101, 1.19, 0.3, 0.2, 0.1), {}).surge_v, 0);

  servo.Reset();
  EXPECT_EQ(servo.Update(Estimate(102, 0.5, -0.3, -0.2, -0.1), {}), AxisVolts{});

  // nine frames missing are 0.3 s and still a gap; ten are longer and a new beginning
  EXPECT_NE(servo.Update(Estimate(112, 0.6, 0, 0), {}).surge_v, 0);
  EXPECT_EQ(servo.Update(Estimate(123, 1.6, 0, 0), {}), AxisVolts{});
}

TEST(VisualServo, SlowCamerasStillHaveARate) {
  VisualServo servo(Derivative(1, 0), {.frames_per_second = 1, .ticks_per_frame = 480});
  servo.Update(Estimate(0, 0.6, 0, 0), {});
  EXPECT_NEAR(servo.Update(Estimate(1, 0.7, 0, 0), {}).surge_v, 0.1, 1e-12);
}

TEST(VisualServo, AMovedTargetDoesNotKick) {
  VisualServo servo(Derivative(50, 0), kClock);
  servo.Update(Estimate(0, 0.6, 0, 0), {.x_m = 0.6});
  EXPECT_EQ(servo.Update(Estimate(1, 0.6, 0, 0), {.x_m = 0.35}), AxisVolts{});
}

TEST(VisualServoDeathTest, RefusesNanAndFramesThatGoBack) {
  VisualServo servo(Proportional(), kClock);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_DEATH(servo.Update(Estimate(0, nan, 0, 0), {}), "estimated pose must be finite");
  EXPECT_DEATH(servo.Update(Estimate(0, 1, 0, 0), {.y_m = nan}), "desired pose must be finite");
  servo.Update(Estimate(7, 1, 0, 0), {});
  EXPECT_DEATH(servo.Update(Estimate(7, 1, 0, 0), {}), "frames must increase");
}

// A vehicle that takes each axis' voltage for a speed. From any corner it must end at the desired
// pose: one wrong sign and it runs away.
TEST(VisualServo, AKinematicVehicleEndsAtTheDesiredPose) {
  const DesiredPose desired{.x_m = 0.6, .y_m = 0.02, .z_m = -0.067, .yaw_rad = 0.1};
  int corners = 0;
  for (const double x_m : {-1.3, -0.4})
    for (const double y_m : {-0.3, 0.3})
      for (const double z_m : {-0.2, 0.2})
        for (const double yaw_rad : {-0.5, 0.5}) {
          Pose X_MH{FromYawPitchRoll(yaw_rad, 0, 0), {x_m, y_m, z_m}};
          VisualServo servo(Proportional(), kClock);
          Pose X_HM;
          for (int n = 0; n < 30 * 60; ++n) {
            X_HM = X_MH.Inverse();
            PoseEstimate estimate;
            estimate.frame = n;
            estimate.X_HM = X_HM;
            const AxisVolts volts = AxesOf(Allocate({}, servo.Update(estimate, desired)));
            const Eigen::Vector3d v_MH_H(volts.surge_v, volts.sway_v, volts.heave_v);
            X_MH = X_MH * Pose{FromYawPitchRoll(volts.yaw_v / 30, 0, 0), 0.1 * v_MH_H / 30};
          }
          EXPECT_NEAR(X_HM.p.x(), desired.x_m, 1e-6);
          EXPECT_NEAR(X_HM.p.y(), desired.y_m, 1e-6);
          EXPECT_NEAR(X_HM.p.z(), desired.z_m, 1e-6);
          EXPECT_NEAR(YawOf(X_HM.q), desired.yaw_rad, 1e-6);
          ++corners;
        }
  EXPECT_EQ(corners, 16);
}

}  // namespace
}  // namespace turbidock::control
