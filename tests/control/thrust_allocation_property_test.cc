// Laws of the allocation: it inverts the mixer, keeps the range, and gives way in the stated order.

#include "control/thrust_allocation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "sim/base/check.h"
#include "sim/base/random.h"
#include "tests/control/published_vehicle.h"

namespace turbidock::control {
namespace {

const std::vector<double> kAwkwardVolts = {0,     -0.0, 1e-12, -1e-12, 0.1, -0.3, 1.25,
                                           -1.25, 2.4,  2.5,   -2.5,   2.6, -7,   1e9};

void ExpectInRange(const ThrusterCommand& command) {
  for (const double volts : command.volts) {
    EXPECT_GE(volts, 0);
    EXPECT_LE(volts, kMaxVolts);
  }
}

TEST(VoltsAllocation, ZeroIsNeutralExactly) {
  EXPECT_EQ(Allocate({}, {}).volts, ThrusterCommand::Neutral(4).volts);
  EXPECT_EQ(Allocate({.dead_band_v = 0.25}, {}).volts, ThrusterCommand::Neutral(4).volts);
}

// The mixer: which axes a command drives.
AxisVolts AxesOf(const ThrusterCommand& command) {
  const double left = command.volts[0], right = command.volts[1], sway = command.volts[2],
               heave = command.volts[3];
  return {.surge_v = (left + right) / 2 - kNeutralVolts,
          .sway_v = sway - kNeutralVolts,
          .heave_v = heave - kNeutralVolts,
          .yaw_v = (right - left) / 2};
}

TEST(VoltsAllocation, MixerTimesAllocatorIsIdentityWhereNothingSaturates) {
  int checked = 0;
  for (const double surge : kAwkwardVolts)
    for (const double yaw : kAwkwardVolts)
      for (const double sway : kAwkwardVolts) {
        const AxisVolts axes{.surge_v = surge, .sway_v = sway, .heave_v = -sway, .yaw_v = yaw};
        if (std::abs(surge) + std::abs(yaw) > 2.5 || std::abs(sway) > 2.5) continue;
        const AxisVolts back = AxesOf(Allocate({}, axes));
        constexpr double kRounding_v = 1e-15;  // of sums of numbers below 5
        EXPECT_NEAR(back.surge_v, axes.surge_v, kRounding_v);
        EXPECT_NEAR(back.sway_v, axes.sway_v, kRounding_v);
        EXPECT_NEAR(back.heave_v, axes.heave_v, kRounding_v);
        EXPECT_NEAR(back.yaw_v, axes.yaw_v, kRounding_v);
        ++checked;
      }
  EXPECT_EQ(checked, 82 * 11);  // pairs of surge and yaw within the range, times sways
}

// The other route: forces of thrusters where they sit, surge at y = +-0.1 m, pushing along their
// axes.
TEST(VoltsAllocation, ThrustersPushTheVehicleTheWayTheAxisSays) {
  auto wrench = [](const AxisVolts& axes) {
    const ThrusterCommand command = Allocate({}, axes);
    const Eigen::Vector3d p_BQ[] = {{0, 0.1, 0}, {0, -0.1, 0}, {0, 0, 0}, {0, 0, 0}};
    const Eigen::Vector3d axis_B[] = {{1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector3d f = (command.volts[i] - kNeutralVolts) * axis_B[i];
      sum.head<3>() += p_BQ[i].cross(f);
      sum.tail<3>() += f;
    }
    return sum;
  };
  EXPECT_NEAR(wrench({.surge_v = 1})[3], 2, 1e-12);
  EXPECT_NEAR(wrench({.sway_v = 1})[4], 1, 1e-12);
  EXPECT_NEAR(wrench({.heave_v = 1})[5], 1, 1e-12);
  EXPECT_NEAR(wrench({.yaw_v = 1})[2], 0.2, 1e-12);  // about z, counter-clockwise from above
  EXPECT_NEAR(wrench({.surge_v = 1})[2], 0, 1e-12);
  EXPECT_NEAR(wrench({.yaw_v = 1})[3], 0, 1e-12);
}

TEST(VoltsAllocation, EveryVoltageIsInRangeWhateverIsAsked) {
  Rng rng = SeedTree(7).Stream("allocation");
  for (int n = 0; n < 20000; ++n) {
    const double scale = std::pow(10, rng.Uniform(-3, 3));
    const VoltsAllocationParams params{.dead_band_v = n % 2 ? rng.Uniform(0, 1) : 0,
                                       .curve_exponent = n % 3 ? rng.Uniform(1, 4) : 1,
                                       .ramp_v = 0.05};
    ExpectInRange(Allocate(params, {.surge_v = scale * rng.Normal(),
                                    .sway_v = scale * rng.Normal(),
                                    .heave_v = scale * rng.Normal(),
                                    .yaw_v = scale * rng.Normal()}));
  }
}

TEST(VoltsAllocation, SaturationKeepsYawFirstThenSurge) {
  // 2 V of yaw leave 0.5 V of the 3 V of surge
  ThrusterCommand command = Allocate({}, {.surge_v = 3, .yaw_v = 2});
  EXPECT_DOUBLE_EQ(command.volts[0], 2.5 + 0.5 - 2);
  EXPECT_DOUBLE_EQ(command.volts[1], 2.5 + 0.5 + 2);
  command = Allocate({}, {.surge_v = -3, .yaw_v = -2});
  EXPECT_DOUBLE_EQ(command.volts[0], 2.5 - 0.5 + 2);
  EXPECT_DOUBLE_EQ(command.volts[1], 2.5 - 0.5 - 2);
  // too much yaw leaves nothing
  command = Allocate({}, {.surge_v = 1, .yaw_v = 9});
  EXPECT_EQ(command.volts[0], 0);
  EXPECT_EQ(command.volts[1], 5);
  // sway and heave do not share
  command = Allocate({}, {.sway_v = -9, .heave_v = 9, .yaw_v = 2.5});
  EXPECT_EQ(command.volts[2], 0);
  EXPECT_EQ(command.volts[3], 5);
}

TEST(VoltsAllocation, RefusesWhatIsOutOfRange) {
  EXPECT_NO_THROW(VoltsAllocation({.dead_band_v = 1}, PublishedVehicle()));
  EXPECT_THROW(VoltsAllocation({.dead_band_v = 1.1}, PublishedVehicle()), ConfigError);
}

TEST(VoltsAllocation, DeadBandIsAddedToEachThrustersDemand) {
  const VoltsAllocationParams params{.dead_band_v = 0.25, .curve_exponent = 1, .ramp_v = 0.1};
  // beyond the ramp all of it, below in proportion
  EXPECT_DOUBLE_EQ(Allocate(params, {.sway_v = 0.4}).volts[2], 2.5 + 0.4 + 0.25);
  EXPECT_DOUBLE_EQ(Allocate(params, {.sway_v = -0.1}).volts[2], 2.5 - 0.1 - 0.25);
  EXPECT_DOUBLE_EQ(Allocate(params, {.heave_v = 0.02}).volts[3], 2.5 + 0.2 * (0.1 + 0.25));
  // opposite demands of surge and yaw cancel in one thruster, which stays neutral
  const ThrusterCommand turn = Allocate(params, {.surge_v = 0.5, .yaw_v = 0.5});
  EXPECT_DOUBLE_EQ(turn.volts[0], 2.5);
  EXPECT_DOUBLE_EQ(turn.volts[1], 2.5 + 1 + 0.25);
  // the compensation's share of the range is surge's loss, not yaw's
  const ThrusterCommand both = Allocate(params, {.surge_v = 1, .yaw_v = 2});
  EXPECT_DOUBLE_EQ(both.volts[0], 2.5 + (0.25 - 2) - 0.25);
  EXPECT_DOUBLE_EQ(both.volts[1], 2.5 + (0.25 + 2) + 0.25);
  // full demand ends exactly at the range
  EXPECT_DOUBLE_EQ(Allocate(params, {.heave_v = 9}).volts[3], 5);
  EXPECT_DOUBLE_EQ(Allocate(params, {.heave_v = 2.2}).volts[3], 2.5 + 2.2 + 0.25);
}

// The other route: the static curve of a thruster, dead band 0.25 V and then a square, driven by
// the command. Compensated, it answers a demand in proportion.
TEST(VoltsAllocation, InverseCurveMakesThrustProportionalToTheDemand) {
  const VoltsAllocationParams params{.dead_band_v = 0.25, .curve_exponent = 2, .ramp_v = 0.05};
  auto thrust_newton = [](double volts) {
    const double beyond = std::max(0.0, (std::abs(volts - 2.5) - 0.25) / 2.25);
    return std::copysign(4.9 * beyond * beyond, volts - 2.5);
  };
  int compared = 0;
  for (int n = -225; n <= 225; ++n) {
    const double demand_v = n / 100.0;
    if (std::abs(demand_v) < params.ramp_v) continue;
    const double volts = Allocate(params, {.sway_v = demand_v}).volts[2];
    EXPECT_NEAR(thrust_newton(volts), 4.9 * demand_v / 2.25, 1e-12) << demand_v;
    ++compared;
  }
  EXPECT_EQ(compared, 442);
}

TEST(VoltsAllocation, CompensationIsOddContinuousAndMonotonic) {
  const VoltsAllocationParams params{.dead_band_v = 0.25, .curve_exponent = 2, .ramp_v = 0.1};
  auto volts = [&](double demand_v) { return Allocate(params, {.sway_v = demand_v}).volts[2]; };
  double last = -1;
  for (int n = -300; n <= 300; ++n) {
    EXPECT_GE(volts(n / 100.0), last);
    last = volts(n / 100.0);
    EXPECT_NEAR(last - 2.5, 2.5 - volts(-n / 100.0), 1e-15);
  }
  EXPECT_EQ(last, 5);
  EXPECT_NEAR(volts(0.1 - 1e-9), volts(0.1 + 1e-9), 1e-7);
}

TEST(VoltsAllocation, TheAttainablePartGivesTheSameCommandAndIsItsOwn) {
  Rng rng = SeedTree(8).Stream("attainable");
  for (int n = 0; n < 2000; ++n) {
    const VoltsAllocationParams params{.dead_band_v = n % 2 ? 0.25 : 0,
                                       .curve_exponent = n % 3 ? 2.0 : 1.0};
    const double scale = std::pow(10, rng.Uniform(-2, 2));
    const AxisVolts asked{scale * rng.Normal(), scale * rng.Normal(), scale * rng.Normal(),
                          scale * rng.Normal()};
    const AxisVolts part = Attainable(params, asked);
    EXPECT_EQ(Allocate(params, part).volts, Allocate(params, asked).volts);
    EXPECT_EQ(Attainable(params, part), part);
    EXPECT_LE(std::abs(part.surge_v), std::abs(asked.surge_v));
  }
  EXPECT_EQ(Attainable({.dead_band_v = 0.25}, {.surge_v = 2, .sway_v = -9, .yaw_v = 1}),
            (AxisVolts{.surge_v = 1.25, .sway_v = -2.25, .yaw_v = 1}));
}

TEST(VoltsAllocationDeathTest, RefusesNan) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_DEATH(Allocate({}, {.heave_v = nan}), "axis voltages must be finite");
}

TEST(VoltsAllocation, IsThePublishedVehiclesAlone) {
  VehicleModel vehicle = PublishedVehicle();
  const VoltsAllocation allocation({}, vehicle);
  EXPECT_EQ(allocation.authority(), Axes::Constant(2.5));
  const Allocated allocated = allocation.Share({3, 0.5, -9, 2});
  EXPECT_EQ(allocated.given, Axes(0.5, 0.5, -2.5, 2));
  EXPECT_EQ(allocated.command.volts,
            Allocate({}, {.surge_v = 3, .sway_v = 0.5, .heave_v = -9, .yaw_v = 2}).volts);
  std::swap(vehicle.thrusters[2], vehicle.thrusters[3]);
  try {
    VoltsAllocation({}, vehicle);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_STREQ(
        error.what(),
        "control.use: p_voltage asks for the voltages of the published vehicle's thrusters "
        "(surge_left, surge_right, sway, heave); this one has surge_left, surge_right, "
        "heave, sway. pid and lqg ask for forces");
  }
}

// ------------------------------------------------------------------------------------------------

// Eight thrusters as on a vectored work-class vehicle, of two strengths; lifted above B's origin.
VehicleModel Vectored() {
  VehicleModel vehicle = PublishedVehicle();
  vehicle.thrusters.clear();
  for (const double x : {0.16, -0.16})
    for (const double y : {0.11, -0.11}) {
      ThrusterModel level{.name = "level", .p_BT = {x, y, 0.08}};
      level.axis_B = Eigen::Vector3d(1, x * y > 0 ? -1 : 1, 0).normalized();
      level.curve.max_thrust_newton = 40;
      vehicle.thrusters.push_back(level);
      ThrusterModel upright{.name = "upright", .p_BT = {0.75 * x, 2 * y, 0}, .axis_B = {0, 0, 1}};
      upright.curve.max_thrust_newton = 25;
      upright.curve.curve_exponent = 1.8;
      vehicle.thrusters.push_back(upright);
    }
  return vehicle;
}

// The other route: what a command does to the vehicle by each thruster's curve.
Eigen::Matrix<double, 6, 1> WrenchOf(const VehicleModel& vehicle, const ThrusterCommand& command) {
  Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
  for (size_t i = 0; i < vehicle.thrusters.size(); ++i) {
    const ThrusterModel& t = vehicle.thrusters[i];
    const Eigen::Vector3d f = t.effectiveness * t.curve.Thrust(command.volts[i]) * t.axis_B;
    sum.head<3>() += f;
    sum.tail<3>() += t.p_BT.cross(f);
  }
  return sum;
}
Axes AxesOf(const Eigen::Matrix<double, 6, 1>& wrench) {
  return {wrench[0], wrench[1], wrench[2], wrench[5]};
}

const ForceAllocationParams kNoRamp{.ramp_share = 1e-4};

TEST(ForceAllocation, GivesTheVehicleWhatItSaysWhateverIsAsked) {
  Rng rng = SeedTree(9).Stream("forces");
  for (const VehicleModel& vehicle : {PublishedVehicle(), Vectored()}) {
    const ForceAllocation allocation(kNoRamp, vehicle);
    int whole = 0;
    for (int n = 0; n < 5000; ++n) {
      const double scale = std::pow(10, rng.Uniform(-2, 1));
      Axes asked;
      for (double& force : asked) force = scale * rng.Normal();
      asked = asked.cwiseProduct(allocation.authority());
      const Allocated got = allocation.Share(asked);
      ExpectInRange(got.command);
      const Eigen::Matrix<double, 6, 1> wrench = WrenchOf(vehicle, got.command);
      // but for the ramp over the dead band, at most 1e-4 of each thruster's most
      const double tolerance = 1e-3 * vehicle.thrusters[0].curve.max_thrust_newton;
      EXPECT_NEAR((AxesOf(wrench) - got.given).norm(), 0, tolerance);
      EXPECT_NEAR(wrench.segment<2>(3).norm(), 0, tolerance);  // level
      EXPECT_NEAR((allocation.GivenBy(got.command) - AxesOf(wrench)).norm(), 0, 1e-9);
      // A part of what was asked, never more and never the other way.
      for (int axis = 0; axis < kAxisCount; ++axis) {
        EXPECT_LE(std::abs(got.given[axis]), std::abs(asked[axis]) * (1 + 1e-12));
        EXPECT_GE(got.given[axis] * asked[axis], 0);
      }
      whole += (got.given - asked).norm() < 1e-12;
      // Its part is its own.
      EXPECT_NEAR((allocation.Share(got.given).given - got.given).norm(), 0, 1e-9 * asked.norm());
    }
    EXPECT_GT(whole, 1000);
    EXPECT_LT(whole, 4900);
  }
}

TEST(ForceAllocation, MostForcesAreThoseOfTheThrusters) {
  const ForceAllocation published({}, PublishedVehicle());
  EXPECT_NEAR((published.most() - Axes(9.8, 4.9, 4.9, 0.2 * 4.41)).norm(), 0, 1e-12);
  EXPECT_NEAR((published.most_back() + Axes(8.82, 4.41, 4.41, 0.2 * 4.41)).norm(), 0, 1e-12);
  const ForceAllocation vectored({}, Vectored());
  // Level ones push ahead to the sides of each other's reverse: full ahead is all four forward.
  EXPECT_NEAR(vectored.most()[kSurge], 4 * 40 * std::sqrt(0.5), 1e-9);
  EXPECT_NEAR(vectored.most()[kHeave], 4 * 25, 1e-9);
  EXPECT_NEAR(vectored.most()[kSway], 4 * 0.9 * 40 * std::sqrt(0.5), 1e-9);
}

// With nothing left the heading is whole, then depth, then what is left ahead.
TEST(ForceAllocation, SaturationKeepsTheHeadingFirst) {
  for (const VehicleModel& vehicle : {PublishedVehicle(), Vectored()}) {
    const ForceAllocation allocation({}, vehicle);
    const Axes most = allocation.most();
    const Allocated all = allocation.Share(10 * most);
    EXPECT_NEAR(all.given[kYaw], most[kYaw], 1e-9);
    EXPECT_NEAR(all.given[kHeave], most[kHeave], 1e-9);
    EXPECT_LT(all.given[kSurge], 0.2 * most[kSurge]);
    const Allocated half = allocation.Share({10 * most[kSurge], 0, 0, 0.5 * most[kYaw]});
    EXPECT_NEAR(half.given[kYaw], 0.5 * most[kYaw], 1e-12);
    EXPECT_GT(half.given[kSurge], 0.4 * most[kSurge]);
  }
}

TEST(ForceAllocation, AMomentLevelsAndDoesNothingElse) {
  const VehicleModel vectored = Vectored();
  const ForceAllocation allocation(kNoRamp, vectored);
  Rng rng = SeedTree(10).Stream("level");
  for (int n = 0; n < 500; ++n) {
    const RollPitch level(rng.Uniform(-1.5, 1.5), rng.Uniform(-1.5, 1.5));
    const Axes demand(rng.Uniform(-10, 10), rng.Uniform(-10, 10), rng.Uniform(-10, 10),
                      rng.Uniform(-1, 1));
    const Allocated got = allocation.Share(demand, level);
    const Eigen::Matrix<double, 6, 1> wrench = WrenchOf(vectored, got.command);
    EXPECT_EQ(got.given, allocation.Share(demand).given);
    EXPECT_NEAR((AxesOf(wrench) - demand).norm(), 0, 0.04);
    EXPECT_NEAR((wrench.segment<2>(3) - level).norm(), 0, 0.04);
  }
  // Too much of everything: the level first, then the heading.
  const Allocated all = allocation.Share(10 * allocation.most(), {2, -1});
  EXPECT_NEAR(all.given[kYaw] / allocation.most()[kYaw], 1, 0.1);
  EXPECT_NEAR((WrenchOf(vectored, all.command).segment<2>(3) - RollPitch(2, -1)).norm(), 0, 0.04);
  EXPECT_LT(all.given[kHeave], allocation.most()[kHeave]);
}

// Four thrusters for four axes: none is free to level.
TEST(ForceAllocation, NoMomentFromAVehicleThatHasNone) {
  const ForceAllocation allocation({}, PublishedVehicle());
  const Axes demand(3, -1, 2, 0.1);
  EXPECT_EQ(allocation.Share(demand, {0.5, -0.5}).command.volts,
            allocation.Share(demand).command.volts);
  // The upright ones alone at the sides roll and do not pitch.
  VehicleModel two_upright = PublishedVehicle();
  two_upright.thrusters.pop_back();
  for (const double y : {0.2, -0.2})
    two_upright.thrusters.push_back({.name = "upright", .p_BT = {0, y, 0}, .axis_B = {0, 0, 1}});
  const ForceAllocation rolls(kNoRamp, two_upright);
  const Eigen::Matrix<double, 6, 1> wrench =
      WrenchOf(two_upright, rolls.Share(Axes::Zero(), {0.3, 0.3}).command);
  EXPECT_NEAR(wrench[3], 0.3, 1e-3);
  EXPECT_NEAR(wrench[4], 0, 1e-9);
  EXPECT_NEAR(AxesOf(wrench).norm(), 0, 1e-3);
}

TEST(ForceAllocation, FailedThrustersDropOut) {
  // Of eight one may go: everything is still there, by the others.
  VehicleModel vectored = Vectored();
  const Axes demand(20, 5, -10, 1);
  for (ThrusterModel& failed : vectored.thrusters) {
    failed.effectiveness = 0;
    const Allocated got = ForceAllocation(kNoRamp, vectored).Share(demand);
    EXPECT_NEAR((got.given - demand).norm(), 0, 1e-9);
    EXPECT_NEAR((AxesOf(WrenchOf(vectored, got.command)) - demand).norm(), 0, 0.05);
    failed.effectiveness = 1;
  }
  // Of four none: sway is gone and nothing else.
  VehicleModel published = PublishedVehicle();
  published.thrusters[2].effectiveness = 0;
  const ForceAllocation allocation(kNoRamp, published);
  const Allocated got = allocation.Share({2, 2, 2, 0.2});
  EXPECT_EQ(got.given, Axes(2, 0, 2, 0.2));
  EXPECT_EQ(got.command.volts[2], kNeutralVolts);
  EXPECT_EQ(allocation.authority()[kSway], (4.9 + 4.41) / 2);  // of the sound vehicle
  // A weak one is driven harder.
  published.thrusters[2].effectiveness = 0.5;
  const ForceAllocation halved(kNoRamp, published);
  const Allocated weak = halved.Share({0, 1, 0, 0});
  EXPECT_NEAR(0.5 * published.thrusters[2].curve.Thrust(weak.command.volts[2]), 1, 1e-12);
  EXPECT_NEAR((halved.GivenBy(weak.command) - Axes(0, 1, 0, 0)).norm(), 0, 1e-9);
}

TEST(ForceAllocation, AVehicleThatCannotPushAlongAnAxisIsRefusedByItsName) {
  VehicleModel vehicle = PublishedVehicle();
  vehicle.thrusters[2].axis_B = {0, 0, 1};
  try {
    ForceAllocation({}, vehicle);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(),
                 "the vehicle's thrusters cannot push along sway by itself, which "
                 "docking needs");
  }
}

TEST(ForceAllocation, TheRampLeavesNoJumpAtTheDeadBand) {
  const ForceAllocation allocation({.ramp_share = 0.1}, PublishedVehicle());
  double last = kNeutralVolts;
  for (int n = 0; n <= 500; ++n) {
    const double volts = allocation.Share({0, 0.01 * n, 0, 0}).command.volts[2];
    EXPECT_GE(volts, last);
    EXPECT_LT(volts - last, 0.02);
    last = volts;
  }
  EXPECT_EQ(last, kMaxVolts);
}

TEST(ForceAllocationDeathTest, RefusesNan) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_DEATH(ForceAllocation({}, PublishedVehicle()).Share({nan, 0, 0, 0}), "must be finite");
}

}  // namespace
}  // namespace turbidock::control
