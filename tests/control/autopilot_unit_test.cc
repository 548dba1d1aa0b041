// The autopilot as a whole: what each controller makes of a docking, and no jumps between its
// stages.

#include "control/autopilot.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/control/published_vehicle.h"

namespace turbidock::control {
namespace {

constexpr ClockParams kClock;  // 30 frames a second

ControlParams Params(ControllerType controller) {
  ControlParams params;
  params.controller = controller;
  params.pid.setpoint.enabled = params.lqg.setpoint.enabled = true;
  return params;
}

PoseEstimate Estimate(int64_t frame, const Axes& marker, double fitness = 0.8) {
  PoseEstimate estimate;
  estimate.frame = frame;
  estimate.X_HM = {FromYawPitchRoll(marker[kYaw], 0, 0), marker.head<3>()};
  estimate.fitness = fitness;
  return estimate;
}

TEST(Autopilot, EveryLawHasItsOwnFilterSetpointAndUnit) {
  ControlParams params;
  params.pid.setpoint.enabled = true;
  params.p_voltage.pose_filter.enabled = true;
  params.controller = ControllerType::kPVoltage;
  EXPECT_FALSE(params.setpoint().enabled);
  EXPECT_TRUE(params.pose_filter().enabled);
  EXPECT_EQ(MakeAllocation(params, PublishedVehicle())->authority()[kSway], 2.5);  // volts
  params.controller = ControllerType::kPid;
  EXPECT_TRUE(params.setpoint().enabled);
  EXPECT_FALSE(params.pose_filter().enabled);
  EXPECT_EQ(MakeAllocation(params, PublishedVehicle())->authority()[kSway], 4.655);  // newtons
  params.controller = ControllerType::kLqg;
  EXPECT_FALSE(params.pose_filter().enabled);
  EXPECT_EQ(MakeAllocation(params, PublishedVehicle())->authority()[kSway], 4.655);
}

TEST(Autopilot, ThePublishedLawIsThePublishedCommand) {
  Autopilot autopilot(Params(ControllerType::kPVoltage), {.found_hold_s = 0}, PublishedVehicle(),
                      kClock);
  const ThrusterCommand command = autopilot.Update(Estimate(0, {0.62, 0.01, -0.02, 0.02}));
  const double yaw_v = 2 * std::sin(0.01);
  EXPECT_NEAR(command.volts[0], 2.5 + 20 * 0.02 - yaw_v, 1e-12);
  EXPECT_NEAR(command.volts[1], 2.5 + 20 * 0.02 + yaw_v, 1e-12);
  EXPECT_NEAR(command.volts[2], 2.5 + 30 * 0.01, 1e-12);
  EXPECT_NEAR(command.volts[3], 2.5 - 30 * 0.02, 1e-12);
}

TEST(Autopilot, DriftsWithoutAUsableEstimateAndForgetsNothingDangerous) {
  for (const ControllerType controller :
       {ControllerType::kPVoltage, ControllerType::kPid, ControllerType::kLqg}) {
    Autopilot autopilot(Params(controller), {.found_hold_s = 0}, PublishedVehicle(), kClock);
    autopilot.Update(Estimate(0, {0.7, 0, 0, 0}));
    EXPECT_EQ(autopilot.Update(Estimate(1, {5, 3, 2, 1}, 0.1)).volts,
              ThrusterCommand::Neutral(4).volts);
    EXPECT_EQ(autopilot.demand(), Axes(Axes::Zero()));
  }
}

TEST(Autopilot, TheSearchTurnsByItsShareOfWhatThereIs) {
  const ProcedureParams procedure{.search_neutral_s = 0, .search_yaw_v = 0.5};
  Autopilot published(Params(ControllerType::kPVoltage), procedure, PublishedVehicle(), kClock);
  const ThrusterCommand volts = published.Update(Estimate(0, {1, 0, 0, 0}, -0.2));
  EXPECT_DOUBLE_EQ(volts.volts[0], 2.0);
  EXPECT_DOUBLE_EQ(volts.volts[1], 3.0);
  // a fifth of the most moment
  Autopilot lqg(Params(ControllerType::kLqg), procedure, PublishedVehicle(), kClock);
  const ThrusterCommand command = lqg.Update(Estimate(0, {1, 0, 0, 0}, -0.2));
  const ThrustCurve curve;
  EXPECT_NEAR(curve.Thrust(command.volts[1]), 0.2 * 4.41, 1e-12);
  EXPECT_NEAR(curve.Thrust(command.volts[0]), -0.2 * 4.41, 1e-12);
}

// The vehicle's speed follows the voltages. Found half a metre off, led to the servoing pose,
// docked: no change of stage shows in the demand.
TEST(Autopilot, StagesChangeWithoutAJumpOfTheDemand) {
  for (const ControllerType controller : {ControllerType::kPid, ControllerType::kLqg}) {
    ControlParams params = Params(controller);
    params.lqg.latency_frames = 0;
    Autopilot autopilot(params, {.docking_rate_mps = 0.05}, PublishedVehicle(), kClock);
    Axes marker(1.1, 0.05, -0.03, 0.02), speed = Axes::Zero();
    Axes before = Axes::Zero();
    int transitions = 0;
    double at_transition = 0;
    for (int n = 0; n < 1200; ++n) {
      autopilot.Update(Estimate(n, marker));
      const Axes now = autopilot.demand();
      const double jump =
          (now - before).cwiseQuotient(autopilot.allocation().authority()).cwiseAbs().maxCoeff();
      if (autopilot.directive().transition) {
        ++transitions;
        at_transition = std::max(at_transition, jump);
      }
      before = now;
      speed += (now.cwiseQuotient(PublishedVehicle().inertia) - 0.5 * speed) / 30;
      marker -= speed / 30;
      marker[kSway] -= speed[kYaw] * (marker[kSurge] + 0.19) / 30;
    }
    EXPECT_GE(transitions, 2) << NameOf(controller);  // servoing, docking
    EXPECT_LT(at_transition, 0.04) << NameOf(controller);
    EXPECT_LT(marker[kSurge], 0.37) << NameOf(controller);
  }
}

TEST(Autopilot, AnExcitationIsHiddenFromTheLaw) {
  Autopilot one(Params(ControllerType::kLqg), {.found_hold_s = 0}, PublishedVehicle(), kClock);
  Autopilot other(Params(ControllerType::kLqg), {.found_hold_s = 0}, PublishedVehicle(), kClock);
  for (int n = 0; n < 30; ++n) {
    const PoseEstimate estimate = Estimate(n, {0.6, 0.005 * std::sin(n), 0, 0});
    const ThrusterCommand with =
        one.Update(estimate, {.wanted = Axes::Zero(), .share = {0, 0, 0.12, 0}});
    const ThrusterCommand without = other.Update(estimate);
    EXPECT_EQ(one.demand(), other.demand()) << n;
    const ThrustCurve curve;
    EXPECT_NEAR(curve.Thrust(with.volts[3]) - curve.Thrust(without.volts[3]), 0.12 * 4.655, 1e-12);
  }
}

TEST(Autopilot, OtherGainsTakeOverAndTheProcedureGoesOn) {
  ControlParams params = Params(ControllerType::kPVoltage);
  Autopilot autopilot(params, {.found_hold_s = 0}, PublishedVehicle(), kClock);
  const Axes marker(0.62, 0.01, -0.02, 0);
  autopilot.Update(Estimate(0, marker));
  autopilot.Update(Estimate(1, marker));
  const Stage stage = autopilot.directive().stage;
  EXPECT_EQ(stage, Stage::kVisualServoing);

  params.p_voltage.sway.kp_v_per_m = 60;
  autopilot.SetControl(params);
  const ThrusterCommand command = autopilot.Update(Estimate(2, marker));
  EXPECT_NEAR(command.volts[2], 2.5 + 60 * 0.01, 1e-12);
  EXPECT_EQ(autopilot.directive().stage, stage);
  EXPECT_FALSE(autopilot.directive().transition);

  for (const ControllerType controller : {ControllerType::kPid, ControllerType::kLqg}) {
    autopilot.SetControl(Params(controller));
    Autopilot fresh(Params(controller), {.found_hold_s = 0}, PublishedVehicle(), kClock);
    // some frames: a led setpoint begins where the vehicle is
    const int64_t first = controller == ControllerType::kPid ? 3 : 20;
    for (int64_t frame = first; frame < first + 10; ++frame) {
      const ThrusterCommand now = autopilot.Update(Estimate(frame, marker));
      EXPECT_EQ(now.volts, fresh.Update(Estimate(frame, marker)).volts) << NameOf(controller);
      EXPECT_EQ(autopilot.demand(), fresh.demand()) << NameOf(controller);
    }
    EXPECT_GT(autopilot.demand().norm(), 0.01) << NameOf(controller);
  }
}

TEST(Autopilot, ANewLawThatHasSeenNothingDrifts) {
  for (const ControllerType controller :
       {ControllerType::kPVoltage, ControllerType::kPid, ControllerType::kLqg}) {
    Autopilot autopilot(Params(controller), {.found_hold_s = 0}, PublishedVehicle(), kClock);
    autopilot.Update(Estimate(0, {0.9, 0.05, 0, 0}));
    ASSERT_EQ(autopilot.directive().stage, Stage::kVisualServoing);
    autopilot.SetControl(Params(controller));
    const ThrusterCommand command = autopilot.Update(Estimate(1, {0.9, 0.05, 0, 0}, -0.2));
    EXPECT_EQ(autopilot.directive().stage, Stage::kVisualServoing);
    EXPECT_EQ(autopilot.demand(), Axes(Axes::Zero())) << NameOf(controller);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(command.volts[i], 2.5, 1e-12) << NameOf(controller);
  }
}

TEST(Autopilot, KeepsItsLawWhenTheOtherIsRefused) {
  Autopilot autopilot(Params(ControllerType::kPVoltage), {.found_hold_s = 0}, PublishedVehicle(),
                      kClock);
  ControlParams wrong = Params(ControllerType::kPid);
  wrong.pid.sway.kp_per_s2 = -1;
  EXPECT_THROW(autopilot.SetControl(wrong), ConfigError);
  const ThrusterCommand command = autopilot.Update(Estimate(0, {0.62, 0.01, 0, 0}));
  EXPECT_NEAR(command.volts[2], 2.5 + 30 * 0.01, 1e-12);
}

// Of an axis that the estimate is unsure of, a step hardly enters the demand. Covariances are of
// position, then of the rotation vector, whose third element is nearly the heading.
TEST(Autopilot, ItsFilterBelievesEachAxisNoMoreThanTheEstimateClaims) {
  constexpr std::array<Eigen::Index, kAxisCount> kOfCovariance = {0, 1, 2, 5};
  const auto demand_after_a_step = [&](int axis, double variance) {
    ControlParams params = Params(ControllerType::kPVoltage);
    params.p_voltage.pose_filter.enabled = true;
    Autopilot autopilot(params, {.found_hold_s = 0, .enter_hold_s = 600}, PublishedVehicle(),
                        kClock);
    Axes marker(0.6, 0, 0, 0);
    for (int n = 0; n < 60; ++n) autopilot.Update(Estimate(n, marker));
    marker[axis] += axis == kYaw ? 0.02 : 0.004;
    PoseEstimate stepped = Estimate(60, marker);
    stepped.covariance = 1e-9 * PoseCovariance::Identity();
    const Eigen::Index at = kOfCovariance[static_cast<size_t>(axis)];
    (*stepped.covariance)(at, at) = variance;
    autopilot.Update(stepped);
    return std::abs(autopilot.demand()[axis]);
  };
  for (int axis = 0; axis < kAxisCount; ++axis) {
    const double sure = demand_after_a_step(axis, 1e-9);
    EXPECT_GT(sure, 1e-3) << axis;
    EXPECT_LT(demand_after_a_step(axis, 1), 0.01 * sure) << axis;
  }
}

}  // namespace
}  // namespace turbidock::control
