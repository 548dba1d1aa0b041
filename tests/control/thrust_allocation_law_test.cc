// Laws of the allocation: it inverts the mixer, keeps the range, and gives way in the stated order.

#include "control/thrust_allocation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "sim/base/random.h"

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

TEST(ThrustAllocation, ZeroIsNeutralExactly) {
  EXPECT_EQ(Allocate({}, {}).volts, ThrusterCommand{}.volts);
  EXPECT_EQ(Allocate({.dead_band_v = 0.25}, {}).volts, ThrusterCommand{}.volts);
}

// The mixer: which axes a command drives.
AxisVolts AxesOf(const ThrusterCommand& command) {
  const auto& [left, right, sway, heave] = command.volts;
  return {.surge_v = (left + right) / 2 - kNeutralVolts,
          .sway_v = sway - kNeutralVolts,
          .heave_v = heave - kNeutralVolts,
          .yaw_v = (right - left) / 2};
}

TEST(ThrustAllocation, MixerTimesAllocatorIsIdentityWhereNothingSaturates) {
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
TEST(ThrustAllocation, ThrustersPushTheVehicleTheWayTheAxisSays) {
  auto wrench = [](const AxisVolts& axes) {
    const ThrusterCommand command = Allocate({}, axes);
    const Eigen::Vector3d p_BQ[] = {{0, 0.1, 0}, {0, -0.1, 0}, {0, 0, 0}, {0, 0, 0}};
    const Eigen::Vector3d axis_B[] = {{1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
    for (int i = 0; i < kThrusterCount; ++i) {
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

TEST(ThrustAllocation, EveryVoltageIsInRangeWhateverIsAsked) {
  Rng rng = SeedTree(7).Stream("allocation");
  for (int n = 0; n < 20000; ++n) {
    const double scale = std::pow(10, rng.Uniform(-3, 3));
    const AllocationParams params{.dead_band_v = n % 2 ? rng.Uniform(0, 1) : 0,
                                  .curve_exponent = n % 3 ? rng.Uniform(1, 4) : 1,
                                  .ramp_v = 0.05};
    ExpectInRange(Allocate(params, {.surge_v = scale * rng.Normal(),
                                    .sway_v = scale * rng.Normal(),
                                    .heave_v = scale * rng.Normal(),
                                    .yaw_v = scale * rng.Normal()}));
  }
}

TEST(ThrustAllocation, SaturationKeepsYawFirstThenSurge) {
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

TEST(ThrustAllocation, DeadBandIsAddedToEachThrustersDemand) {
  const AllocationParams params{.dead_band_v = 0.25, .curve_exponent = 1, .ramp_v = 0.1};
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
TEST(ThrustAllocation, InverseCurveMakesThrustProportionalToTheDemand) {
  const AllocationParams params{.dead_band_v = 0.25, .curve_exponent = 2, .ramp_v = 0.05};
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

TEST(ThrustAllocation, CompensationIsOddContinuousAndMonotonic) {
  const AllocationParams params{.dead_band_v = 0.25, .curve_exponent = 2, .ramp_v = 0.1};
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

TEST(ThrustAllocation, TheAttainablePartGivesTheSameCommandAndIsItsOwn) {
  Rng rng = SeedTree(8).Stream("attainable");
  for (int n = 0; n < 2000; ++n) {
    const AllocationParams params{.dead_band_v = n % 2 ? 0.25 : 0,
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

TEST(ThrustAllocationDeathTest, RefusesNan) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_DEATH(Allocate({}, {.heave_v = nan}), "axis voltages must be finite");
}

}  // namespace
}  // namespace turbidock::control
