// PID control: exact values of the law, its rate filter, its integral and what saturation does.

#include "control/pid.h"

#include <gtest/gtest.h>

#include <cmath>

namespace turbidock::control {
namespace {

constexpr ClockParams kClock;  // 30 frames a second

PidParams Gains(double kp, double ki, double kd, double filter_s = 0) {
  PidParams params;
  for (PidParams::Translation* axis : {&params.surge, &params.sway, &params.heave})
    *axis = {.kp_v_per_m = kp, .ki_v_per_m_s = ki, .kd_v_s_per_m = kd, .limit_v = 2.5};
  params.yaw = {.kp_v_per_rad = kp, .ki_v_per_rad_s = ki, .kd_v_s_per_rad = kd, .limit_v = 2.5};
  params.rate_filter_s = filter_s;
  return params;
}

Observation Seen(int64_t frame, const Axes& position) {
  return {.frame = frame, .position = position, .rate = std::nullopt};
}

// A frame of a law that gets what it asks for.
AxisVolts Frame(Pid* law, int64_t frame, const Axes& position, const Reference& wanted = {}) {
  law->Observe(Seen(frame, position));
  const AxisVolts volts = law->Demand(wanted);
  law->Given(frame, volts);
  return volts;
}

TEST(Pid, DefaultsAreValid) { EXPECT_NO_THROW(CheckFields(PidParams{}, "")); }

TEST(Pid, RefusesParametersOutOfRange) {
  PidParams params;
  params.heave.kd_v_s_per_m = -1;
  EXPECT_THROW(Pid(params, kClock), ConfigError);
}

TEST(Pid, ProportionalPartExactly) {
  Pid law(Gains(3, 0, 0), kClock);
  const AxisVolts volts =
      Frame(&law, 0, {0.70, 0.03, -0.02, 0.1}, {.position = {0.60, 0.01, 0.01, -0.1}});
  EXPECT_DOUBLE_EQ(volts.surge_v, 3 * (0.70 - 0.60));
  EXPECT_DOUBLE_EQ(volts.sway_v, 3 * (0.03 - 0.01));
  EXPECT_DOUBLE_EQ(volts.heave_v, 3 * (-0.02 - 0.01));
  EXPECT_DOUBLE_EQ(volts.yaw_v, 3 * 0.2);
}

TEST(Pid, RateOfASteadilyMovingMarkerSettlesAtItsSpeed) {
  constexpr double kSpeed_mps = 0.06, kTau_s = 0.2;
  Pid law(Gains(0, 0, 5, kTau_s), kClock);
  for (int n = 0; n <= 60; ++n) {
    const double x_m = 0.6 + kSpeed_mps * n / 30;
    const AxisVolts volts = Frame(&law, n, {x_m, -x_m, 2 * x_m, -x_m / 2});
    // a first-order filter's answer to a step of the rate, n frames after it
    const double rate = kSpeed_mps * (1 - std::exp(-n / (30 * kTau_s)));
    EXPECT_NEAR(volts.surge_v, 5 * rate, 1e-12) << n;
    EXPECT_NEAR(volts.sway_v, -5 * rate, 1e-12) << n;
    EXPECT_NEAR(volts.heave_v, 10 * rate, 1e-12) << n;
    EXPECT_NEAR(volts.yaw_v, -2.5 * rate, 1e-12) << n;
  }
}

// The heading's error has the angle under which the marker is beside its place, and its rate has
// that angle's rate.
TEST(Pid, AimTurnsTowardsTheMarkerByItsAngleAndItsRate) {
  for (const bool by_rate : {false, true}) {
    PidParams params = Gains(by_rate ? 0 : 3, 0, by_rate ? 5 : 0);
    params.yaw.aim = 0.5;
    Pid law(params, kClock);
    Frame(&law, 0, {0.8, 0.04, 0, 0.1}, {.position = {0.6, 0.01, 0, 0}});
    const AxisVolts volts = Frame(&law, 1, {0.8, 0.07, 0, 0.1},
                                  {.position = {0.6, 0.01, 0, 0}, .rate = {0, 0.3, 0, 0}});
    // 0.06 m aside at 0.8 m; 0.9 m/s there, of which 0.3 are wanted
    EXPECT_NEAR(volts.yaw_v, by_rate ? 5 * 0.5 * (0.9 - 0.3) / 0.8 : 3 * (0.1 + 0.5 * 0.06 / 0.8),
                1e-12);
  }
}

TEST(Pid, MissingFramesGiveTheMeanRateOverTheGap) {
  Pid every(Gains(0, 0, 5, 0.2), kClock), gaps(Gains(0, 0, 5, 0.2), kClock);
  double last_every = 0, last_gaps = 0;
  for (int n = 0; n <= 40; ++n) {
    const Axes position(0.6 + 0.002 * n, 0, 0, 0);
    last_every = Frame(&every, n, position).surge_v;
    if (n % 4 != 0) continue;
    last_gaps = Frame(&gaps, n, position).surge_v;
    EXPECT_NEAR(last_gaps, last_every, 1e-12) << n;  // a steady rate: exact for any gap
  }
  EXPECT_GT(last_gaps, 0.2);
}

TEST(Pid, NoKickAtTheFirstFrameNorAfterALongGapNorFromAMovedTarget) {
  Pid law(Gains(0, 0, 50), kClock);
  EXPECT_EQ(Frame(&law, 100, {1.2, 0.3, 0.2, 0.1}), AxisVolts{});
  EXPECT_NE(Frame(&law, 101, {1.19, 0.3, 0.2, 0.1}).surge_v, 0);
  // nine frames missing are 0.3 s and still a gap; ten are longer and a new beginning
  EXPECT_NE(Frame(&law, 111, {0.6, 0, 0, 0}).surge_v, 0);
  EXPECT_EQ(Frame(&law, 122, {1.6, 0, 0, 0}), AxisVolts{});
  EXPECT_EQ(Frame(&law, 123, {1.6, 0, 0, 0}, {.position = {0.6, 0, 0, 0}}), AxisVolts{});
}

TEST(Pid, AHeadingThatWrapsHasASmallRate) {
  Pid law(Gains(0, 0, 1), kClock);
  Frame(&law, 0, {0.6, 0, 0, 3.14});
  EXPECT_NEAR(Frame(&law, 1, {0.6, 0, 0, -3.14}).yaw_v, 30 * (2 * M_PI - 6.28), 1e-9);
}

TEST(Pid, TheFiltersRateIsUsedWhereThereIsOneAndTheWantedRateIsTakenAway) {
  Pid law(Gains(0, 0, 2), kClock);
  law.Observe({.frame = 0, .position = Axes::Zero(), .rate = Axes(0.1, 0.2, 0.3, 0.4)});
  const AxisVolts volts = law.Demand({.rate = {0.05, 0, 0, 0.1}});
  EXPECT_DOUBLE_EQ(volts.surge_v, 2 * (0.1 - 0.05));
  EXPECT_DOUBLE_EQ(volts.sway_v, 2 * 0.2);
  EXPECT_DOUBLE_EQ(volts.yaw_v, 2 * (0.4 - 0.1));
}

TEST(Pid, TheIntegralIsTheSumOfTheErrors) {
  Pid law(Gains(0, 6, 0), kClock);
  for (int n = 0; n < 10; ++n)
    EXPECT_NEAR(Frame(&law, n, {0.02, 0, 0, 0}).surge_v, 6 * 0.02 * n / 30, 1e-12) << n;
  // without control it stands still
  law.Observe(Seen(10, {0.02, 0, 0, 0}));
  law.Given(10, {});
  EXPECT_NEAR(Frame(&law, 11, {0.02, 0, 0, 0}).surge_v, 6 * 0.02 * 10 / 30, 1e-12);
}

// A thruster that gives at most 1 V while the error asks for far more: without back-calculation the
// integral would be 20 V after 10 s and take as long to come back.
TEST(Pid, TheIntegralDoesNotWindUpBehindALimit) {
  PidParams params = Gains(1, 2, 0);
  params.anti_windup_s = 0.5;
  Pid law(params, kClock);
  constexpr double kMost_v = 1, kError_m = 1;
  AxisVolts demand;
  for (int n = 0; n < 300; ++n) {
    law.Observe(Seen(n, {kError_m, 0, 0, 0}));
    demand = law.Demand({});
    law.Given(n, {.surge_v = std::min(kMost_v, demand.surge_v)});
  }
  // at rest: ki e = (wanted - given) / anti_windup_s
  EXPECT_NEAR(demand.surge_v, kMost_v + 2 * kError_m * 0.5, 1e-6);
  // the error turns: the demand is out of the limit at once
  law.Observe(Seen(300, {-kError_m, 0, 0, 0}));
  EXPECT_LT(law.Demand({}).surge_v, kMost_v);
}

TEST(Pid, AimTurnsTowardsAMarkerAside) {
  PidParams params = Gains(2, 0, 0);
  params.yaw.aim = 0.5;
  Pid law(params, kClock);
  const AxisVolts volts = Frame(&law, 0, {0.5, 0.1, 0, 0.03}, {.position = {0.5, 0.02, 0, 0}});
  EXPECT_DOUBLE_EQ(volts.yaw_v, 2 * (0.03 + 0.5 * (0.1 - 0.02) / 0.5));
  EXPECT_DOUBLE_EQ(volts.sway_v, 2 * (0.1 - 0.02));
}

TEST(PidDeathTest, RefusesFramesThatGoBackAndADemandOutOfNothing) {
  Pid law(Gains(1, 0, 0), kClock);
  EXPECT_DEATH(law.Demand({}), "nothing has been observed");
  Frame(&law, 7, Axes::Zero());
  EXPECT_DEATH(law.Observe(Seen(7, Axes::Zero())), "frames must increase");
}

}  // namespace
}  // namespace turbidock::control
