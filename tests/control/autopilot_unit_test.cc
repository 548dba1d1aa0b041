// The autopilot as a whole: what each controller makes of a docking, and no jumps between its
// stages.

#include "control/autopilot.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <string>

#include "control/lqg.h"
#include "control/p_voltage.h"
#include "control/pid.h"
#include "tests/control/published_vehicle.h"

namespace turbidock::control {
namespace {

constexpr ClockParams kClock;  // 30 frames a second

ControlParams OfPVoltage(const PVoltageParams& params = {}) { return {SpecOf<PVoltage>(params)}; }
ControlParams OfPid(PidParams params = {}) {
  params.setpoint.enabled = true;
  return {SpecOf<Pid>(params)};
}
ControlParams OfLqg(int latency_frames = 1) {
  LqgParams params;
  params.latency_frames = latency_frames;
  params.setpoint.enabled = true;
  return {SpecOf<Lqg>(params)};
}
using Controllers = std::map<std::string, ControlParams>;
Controllers All() { return {{"p_voltage", OfPVoltage()}, {"pid", OfPid()}, {"lqg", OfLqg()}}; }

PoseEstimate Estimate(int64_t frame, const Axes& marker, double fitness = 0.8) {
  PoseEstimate estimate;
  estimate.frame = frame;
  estimate.X_HM = {FromYawPitchRoll(marker[kYaw], 0, 0), marker.head<3>()};
  estimate.fitness = fitness;
  return estimate;
}

TEST(ControllerSpec, SaysWhatTheClassHas) {
  PVoltageParams params;
  params.pose_filter.enabled = true;
  const ControllerSpec published = SpecOf<PVoltage>(params);
  EXPECT_FALSE(published.setpoint.enabled);
  EXPECT_TRUE(published.pose_filter.enabled);
  EXPECT_FALSE(published.predicts);
  EXPECT_TRUE(published.asks_for_volts());
  EXPECT_EQ(MakeAllocation(published, PublishedVehicle())->authority()[kSway], 2.5);  // volts
  const ControllerSpec pid = OfPid().controller;
  EXPECT_TRUE(pid.setpoint.enabled);
  EXPECT_FALSE(pid.pose_filter.enabled);
  EXPECT_FALSE(pid.predicts);
  EXPECT_FALSE(pid.asks_for_volts());
  EXPECT_EQ(MakeAllocation(pid, PublishedVehicle())->authority()[kSway], 4.655);  // newtons
  const ControllerSpec lqg = SpecOf<Lqg>();
  EXPECT_FALSE(lqg.pose_filter.enabled);
  EXPECT_TRUE(lqg.predicts);
  EXPECT_EQ(MakeAllocation(lqg, PublishedVehicle())->authority()[kSway], 4.655);
}

class PrivatePredict : public Controller {
 public:
  struct Params {};
  explicit PrivatePredict(const Params&) {}
  void Observe(const Observation&) override {}
  Axes Demand(const Reference&) override { return Axes::Zero(); }
  void OnCommandApplied(int64_t, const Axes&) override {}

 private:
  std::optional<Axes> Predict(int64_t) override { return std::nullopt; }
};
class InheritedPredict final : public PrivatePredict {
  using PrivatePredict::PrivatePredict;
};

TEST(ControllerSpec, SeesAPredictThatIsPrivateOrInherited) {
  EXPECT_TRUE(SpecOf<PrivatePredict>().predicts);
  EXPECT_TRUE(SpecOf<InheritedPredict>().predicts);
}

TEST(Autopilot, ThePublishedLawIsThePublishedCommand) {
  Autopilot autopilot(OfPVoltage(), {.found_hold_s = 0}, PublishedVehicle(), kClock);
  const ThrusterCommand command = autopilot.Update(Estimate(0, {0.62, 0.01, -0.02, 0.02}));
  const double yaw_v = 2 * std::sin(0.01);
  EXPECT_NEAR(command.volts[0], 2.5 + 20 * 0.02 - yaw_v, 1e-12);
  EXPECT_NEAR(command.volts[1], 2.5 + 20 * 0.02 + yaw_v, 1e-12);
  EXPECT_NEAR(command.volts[2], 2.5 + 30 * 0.01, 1e-12);
  EXPECT_NEAR(command.volts[3], 2.5 - 30 * 0.02, 1e-12);
}

TEST(Autopilot, DriftsWithoutAUsableEstimateAndForgetsNothingDangerous) {
  for (const auto& [name, params] : All()) {
    Autopilot autopilot(params, {.found_hold_s = 0}, PublishedVehicle(), kClock);
    autopilot.Update(Estimate(0, {0.7, 0, 0, 0}));
    EXPECT_EQ(autopilot.Update(Estimate(1, {5, 3, 2, 1}, 0.1)).volts,
              ThrusterCommand::Neutral(4).volts);
    EXPECT_EQ(autopilot.demand(), Axes(Axes::Zero()));
  }
}

TEST(Autopilot, TheSearchTurnsByItsShareOfWhatThereIs) {
  const ProcedureParams procedure{.search_neutral_s = 0, .search_yaw_v = 0.5};
  Autopilot published(OfPVoltage(), procedure, PublishedVehicle(), kClock);
  const ThrusterCommand volts = published.Update(Estimate(0, {1, 0, 0, 0}, -0.2));
  EXPECT_DOUBLE_EQ(volts.volts[0], 2.0);
  EXPECT_DOUBLE_EQ(volts.volts[1], 3.0);
  // a fifth of the most moment
  Autopilot lqg(OfLqg(), procedure, PublishedVehicle(), kClock);
  const ThrusterCommand command = lqg.Update(Estimate(0, {1, 0, 0, 0}, -0.2));
  const ThrustCurve curve;
  EXPECT_NEAR(curve.Thrust(command.volts[1]), 0.2 * 4.41, 1e-12);
  EXPECT_NEAR(curve.Thrust(command.volts[0]), -0.2 * 4.41, 1e-12);
}

// The vehicle's speed follows the voltages. Found half a metre off, led to the servoing pose,
// docked: no change of stage shows in the demand.
TEST(Autopilot, StagesChangeWithoutAJumpOfTheDemand) {
  for (const auto& [name, params] :
       Controllers{{"pid", OfPid()}, {"lqg", OfLqg(/*latency_frames=*/0)}}) {
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
    EXPECT_GE(transitions, 2) << name;  // servoing, docking
    EXPECT_LT(at_transition, 0.04) << name;
    EXPECT_LT(marker[kSurge], 0.37) << name;
  }
}

TEST(Autopilot, AnExcitationIsHiddenFromTheLaw) {
  Autopilot one(OfLqg(), {.found_hold_s = 0}, PublishedVehicle(), kClock);
  Autopilot other(OfLqg(), {.found_hold_s = 0}, PublishedVehicle(), kClock);
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

// It commands each thruster.
class Own final : public Controller {
 public:
  explicit Own(Axes* given) : given_(given) {}
  void Observe(const Observation&) override {}
  Axes Demand(const Reference&) override { return {1, 2, 3, 4}; }
  const ThrusterCommand* Command() const override { return &command_; }
  void OnCommandApplied(int64_t, const Axes& given) override { *given_ = given; }

 private:
  ThrusterCommand command_{{1, 2, 3, 4}};
  Axes* given_;
};

TEST(Autopilot, AControllerMayCommandEachThruster) {
  Axes given;
  const auto make = [&](const VehicleModel&, const ClockParams&) {
    return std::make_unique<Own>(&given);
  };
  Autopilot autopilot({{.make = make}}, {.found_hold_s = 0}, PublishedVehicle(), kClock);
  const ThrusterCommand command = autopilot.Update(Estimate(0, {0.6, 0, 0, 0}));
  EXPECT_EQ(command.volts, (PerThruster{1, 2, 3, 4}));
  EXPECT_EQ(given, Axes(1, 2, 3, 4));
  EXPECT_EQ(autopilot.Update(Estimate(1, {0.6, 0, 0, 0}, 0.1)).volts,
            ThrusterCommand::Neutral(4).volts);
  EXPECT_EQ(given, Axes(Axes::Zero()));
  EXPECT_THROW(autopilot.Update(Estimate(2, {0.6, 0, 0, 0}),
                                {.wanted = Axes::Zero(), .share = {0, 0, 0.12, 0}}),
               ConfigError);
}

TEST(Autopilot, OtherGainsTakeOverAndTheProcedureGoesOn) {
  Autopilot autopilot(OfPVoltage(), {.found_hold_s = 0}, PublishedVehicle(), kClock);
  const Axes marker(0.62, 0.01, -0.02, 0);
  autopilot.Update(Estimate(0, marker));
  autopilot.Update(Estimate(1, marker));
  const Stage stage = autopilot.directive().stage;
  EXPECT_EQ(stage, Stage::kVisualServoing);

  PVoltageParams gains;
  gains.sway.kp_v_per_m = 60;
  autopilot.SetControl(OfPVoltage(gains));
  const ThrusterCommand command = autopilot.Update(Estimate(2, marker));
  EXPECT_NEAR(command.volts[2], 2.5 + 60 * 0.01, 1e-12);
  EXPECT_EQ(autopilot.directive().stage, stage);
  EXPECT_FALSE(autopilot.directive().transition);

  for (const auto& [name, params] : Controllers{{"pid", OfPid()}, {"lqg", OfLqg()}}) {
    autopilot.SetControl(params);
    Autopilot fresh(params, {.found_hold_s = 0}, PublishedVehicle(), kClock);
    // some frames: a led setpoint begins where the vehicle is
    const int64_t first = name == "pid" ? 20 : 3;
    for (int64_t frame = first; frame < first + 10; ++frame) {
      const ThrusterCommand now = autopilot.Update(Estimate(frame, marker));
      EXPECT_EQ(now.volts, fresh.Update(Estimate(frame, marker)).volts) << name;
      EXPECT_EQ(autopilot.demand(), fresh.demand()) << name;
    }
    EXPECT_GT(autopilot.demand().norm(), 0.01) << name;
  }
}

TEST(Autopilot, ANewLawThatHasSeenNothingDrifts) {
  for (const auto& [name, params] : All()) {
    Autopilot autopilot(params, {.found_hold_s = 0}, PublishedVehicle(), kClock);
    autopilot.Update(Estimate(0, {0.9, 0.05, 0, 0}));
    ASSERT_EQ(autopilot.directive().stage, Stage::kVisualServoing);
    autopilot.SetControl(params);
    const ThrusterCommand command = autopilot.Update(Estimate(1, {0.9, 0.05, 0, 0}, -0.2));
    EXPECT_EQ(autopilot.directive().stage, Stage::kVisualServoing);
    EXPECT_EQ(autopilot.demand(), Axes(Axes::Zero())) << name;
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(command.volts[i], 2.5, 1e-12) << name;
  }
}

TEST(Autopilot, KeepsItsLawWhenTheOtherIsRefused) {
  Autopilot autopilot(OfPVoltage(), {.found_hold_s = 0}, PublishedVehicle(), kClock);
  PidParams wrong;
  wrong.sway.kp_per_s2 = -1;
  EXPECT_THROW(autopilot.SetControl(OfPid(wrong)), ConfigError);
  const ThrusterCommand command = autopilot.Update(Estimate(0, {0.62, 0.01, 0, 0}));
  EXPECT_NEAR(command.volts[2], 2.5 + 30 * 0.01, 1e-12);
}

// Of an axis that the estimate is unsure of, a step hardly enters the demand. Covariances are of
// position, then of the rotation vector, whose third element is nearly the heading.
TEST(Autopilot, ItsFilterBelievesEachAxisNoMoreThanTheEstimateClaims) {
  constexpr std::array<Eigen::Index, kAxisCount> kOfCovariance = {0, 1, 2, 5};
  const auto demand_after_a_step = [&](int axis, double variance) {
    PVoltageParams params;
    params.pose_filter.enabled = true;
    Autopilot autopilot(OfPVoltage(params), {.found_hold_s = 0, .enter_hold_s = 600},
                        PublishedVehicle(), kClock);
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
