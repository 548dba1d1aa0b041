#include "sim/vehicle/thrusters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace turbidock::vehicle {
namespace {

using ::testing::HasSubstr;

ThrusterCommand All(double volts) { return {.volts = {volts, volts, volts, volts}}; }
const ThrusterForces kStill(4, 0.0);

// Four of one kind.
Thrusters Four(const ThrusterParams& params) {
  return Thrusters(params.Of({"a", "b", "c", "d"}, "thrusters"), params.Effectiveness(4));
}

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
  for (const double volts : {2.25, 2.4, 2.5, 2.75}) EXPECT_EQ(params.Thrust(volts), 0);
  EXPECT_GT(params.Thrust(2.7501), 0);
  EXPECT_LT(params.Thrust(2.2499), 0);
  EXPECT_DOUBLE_EQ(params.Thrust(5), 4.9);
  EXPECT_DOUBLE_EQ(params.Thrust(0), -0.9 * 4.9);
  // Half of the way beyond the dead band gives a quarter of the thrust.
  EXPECT_DOUBLE_EQ(params.Thrust(2.75 + 2.25 / 2), 4.9 / 4);
}

TEST(ThrusterCurve, VoltagesBeyondTheRangeSaturate) {
  const ThrusterParams params;
  EXPECT_EQ(params.Thrust(1e300), params.Thrust(5));
  EXPECT_EQ(params.Thrust(-7), params.Thrust(0));
}

TEST(ThrusterCurve, TableReplacesTheFormula) {
  ThrusterParams params;
  params.table_volts = {0, 2, 3, 4.5};
  params.table_thrust_newton = {-4, 0, 0, 6};
  EXPECT_EQ(Refusal(params), "accepted");
  EXPECT_DOUBLE_EQ(params.Thrust(1), -2);
  EXPECT_EQ(params.Thrust(2.5), 0);
  EXPECT_DOUBLE_EQ(params.Thrust(3.75), 3);
  EXPECT_DOUBLE_EQ(params.Thrust(5), 6);  // held beyond its end
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
  params.effectiveness = {1, 1, 1.5, 1};
  EXPECT_THAT(Refusal(params), HasSubstr("thrusters.effectiveness"));
  params = {};
  params.lag_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(Refusal(params), HasSubstr("thrusters.lag_s"));
  params = {};
  params.lag_power = 2;
  params.rate_limit_newton_per_s = 10;
  EXPECT_THAT([&] { params.Of({"only"}, "thrusters"); },
              ::testing::ThrowsMessage<ConfigError>(HasSubstr("thrusters.lag_power: must be 1")));
}

TEST(Thrusters, WithoutLagTheThrustIsTheCurve) {
  ThrusterParams params;
  params.lag_s = 0;
  Thrusters thrusters = Four(params);
  EXPECT_DOUBLE_EQ(thrusters.Step(All(4), kStill, 0.001)[1], params.Thrust(4));
}

TEST(Thrusters, RateLimitHoldsEvenAgainstAZeroLag) {
  ThrusterParams params;
  params.lag_s = 0;
  params.rate_limit_newton_per_s = 10;
  Thrusters thrusters = Four(params);
  EXPECT_NEAR(thrusters.Step(All(5), kStill, 0.1)[0], 1.0, 1e-12);
  EXPECT_NEAR(thrusters.Step(All(0), kStill, 0.05)[0], 0.5, 1e-12);
}

TEST(Thrusters, FailedAndWeakThrustersGiveTheirShare) {
  ThrusterParams params;
  params.effectiveness = {0, 0.5, 1, 1};
  Thrusters thrusters = Four(params);
  const ThrusterForces thrust = thrusters.Step(All(5), kStill, 0.2);
  EXPECT_EQ(thrust[0], 0);
  EXPECT_DOUBLE_EQ(thrust[1], 0.5 * thrust[2]);
  EXPECT_EQ(thrust[2], thrust[3]);
}

TEST(Thrusters, OnlyAdvanceIntoTheJetLosesThrust) {
  ThrusterParams params;
  params.lag_s = 0;
  params.inflow_loss_s_per_m = 0.5;
  Thrusters thrusters = Four(params);
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
  Thrusters thrusters = Four({});
  thrusters.Step(All(5), kStill, 1);
  thrusters.Reset();
  EXPECT_EQ(thrusters.thrust_newton(), kStill);
  EXPECT_EQ(thrusters.Step(All(2.5), kStill, 1), kStill);
  ThrusterParams late;
  late.dead_time_s = 0.1;
  thrusters = Four(late);
  thrusters.Step(All(5), kStill, 0.05);
  thrusters.Reset();
  EXPECT_EQ(thrusters.Step(All(2.5), kStill, 1), kStill);
}

TEST(Thrusters, EachHasItsOwnKind) {
  ThrusterParams params;
  params.lag_s = 0;
  IndividualThruster strong;
  strong.thruster = "c";
  strong.lag_s = 0;
  strong.max_thrust_newton = 40;
  strong.reverse_ratio = 0.75;
  params.individual = {strong};
  Thrusters thrusters = Four(params);
  const ThrusterForces ahead = thrusters.Step(All(5), kStill, 0.01);
  EXPECT_EQ(ahead, (ThrusterForces{4.9, 4.9, 40, 4.9}));
  EXPECT_DOUBLE_EQ(thrusters.Step(All(0), kStill, 0.01)[2], -30);
}

TEST(Thrusters, AnEmptyCommandIsNeutral) {
  Thrusters thrusters = Four({});
  EXPECT_EQ(thrusters.Step({}, kStill, 1), kStill);
}

TEST(ThrusterParams, WhatFitsNoThrusterIsRefusedByName) {
  const auto refusal = [](const ThrusterParams& params) -> std::string {
    try {
      params.Of({"port", "starboard"}, "vehicle.thrusters");
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "accepted";
  };
  ThrusterParams params;
  EXPECT_EQ(refusal(params), "accepted");
  params.effectiveness = {1, 1, 1};
  EXPECT_THAT(refusal(params), HasSubstr("vehicle.thrusters.effectiveness: has 3 values, but there "
                                         "are 2 thrusters: port, starboard"));
  params.effectiveness.clear();
  params.individual.resize(2);
  params.individual[0].thruster = "port";
  params.individual[1].thruster = "bow";
  EXPECT_THAT(refusal(params), HasSubstr("individual[1].thruster: 'bow' is no thruster of the "
                                         "vehicle (port, starboard)"));
  params.individual[1].thruster = "port";
  EXPECT_THAT(refusal(params), HasSubstr("'port' is given twice"));
}

// Volts is the inverse of Thrust, wherever there is one.
TEST(ThrustCurve, VoltsGiveTheThrust) {
  ThrustCurve linear, square, table;
  square.curve_exponent = 2;
  square.dead_band_volts = 0.4;
  table.table_volts = {0.5, 1, 2, 3, 4, 4.5};
  table.table_thrust_newton = {-6, -5, 0, 0, 3, 9};
  for (const ThrustCurve& curve : {linear, square, table}) {
    EXPECT_EQ(curve.Volts(0), kNeutralVolts);
    for (double share = -1; share <= 1; share += 0.0625) {
      if (share == 0) continue;
      const double thrust =
          std::abs(share) * (share > 0 ? curve.FullForward() : curve.FullReverse());
      EXPECT_NEAR(curve.Thrust(curve.Volts(thrust)), thrust, 1e-12 * std::abs(thrust)) << thrust;
    }
    EXPECT_DOUBLE_EQ(curve.Thrust(curve.Volts(1e3)), curve.FullForward());
    EXPECT_DOUBLE_EQ(curve.Thrust(curve.Volts(-1e3)), curve.FullReverse());
  }
  EXPECT_EQ(table.Volts(1e-9), 3 + 1e-9 / 3);  // the dead band's nearer end
  EXPECT_NEAR(table.Volts(-1e-9), 2, 1e-9);
}

}  // namespace
}  // namespace turbidock::vehicle
