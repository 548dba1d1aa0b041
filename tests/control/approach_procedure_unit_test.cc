// The procedure with a navigation to steer by, and with a prediction to go on by: scripted.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "control/autopilot.h"
#include "control/docking_procedure.h"
#include "control/lqg.h"
#include "control/p_voltage.h"
#include "tests/control/published_vehicle.h"

namespace turbidock::control {
namespace {

using ::testing::HasSubstr;

constexpr ClockParams kClock;  // 30 frames a second

ApproachParams Navigation() {
  ApproachParams params;
  params.mode = ApproachMode::kNavigation;
  return params;
}

// Feeds a procedure one frame after the other.
class Script {
 public:
  explicit Script(const ProcedureParams& procedure, const ApproachParams& approach)
      : procedure_(procedure, kClock, approach) {}

  // The marker seen at x with this fitness, the camera head there by navigation.
  const Directive& Frame(double x_m, double fitness, const std::optional<AxesPose>& navigated_MH,
                         const std::optional<AxesPose>& predicted_HM = std::nullopt) {
    PoseEstimate estimate;
    estimate.frame = frame_++;
    estimate.X_HM.p.x() = x_m;
    estimate.fitness = fitness;
    would_go_blind_ = procedure_.WouldGoBlind(estimate);
    return directive_ = procedure_.Update(
               estimate, {.navigated_MH = navigated_MH, .predicted_HM = predicted_HM});
  }
  void Frames(int n, double x_m, double fitness, const std::optional<AxesPose>& navigated_MH,
              const std::optional<AxesPose>& predicted_HM = std::nullopt) {
    for (int i = 0; i < n; ++i) Frame(x_m, fitness, navigated_MH, predicted_HM);
  }
  void ToDocking() {
    Frames(15, 1, 0.8, std::nullopt);
    Frames(5, 0.6, 0.8, std::nullopt);
    ASSERT_EQ(directive_.stage, Stage::kDocking);
  }
  const Directive& directive() const { return directive_; }
  bool would_go_blind() const { return would_go_blind_; }

 private:
  DockingProcedure procedure_;
  Directive directive_;
  int64_t frame_ = 0;
  bool would_go_blind_ = false;
};

constexpr AxesPose kFar{-4.5, 0.3, 0, 0}, kStaging{-1.8, 0, 0, 0}, kNear{-1.1, 0, 0, 0};

TEST(ApproachByNavigation, SteersFromTheFirstFrameOn) {
  Script script({}, Navigation());
  const Directive& d = script.Frame(1, -0.2, kFar);
  EXPECT_EQ(d.stage, Stage::kApproach);
  EXPECT_TRUE(d.control);
  EXPECT_EQ(d.guide, Guide::kNavigation);
  EXPECT_NEAR(d.desired.x_m, 1.8, 1e-12);
  EXPECT_NEAR(d.desired.y_m, 0, 1e-12);
}

TEST(ApproachByNavigation, WithoutAFixItSearchesAsWithoutNavigation) {
  Script script({}, Navigation()), without({}, {});
  for (int i = 0; i < 600; ++i) {
    const Directive& d = script.Frame(1, -0.2, std::nullopt);
    const Directive& alone = without.Frame(1, -0.2, kFar);
    ASSERT_FALSE(d.control);
    ASSERT_FALSE(alone.control);
    ASSERT_EQ(d.open_loop, alone.open_loop);
  }
  EXPECT_NE(script.directive().open_loop, AxisVolts{});
}

TEST(ApproachByNavigation, TheStageIsSearchWhereTheMarkerShouldHaveBeenFound) {
  Script script({}, Navigation());
  script.Frame(1, -0.2, kStaging);  // and the way along the axis begins
  int frames = 0;
  while (script.Frame(1, -0.2, kNear).stage == Stage::kApproach && ++frames < 1000) continue;
  // 0.7 m at 6 cm/s
  EXPECT_NEAR(frames / 30.0, 0.7 / 0.06, 0.2);
  EXPECT_EQ(script.directive().stage, Stage::kSearch);
  ASSERT_TRUE(script.directive().transition);
  EXPECT_EQ(script.directive().transition->from, Stage::kApproach);
  EXPECT_THAT(script.directive().transition->reason, HasSubstr("not found 1.1 m before"));
  EXPECT_TRUE(script.directive().control);
}

TEST(ApproachByNavigation, HandsOverWhenFoundForLongEnoughAndHoldsUntilThen) {
  Script script({}, Navigation());
  script.Frames(30, 1, -0.2, kFar);
  for (int n = 1; n < 15; ++n) {
    const Directive& d = script.Frame(1.3, 0.6, AxesPose{-1.3 + 0.01 * n, 0, 0, 0});
    EXPECT_EQ(d.stage, Stage::kApproach);
    EXPECT_EQ(d.guide, Guide::kNavigation);
    EXPECT_NEAR(d.desired.x_m, 1.29, 1e-12);  // where it was when the marker came up
  }
  const Directive& d = script.Frame(1.3, 0.6, kNear);
  EXPECT_EQ(d.stage, Stage::kVisualServoing);
  EXPECT_EQ(d.guide, Guide::kVision);
  EXPECT_EQ(d.desired, (AxesPose{.x_m = 0.6}));
}

TEST(ApproachByNavigation, OnePoorFrameStartsTheHoldAgain) {
  Script script({}, Navigation());
  script.Frames(14, 1.3, 0.7, kNear);
  script.Frame(1.3, 0.59, kNear);
  script.Frames(14, 1.3, 0.7, kNear);
  EXPECT_EQ(script.directive().stage, Stage::kApproach);
  EXPECT_EQ(script.Frame(1.3, 0.7, kNear).stage, Stage::kVisualServoing);
}

// Drifts for lost_after_s, holds, goes back, and is never given up.
TEST(ApproachByNavigation, ALossIsAnsweredByNavigation) {
  Script script({}, Navigation());
  script.Frames(15, 1.3, 0.8, kNear);
  ASSERT_EQ(script.directive().stage, Stage::kVisualServoing);
  for (int n = 1; n <= 5 * 30; ++n) {
    const Directive& d = script.Frame(1, 0, kNear);
    EXPECT_EQ(d.control, n >= 30 && n < 150) << n;
    if (d.control) {
      EXPECT_EQ(d.guide, Guide::kNavigation);
      EXPECT_EQ(d.desired, (AxesPose{.x_m = 0.6}));
    }
  }
  EXPECT_EQ(script.directive().stage, Stage::kApproach);
  EXPECT_NEAR(script.Frame(1, 0, kNear).desired.x_m, 1.8, 1e-12);  // backs off
  script.Frames(60 * 30, 1, 0, kFar);
  EXPECT_FALSE(script.directive().given_up);
  // but where navigation is silent, too, it is
  script.Frame(1, 0, std::nullopt);
  EXPECT_TRUE(script.directive().given_up);
}

TEST(BlindLeg, DriftsUnlessItShallGoOn) {
  Script script({}, {});
  script.ToDocking();
  const Directive& d = script.Frame(0.5, 0.1, std::nullopt, AxesPose{.x_m = 0.5});
  EXPECT_FALSE(script.would_go_blind());
  EXPECT_FALSE(d.control);
}

TEST(BlindLeg, GoesOnByThePredictionAndDocksByIt) {
  Script script({.blind_max_s = 10}, {});
  script.ToDocking();
  script.Frames(30, 0.57, 0.8, std::nullopt);
  for (int n = 1; n < 150; ++n) {
    const Directive& d = script.Frame(9, 0.1, std::nullopt, AxesPose{.x_m = 0.57 - 0.001 * n});
    ASSERT_EQ(d.stage, Stage::kDocking) << n;
    EXPECT_TRUE(script.would_go_blind());
    EXPECT_TRUE(d.control);
    EXPECT_EQ(d.guide, Guide::kPrediction);
    EXPECT_FALSE(d.trusted);
    // the ramp goes on, faster
    EXPECT_NEAR(d.desired.x_m, std::max(0.35, 0.6 - 0.03 - 0.08 * n / 30), 1e-9);
  }
  EXPECT_EQ(script.Frame(9, 0.1, std::nullopt, AxesPose{.x_m = 0.351, .y_m = 0.03}).stage,
            Stage::kDocking);
  const Directive& d = script.Frame(9, 0.1, std::nullopt, AxesPose{.x_m = 0.349, .y_m = 0.03});
  EXPECT_EQ(d.stage, Stage::kDocked);
  EXPECT_THAT(d.transition->reason, HasSubstr("1 successive prediction"));
}

TEST(BlindLeg, EndsWithItsAgeOrBeyondTheAllowance) {
  Script late({.blind_max_s = 2}, {});
  late.ToDocking();
  late.Frames(60, 9, 0.1, std::nullopt, AxesPose{.x_m = 0.5});
  EXPECT_EQ(late.directive().stage, Stage::kDocking);
  late.Frame(9, 0.1, std::nullopt, AxesPose{.x_m = 0.5});
  EXPECT_FALSE(late.would_go_blind());
  EXPECT_EQ(late.directive().stage, Stage::kVisualServoing);

  Script aside({.blind_max_s = 2}, {});
  aside.ToDocking();
  aside.Frame(9, 0.1, std::nullopt, AxesPose{.x_m = 0.5, .y_m = 0.041});
  EXPECT_EQ(aside.directive().stage, Stage::kVisualServoing);
  EXPECT_THAT(aside.directive().transition->reason, HasSubstr("exceeds the allowance"));
}

TEST(BlindLeg, OnlyWhileDockingAndAgainAfterASight) {
  Script script({.blind_max_s = 1}, {});
  script.Frames(15, 1, 0.8, std::nullopt);
  script.Frame(1, 0.1, std::nullopt, AxesPose{.x_m = 1});
  EXPECT_FALSE(script.would_go_blind());
  EXPECT_FALSE(script.directive().control);
  script.Frames(5, 0.6, 0.8, std::nullopt);
  for (int again = 0; again < 3; ++again) {
    script.Frames(29, 9, 0.1, std::nullopt, AxesPose{.x_m = 0.5});
    EXPECT_TRUE(script.directive().control);
    script.Frame(0.5, 0.8, std::nullopt);
  }
  EXPECT_EQ(script.directive().stage, Stage::kDocking);
}

// --- the autopilot

PoseEstimate Estimate(int64_t frame, const Axes& marker, double fitness) {
  PoseEstimate estimate;
  estimate.frame = frame;
  estimate.X_HM = {FromYawPitchRoll(marker[kYaw], 0, 0), marker.head<3>()};
  estimate.fitness = fitness;
  return estimate;
}

NavigationReading ReadingOf(const AxesPose& pose_MH) {
  return {.z_m = pose_MH.z_m,
          .heading_rad = pose_MH.yaw_rad,
          .fix_xy_m = Eigen::Vector2d(pose_MH.x_m, pose_MH.y_m),
          .z_std_m = 0.005,
          .heading_std_rad = 0.005,
          .fix_std_m = 0.005};
}

// A vehicle that turns and goes as it is pushed, told by an exact navigation: to the staging pose,
// whichever way it looks, under every controller.
TEST(AutopilotApproach, ReachesTheStagingPoseFromAnyHeading) {
  const std::map<std::string, ControllerSpec> controllers = {{"p_voltage", SpecOf<PVoltage>()},
                                                             {"lqg", SpecOf<Lqg>()}};
  for (const auto& [name, controller] : controllers)
    for (const double heading_rad : {-2.5, 0.0, 0.7}) {
      ApproachParams approach = Navigation();
      approach.advance_mps = 0.001;
      Autopilot autopilot({controller}, {}, PublishedVehicle(), kClock, approach);
      AxesPose head{-4, 0.5, 0.3, heading_rad};
      Axes speed = Axes::Zero();  // in the body
      const VehicleModel vehicle = PublishedVehicle();
      for (int frame = 0; frame < 90 * 30; ++frame) {
        autopilot.Update(Estimate(frame, {5, 3, 2, 1}, -0.2), {}, {}, ReadingOf(head));
        EXPECT_TRUE(autopilot.directive().control);
        const Axes force = autopilot.demand();
        speed +=
            (force - vehicle.linear_damping.cwiseProduct(speed)).cwiseQuotient(vehicle.inertia) /
            30;
        const double c = std::cos(head.yaw_rad), s = std::sin(head.yaw_rad);
        head.x_m += (c * speed[kSurge] - s * speed[kSway]) / 30;
        head.y_m += (s * speed[kSurge] + c * speed[kSway]) / 30;
        head.z_m += speed[kHeave] / 30;
        head.yaw_rad = WrapAngle(head.yaw_rad + speed[kYaw] / 30);
      }
      EXPECT_NEAR(head.x_m, -1.75, 0.07) << name << heading_rad;
      EXPECT_NEAR(head.y_m, 0, 0.03) << name << heading_rad;
      EXPECT_NEAR(head.z_m, 0, 0.03) << name << heading_rad;
      EXPECT_NEAR(head.yaw_rad, 0, 0.05) << name << heading_rad;
    }
}

// What was seen before the loss corrects where it believes to be afterwards.
TEST(AutopilotApproach, RemembersWhereTheMarkerWas) {
  Autopilot autopilot({SpecOf<Lqg>()}, {}, PublishedVehicle(), kClock, Navigation());
  const AxesPose truth{-1, 0, 0, 0}, believed{-1.4, 0.2, 0, 0.05};
  int64_t frame = 0;
  const auto off_m = [&] { return (*autopilot.navigated_MH() - truth).distance_m(); };
  autopilot.Update(Estimate(frame++, {1, 0, 0, 0}, -0.2), {}, {}, ReadingOf(believed));
  EXPECT_NEAR(off_m(), std::hypot(0.4, 0.2), 1e-12);
  for (int i = 0; i < 90; ++i)
    autopilot.Update(Estimate(frame++, {1, 0, 0, 0}, 0.8), {}, {}, ReadingOf(believed));
  EXPECT_LT(off_m(), 0.01);
  autopilot.Update(Estimate(frame++, {1, 0, 0, 0}, -0.2), {}, {}, ReadingOf(believed));
  EXPECT_LT(off_m(), 0.01);
}

TEST(AutopilotApproach, WithoutOneAReadingChangesNothing) {
  Autopilot with({SpecOf<Lqg>()}, {}, PublishedVehicle(), kClock);
  Autopilot without({SpecOf<Lqg>()}, {}, PublishedVehicle(), kClock);
  for (int frame = 0; frame < 300; ++frame) {
    const PoseEstimate estimate = Estimate(frame, {1, 0.02, 0, 0.01}, frame % 100 < 60 ? 0.8 : 0);
    EXPECT_EQ(with.Update(estimate, {}, {}, ReadingOf(kFar)).volts, without.Update(estimate).volts);
  }
  EXPECT_FALSE(with.navigated_MH());
}

}  // namespace
}  // namespace turbidock::control
