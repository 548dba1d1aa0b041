#include "sim/vehicle/thrusters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace turbidock::vehicle {
namespace {

using ::testing::HasSubstr;

ThrusterCommand All(double volts) { return {.volts = {volts, volts, volts, volts}}; }
constexpr ThrusterForces kStill{};

std::string Refusal(const ThrusterParams& params) {
  try {
    CheckFields(params, "thrusters");
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(ThrusterCurve, DefaultsAreValid) { EXPECT_EQ(Refusal({}), "accepted"); }

TEST(ThrusterCurve, NothingInsideTheDeadBandAndFullThrustAtTheEnds) {
  ThrusterParams params;
  params.dead_band_volts = 0.25;
  params.curve_exponent = 2;
  for (const double volts : {2.25, 2.4, 2.5, 2.75}) EXPECT_EQ(StaticThrust(params, volts), 0);
  EXPECT_GT(StaticThrust(params, 2.7501), 0);
  EXPECT_LT(StaticThrust(params, 2.2499), 0);
  EXPECT_DOUBLE_EQ(StaticThrust(params, 5), 4.9);
  EXPECT_DOUBLE_EQ(StaticThrust(params, 0), -0.9 * 4.9);
  // Half of the way beyond the dead band gives a quarter of the thrust.
  EXPECT_DOUBLE_EQ(StaticThrust(params, 2.75 + 2.25 / 2), 4.9 / 4);
}

TEST(ThrusterCurve, VoltagesBeyondTheRangeSaturate) {
  const ThrusterParams params;
  EXPECT_EQ(StaticThrust(params, 1e300), StaticThrust(params, 5));
  EXPECT_EQ(StaticThrust(params, -7), StaticThrust(params, 0));
}

TEST(ThrusterCurve, TableReplacesTheFormula) {
  ThrusterParams params;
  params.table_volts = {0, 2, 3, 4.5};
  params.table_thrust_newton = {-4, 0, 0, 6};
  EXPECT_EQ(Refusal(params), "accepted");
  EXPECT_DOUBLE_EQ(StaticThrust(params, 1), -2);
  EXPECT_EQ(StaticThrust(params, 2.5), 0);
  EXPECT_DOUBLE_EQ(StaticThrust(params, 3.75), 3);
  EXPECT_DOUBLE_EQ(StaticThrust(params, 5), 6);  // held beyond its end
}

TEST(ThrusterCurve, BadTablesAreRefusedWithTheReason) {
  ThrusterParams params;
  params.table_volts = {0, 2.5, 5};
  EXPECT_THAT(Refusal(params), HasSubstr("thrusters.table_volts: has 3 values"));
  params.table_thrust_newton = {-1, 0.5, 2};
  EXPECT_THAT(Refusal(params), HasSubstr("0.5 N at the neutral voltage"));
  params.table_thrust_newton = {1, 0, 2};
  EXPECT_THAT(Refusal(params), HasSubstr("must not fall"));
  params.table_thrust_newton = {-1, 0, 2};
  params.table_volts = {0, 2.5, 2.5};
  EXPECT_THAT(Refusal(params), HasSubstr("must increase"));
  params = {};
  params.effectiveness[2] = 1.5;
  EXPECT_THAT(Refusal(params), HasSubstr("thrusters.effectiveness"));
  params = {};
  params.lag_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(Refusal(params), HasSubstr("thrusters.lag_s"));
}

TEST(Thrusters, WithoutLagTheThrustIsTheCurve) {
  ThrusterParams params;
  params.lag_s = 0;
  Thrusters thrusters(params);
  EXPECT_DOUBLE_EQ(thrusters.Step(All(4), kStill, 0.001)[1], StaticThrust(params, 4));
}

TEST(Thrusters, RateLimitHoldsEvenAgainstAZeroLag) {
  ThrusterParams params;
  params.lag_s = 0;
  params.rate_limit_newton_per_s = 10;
  Thrusters thrusters(params);
  EXPECT_NEAR(thrusters.Step(All(5), kStill, 0.1)[0], 1.0, 1e-12);
  EXPECT_NEAR(thrusters.Step(All(0), kStill, 0.05)[0], 0.5, 1e-12);
}

TEST(Thrusters, FailedAndWeakThrustersGiveTheirShare) {
  ThrusterParams params;
  params.effectiveness = {0, 0.5, 1, 1};
  Thrusters thrusters(params);
  const ThrusterForces thrust = thrusters.Step(All(5), kStill, 0.2);
  EXPECT_EQ(thrust[0], 0);
  EXPECT_DOUBLE_EQ(thrust[1], 0.5 * thrust[2]);
  EXPECT_EQ(thrust[2], thrust[3]);
}

TEST(Thrusters, OnlyAdvanceIntoTheJetLosesThrust) {
  ThrusterParams params;
  params.lag_s = 0;
  params.inflow_loss_s_per_m = 0.5;
  Thrusters thrusters(params);
  const ThrusterForces moving = {0.4, -0.4, 0, 10};
  const ThrusterForces forward = thrusters.Step(All(5), moving, 0.01);
  EXPECT_DOUBLE_EQ(forward[0], 0.8 * 4.9);
  EXPECT_DOUBLE_EQ(forward[1], 4.9);
  EXPECT_EQ(forward[3], 0);  // outrun: no thrust, not a brake
  const ThrusterForces reverse = thrusters.Step(All(0), moving, 0.01);
  EXPECT_DOUBLE_EQ(reverse[0], -0.9 * 4.9);
  EXPECT_DOUBLE_EQ(reverse[1], -0.8 * 0.9 * 4.9);
}

TEST(Thrusters, ResetStopsThem) {
  Thrusters thrusters((ThrusterParams()));
  thrusters.Step(All(5), kStill, 1);
  thrusters.Reset();
  EXPECT_EQ(thrusters.thrust_newton(), kStill);
  EXPECT_EQ(thrusters.Step(All(2.5), kStill, 1), kStill);
}

}  // namespace
}  // namespace turbidock::vehicle
