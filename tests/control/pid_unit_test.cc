// PID control: exact values of the controller, its rate filter, its integral and what saturation
// does.

#include "control/pid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/control/published_vehicle.h"

namespace turbidock::control {
namespace {

constexpr ClockParams kClock;  // 30 frames a second

// Strong, and of 1 kg and 1 kg m^2: forces are accelerations.
VehicleModel Unit() {
  VehicleModel vehicle = PublishedVehicle();
  vehicle.inertia.setOnes();
  for (ThrusterModel& thruster : vehicle.thrusters) thruster.curve.max_thrust_newton = 1000;
  return vehicle;
}

PidParams Gains(double kp, double ki, double kd, double filter_s = 0) {
  PidParams params;
  for (PidParams::Translation* axis : {&params.surge, &params.sway, &params.heave})
    *axis = {.kp_per_s2 = kp, .ki_per_s3 = ki, .kd_per_s = kd};
  params.yaw = {.kp_per_s2 = kp, .ki_per_s3 = ki, .kd_per_s = kd};
  params.rate_filter_s = filter_s;
  return params;
}

Observation Seen(int64_t frame, const Axes& position) {
  return {.frame = frame, .position = position, .rate = std::nullopt};
}

// A frame of a controller that gets what it asks for.
Axes Frame(Pid* controller, int64_t frame, const Axes& position, const Reference& wanted = {}) {
  controller->Observe(Seen(frame, position));
  const Axes force = controller->Demand(wanted);
  controller->OnCommandApplied(frame, force);
  return force;
}

TEST(Pid, DefaultsAreValid) { EXPECT_NO_THROW(CheckFields(PidParams{}, "")); }

TEST(Pid, RefusesParametersOutOfRange) {
  PidParams params;
  params.heave.kd_per_s = -1;
  EXPECT_THROW(Pid(params, Unit(), kClock), ConfigError);
}

TEST(Pid, ProportionalPartExactly) {
  Pid controller(Gains(3, 0, 0), Unit(), kClock);
  const Axes force =
      Frame(&controller, 0, {0.70, 0.03, -0.02, 0.1}, {.position = {0.60, 0.01, 0.01, -0.1}});
  EXPECT_DOUBLE_EQ(force[kSurge], 3 * (0.70 - 0.60));
  EXPECT_DOUBLE_EQ(force[kSway], 3 * (0.03 - 0.01));
  EXPECT_DOUBLE_EQ(force[kHeave], 3 * (-0.02 - 0.01));
  EXPECT_DOUBLE_EQ(force[kYaw], 3 * 0.2);
}

// Of the same gains, one that is twice as heavy asks for twice as much; the limit is a share of
// what there is, either way.
TEST(Pid, ForcesFollowTheVehiclesDataAndItsLimits) {
  VehicleModel heavy = PublishedVehicle();
  heavy.inertia *= 2;
  PidParams params = Gains(0.1, 0, 0);
  params.surge.limit_share = 0.5;
  Pid controller(params, PublishedVehicle(), kClock), of_heavy(params, heavy, kClock);
  const Axes error(0.1, -0.1, 0.1, 0.1);
  const Axes force = Frame(&controller, 0, error), of_twice = Frame(&of_heavy, 0, error);
  EXPECT_NEAR(force[kSway], -0.1 * 0.1 * 25, 1e-12);
  EXPECT_NEAR((of_twice - 2 * force).norm(), 0, 1e-12);
  EXPECT_DOUBLE_EQ(Frame(&controller, 1, {1e6, 0, 0, 0})[kSurge], 0.5 * 2 * 4.9);
  EXPECT_DOUBLE_EQ(Frame(&controller, 2, {-1e6, 0, 0, 0})[kSurge], -0.5 * 2 * 0.9 * 4.9);
}

TEST(Pid, RateOfASteadilyMovingMarkerSettlesAtItsSpeed) {
  constexpr double kSpeed_mps = 0.06, kTau_s = 0.2;
  Pid controller(Gains(0, 0, 5, kTau_s), Unit(), kClock);
  for (int n = 0; n <= 60; ++n) {
    const double x_m = 0.6 + kSpeed_mps * n / 30;
    const Axes force = Frame(&controller, n, {x_m, -x_m, 2 * x_m, -x_m / 2});
    // a first-order filter's answer to a step of the rate, n frames after it
    const double rate = kSpeed_mps * (1 - std::exp(-n / (30 * kTau_s)));
    EXPECT_NEAR(force[kSurge], 5 * rate, 1e-12) << n;
    EXPECT_NEAR(force[kSway], -5 * rate, 1e-12) << n;
    EXPECT_NEAR(force[kHeave], 10 * rate, 1e-12) << n;
    EXPECT_NEAR(force[kYaw], -2.5 * rate, 1e-12) << n;
  }
}

// The heading's error has the angle under which the marker is beside its place, and its rate has
// that angle's rate.
TEST(Pid, AimTurnsTowardsTheMarkerByItsAngleAndItsRate) {
  for (const bool by_rate : {false, true}) {
    PidParams params = Gains(by_rate ? 0 : 3, 0, by_rate ? 5 : 0);
    params.yaw.aim = 0.5;
    Pid controller(params, Unit(), kClock);
    Frame(&controller, 0, {0.8, 0.04, 0, 0.1}, {.position = {0.6, 0.01, 0, 0}});
    const Axes force = Frame(&controller, 1, {0.8, 0.07, 0, 0.1},
                             {.position = {0.6, 0.01, 0, 0}, .rate = {0, 0.3, 0, 0}});
    // 0.06 m aside at 0.8 m; 0.9 m/s there, of which 0.3 are wanted
    EXPECT_NEAR(force[kYaw], by_rate ? 5 * 0.5 * (0.9 - 0.3) / 0.8 : 3 * (0.1 + 0.5 * 0.06 / 0.8),
                1e-12);
  }
}

TEST(Pid, MissingFramesGiveTheMeanRateOverTheGap) {
  Pid every(Gains(0, 0, 5, 0.2), Unit(), kClock), gaps(Gains(0, 0, 5, 0.2), Unit(), kClock);
  double last_every = 0, last_gaps = 0;
  for (int n = 0; n <= 40; ++n) {
    const Axes position(0.6 + 0.002 * n, 0, 0, 0);
    last_every = Frame(&every, n, position)[kSurge];
    if (n % 4 != 0) continue;
    last_gaps = Frame(&gaps, n, position)[kSurge];
    EXPECT_NEAR(last_gaps, last_every, 1e-12) << n;  // a steady rate: exact for any gap
  }
  EXPECT_GT(last_gaps, 0.2);
}

TEST(Pid, NoKickAtTheFirstFrameNorAfterALongGapNorFromAMovedTarget) {
  Pid controller(Gains(0, 0, 50), Unit(), kClock);
  EXPECT_EQ(Frame(&controller, 100, {1.2, 0.3, 0.2, 0.1}), Axes(Axes::Zero()));
  EXPECT_NE(Frame(&controller, 101, {1.19, 0.3, 0.2, 0.1})[kSurge], 0);
  // nine frames missing are 0.3 s and still a gap; ten are longer and a new beginning
  EXPECT_NE(Frame(&controller, 111, {0.6, 0, 0, 0})[kSurge], 0);
  EXPECT_EQ(Frame(&controller, 122, {1.6, 0, 0, 0}), Axes(Axes::Zero()));
  EXPECT_EQ(Frame(&controller, 123, {1.6, 0, 0, 0}, {.position = {0.6, 0, 0, 0}}),
            Axes(Axes::Zero()));
}

TEST(Pid, AHeadingThatWrapsHasASmallRate) {
  Pid controller(Gains(0, 0, 1), Unit(), kClock);
  Frame(&controller, 0, {0.6, 0, 0, 3.14});
  EXPECT_NEAR(Frame(&controller, 1, {0.6, 0, 0, -3.14})[kYaw], 30 * (2 * M_PI - 6.28), 1e-9);
}

TEST(Pid, TheFiltersRateIsUsedWhereThereIsOneAndTheWantedRateIsTakenAway) {
  Pid controller(Gains(0, 0, 2), Unit(), kClock);
  controller.Observe({.frame = 0, .position = Axes::Zero(), .rate = Axes(0.1, 0.2, 0.3, 0.4)});
  const Axes force = controller.Demand({.rate = {0.05, 0, 0, 0.1}});
  EXPECT_DOUBLE_EQ(force[kSurge], 2 * (0.1 - 0.05));
  EXPECT_DOUBLE_EQ(force[kSway], 2 * 0.2);
  EXPECT_DOUBLE_EQ(force[kYaw], 2 * (0.4 - 0.1));
}

TEST(Pid, TheIntegralIsTheSumOfTheErrors) {
  Pid controller(Gains(0, 6, 0), Unit(), kClock);
  for (int n = 0; n < 10; ++n)
    EXPECT_NEAR(Frame(&controller, n, {0.02, 0, 0, 0})[kSurge], 6 * 0.02 * n / 30, 1e-12) << n;
  // without control it stands still
  controller.Observe(Seen(10, {0.02, 0, 0, 0}));
  controller.OnCommandApplied(10, Axes::Zero());
  EXPECT_NEAR(Frame(&controller, 11, {0.02, 0, 0, 0})[kSurge], 6 * 0.02 * 10 / 30, 1e-12);
}

// A thruster that gives at most 1 N while the error asks for far more: without back-calculation the
// integral would be 20 N after 10 s and take as long to come back.
TEST(Pid, TheIntegralDoesNotWindUpBehindALimit) {
  PidParams params = Gains(1, 2, 0);
  params.anti_windup_s = 0.5;
  Pid controller(params, Unit(), kClock);
  constexpr double kMost = 1, kError_m = 1;
  Axes demand = Axes::Zero();
  for (int n = 0; n < 300; ++n) {
    controller.Observe(Seen(n, {kError_m, 0, 0, 0}));
    demand = controller.Demand({});
    controller.OnCommandApplied(n, {std::min(kMost, demand[kSurge]), 0, 0, 0});
  }
  // at rest: ki e = (wanted - given) / anti_windup_s
  EXPECT_NEAR(demand[kSurge], kMost + 2 * kError_m * 0.5, 1e-6);
  // the error turns: the demand is out of the limit at once
  controller.Observe(Seen(300, {-kError_m, 0, 0, 0}));
  EXPECT_LT(controller.Demand({})[kSurge], kMost);
}

TEST(Pid, AimTurnsTowardsAMarkerAside) {
  PidParams params = Gains(2, 0, 0);
  params.yaw.aim = 0.5;
  Pid controller(params, Unit(), kClock);
  const Axes force = Frame(&controller, 0, {0.5, 0.1, 0, 0.03}, {.position = {0.5, 0.02, 0, 0}});
  EXPECT_DOUBLE_EQ(force[kYaw], 2 * (0.03 + 0.5 * (0.1 - 0.02) / 0.5));
  EXPECT_DOUBLE_EQ(force[kSway], 2 * (0.1 - 0.02));
}

TEST(PidDeathTest, RefusesFramesThatGoBackAndADemandOutOfNothing) {
  Pid controller(Gains(1, 0, 0), Unit(), kClock);
  EXPECT_DEATH(controller.Demand({}), "nothing has been observed");
  Frame(&controller, 7, Axes::Zero());
  EXPECT_DEATH(controller.Observe(Seen(7, Axes::Zero())), "frames must increase");
}

}  // namespace
}  // namespace turbidock::control
