// The published controller: exact values, signs and limits.

#include "control/p_voltage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace turbidock::control {
namespace {

PVoltageParams Gains() {
  PVoltageParams params;
  params.surge = {.kp_v_per_m = 10, .limit_v = 2.5};
  params.sway = {.kp_v_per_m = 20, .limit_v = 2.5};
  params.heave = {.kp_v_per_m = 30, .limit_v = 2.5};
  params.yaw = {.kp_v = 4, .limit_v = 2.5};
  return params;
}

Axes Answer(const PVoltageParams& params, const Axes& seen, const Axes& wanted) {
  PVoltage controller(params);
  controller.Observe({.frame = 0, .position = seen, .rate = std::nullopt});
  return controller.Demand({.position = wanted});
}

TEST(PVoltage, DefaultsAreValidAndPublished) {
  const PVoltageParams params;
  EXPECT_NO_THROW(CheckFields(params, ""));
  EXPECT_FALSE(params.pose_filter.enabled);
  EXPECT_FALSE(params.setpoint.enabled);
  EXPECT_EQ(params.allocation.dead_band_v, 0);
  EXPECT_EQ(params.allocation.curve_exponent, 1);
}

TEST(PVoltage, RefusesParametersOutOfRange) {
  PVoltageParams params;
  params.sway.limit_v = 2.6;
  EXPECT_THROW(PVoltage{params}, ConfigError);
}

TEST(PVoltage, LawExactly) {
  const Axes volts = Answer(Gains(), {0.70, 0.03, -0.02, 0.1}, {0.60, 0.01, 0.01, 0});
  EXPECT_DOUBLE_EQ(volts[kSurge], 10 * (0.70 - 0.60));
  EXPECT_DOUBLE_EQ(volts[kSway], 20 * (0.03 - 0.01));
  EXPECT_DOUBLE_EQ(volts[kHeave], 30 * (-0.02 - 0.01));
  EXPECT_DOUBLE_EQ(volts[kYaw], 4 * std::sin(0.05));
}

TEST(PVoltage, EveryAxisGoesTowardsTheMarker) {
  const Axes wanted(0.6, 0, 0, 0);
  EXPECT_GT(Answer(Gains(), {0.7, 0, 0, 0}, wanted)[kSurge], 0);    // farther: forward
  EXPECT_LT(Answer(Gains(), {0.5, 0, 0, 0}, wanted)[kSurge], 0);    // nearer: back
  EXPECT_GT(Answer(Gains(), {0.6, 0.1, 0, 0}, wanted)[kSway], 0);   // left: left
  EXPECT_GT(Answer(Gains(), {0.6, 0, 0.1, 0}, wanted)[kHeave], 0);  // above: up
  EXPECT_GT(Answer(Gains(), {0.6, 0, 0, 0.1}, wanted)[kYaw], 0);    // turned: turn so
  EXPECT_EQ(Answer(Gains(), wanted, wanted), Axes(Axes::Zero()));
}

TEST(PVoltage, EachAxisIsLimited) {
  PVoltageParams params = Gains();
  params.surge.limit_v = 1;
  params.sway.limit_v = 0.5;
  params.heave.limit_v = 0.25;
  params.yaw = {.kp_v = 100, .limit_v = 0.75};
  EXPECT_EQ(Answer(params, {9, -9, 9, -1}, Axes::Zero()), Axes(1, -0.5, 0.25, -0.75));
}

}  // namespace
}  // namespace turbidock::control
