// Every edge of the docking procedure with scripted estimates; holds are counted to the frame.

#include "control/docking_procedure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "tests/control/procedure_script.h"

namespace turbidock::control {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(ProcedureParams, DefaultsAreValid) {
  EXPECT_NO_THROW(CheckFields(ProcedureParams{}, "procedure"));
}

TEST(ProcedureParams, ValuesMustFitEachOther) {
  auto message = [](auto change) -> std::string {
    ProcedureParams params;
    change(params);
    try {
      CheckFields(params, "procedure");
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message([](auto& p) { p.servo_x_m = 0.35; }),
            "procedure.servo_x_m: 0.35 must be beyond docking_x_m (0.35)");
  EXPECT_EQ(message([](auto& p) { p.docked_x_m = 0.3; }),
            "procedure.docking_x_m: 0.35 must be at most docked_x_m (0.3), or it never docks");
  EXPECT_EQ(message([](auto& p) { p.enter_y_m = 0.05; }),
            "procedure.enter_y_m: 0.05 must be at most allowance_y_m (0.04)");
  EXPECT_EQ(message([](auto& p) { p.enter_z_m = 0.05; }),
            "procedure.enter_z_m: 0.05 must be at most allowance_z_m (0.04)");
  EXPECT_EQ(message([](auto& p) { p.allowance_yaw_rad = 0.1; }),
            "procedure.enter_yaw_rad: 0.12217304763960307 must be at most allowance_yaw_rad (0.1)");
  EXPECT_EQ(message([](auto& p) { p.lost_fitness = 0.7; }),
            "procedure.lost_fitness: 0.7 must be at most found_fitness (0.6)");
  EXPECT_EQ(message([](auto& p) { p.lost_after_s = 6; }),
            "procedure.lost_after_s: 6 must be at most return_to_approach_s (5)");
  EXPECT_EQ(message([](auto& p) { p.give_up_s = 4; }),
            "procedure.return_to_approach_s: 5 must be at most give_up_s (4)");
  EXPECT_EQ(message([](auto& p) { p.docked_hold_frames = 0; }),
            "procedure.docked_hold_frames: 0 must be in [1, 1000]");
}

// --- approach

TEST(DockingProcedure, BeginsInApproachWithoutControl) {
  Script script;
  const Directive& directive = script.Pose(1.2);
  EXPECT_EQ(directive.stage, Stage::kApproach);
  ExpectDrift(directive);
  EXPECT_FALSE(directive.transition.has_value());
}

TEST(DockingProcedure, FoundAfterFifteenSuccessiveFrames) {
  Script script({}, 1000);
  for (int n = 1; n < 15; ++n) EXPECT_EQ(script.Fitness(0.60).stage, Stage::kApproach) << n;
  script.Pose(1.12, 0, 0, 0, 0.60);
  ExpectTransition(script, Stage::kApproach, Stage::kVisualServoing);
  EXPECT_THAT(script.directive().transition->reason,
              AllOf(HasSubstr("marker found"), HasSubstr("F >= 0.60"), HasSubstr("15"),
                    HasSubstr("1120 mm")));
  EXPECT_TRUE(script.directive().control);
  EXPECT_EQ(script.directive().desired, (AxesPose{.x_m = 0.6}));
  script.Pose(1.12);
  EXPECT_FALSE(script.directive().transition.has_value());  // once only
}

TEST(DockingProcedure, OnePoorFrameStartsTheFoundHoldAgain) {
  Script script;
  for (int n = 0; n < 14; ++n) script.Fitness(0.9);
  script.Fitness(0.599);
  for (int n = 0; n < 14; ++n) EXPECT_EQ(script.Fitness(0.9).stage, Stage::kApproach) << n;
  EXPECT_EQ(script.Fitness(0.9).stage, Stage::kVisualServoing);
}

TEST(DockingProcedure, SearchWaitsAtNeutralThenYawsBothWays) {
  Script script;  // 5 s neutral, 0.5 V, period 24 s
  for (int n = 0; n < 150; ++n) ExpectDrift(script.Fitness(0.1));
  double sum = 0;
  for (int n = 0; n < 720; ++n) {
    const Directive& directive = script.Fitness(0.1);
    ASSERT_FALSE(directive.control);
    EXPECT_NEAR(directive.open_loop.yaw_v, 0.5 * std::cos(2 * std::numbers::pi * n / 720), 1e-12);
    EXPECT_EQ(directive.open_loop.surge_v, 0);
    EXPECT_EQ(directive.open_loop.sway_v, 0);
    EXPECT_EQ(directive.open_loop.heave_v, 0);
    sum += directive.open_loop.yaw_v;
  }
  EXPECT_NEAR(sum, 0, 1e-9);
}

TEST(DockingProcedure, SearchPausesWhileTheMarkerMayBeFound) {
  Script script;
  for (int n = 0; n < 200; ++n) script.Fitness(0.4);  // recognisable is not found: search on
  EXPECT_NE(script.directive().open_loop.yaw_v, 0);
  ExpectDrift(script.Fitness(0.6));
  EXPECT_NE(script.Fitness(0.4).open_loop.yaw_v, 0);
}

TEST(DockingProcedure, NeverFoundIsNeverGivenUp) {
  Script script;
  script.LostFor(30 * 60);
  EXPECT_FALSE(script.directive().given_up);
  EXPECT_EQ(script.directive().stage, Stage::kApproach);
  EXPECT_EQ(script.directive().frames_lost, 30 * 60);
}

// --- visual servoing

TEST(DockingProcedure, StableForFiveFramesBeginsDocking) {
  Script script;
  script.ToServoing();
  for (int n = 1; n < 5; ++n)
    EXPECT_EQ(script.Pose(0.649, -0.0199, 0.0199, -0.12).stage, Stage::kVisualServoing) << n;
  script.Pose(0.551, 0.0199, -0.0199, 0.12);
  ExpectTransition(script, Stage::kVisualServoing, Stage::kDocking);
  EXPECT_THAT(script.directive().transition->reason,
              AllOf(HasSubstr("5 successive"), HasSubstr("x -49.0 mm"), HasSubstr("y +19.9 mm"),
                    HasSubstr("z -19.9 mm"), HasSubstr("yaw +6.9°"), HasSubstr("7.0°")));
  EXPECT_EQ(script.directive().desired.x_m, 0.6);  // lowered from the next frame on
}

TEST(DockingProcedure, AnyErrorAtItsLimitKeepsServoing) {
  struct {
    double x_m, y_m, z_m, yaw_rad;
  } const outside[] = {{0.6501, 0, 0, 0},    {0.5499, 0, 0, 0},   {0.6, 0.0201, 0, 0},
                       {0.6, -0.0201, 0, 0}, {0.6, 0, 0.0201, 0}, {0.6, 0, -0.0201, 0},
                       {0.6, 0, 0, 0.1223},  {0.6, 0, 0, -0.1223}};
  for (const auto& e : outside) {
    Script script;
    script.ToServoing();
    script.Repeat(4, 0.6);
    script.Pose(e.x_m, e.y_m, e.z_m, e.yaw_rad);  // breaks the hold in its last frame
    EXPECT_EQ(script.directive().stage, Stage::kVisualServoing);
    script.Repeat(4, 0.6);
    EXPECT_EQ(script.directive().stage, Stage::kVisualServoing);
    EXPECT_EQ(script.Pose(0.6).stage, Stage::kDocking);
  }
}

TEST(DockingProcedure, ErrorsAreAgainstTheDesiredPose) {
  ProcedureParams params;
  params.servo_y_m = 0.1;
  params.servo_z_m = -0.067;
  params.servo_yaw_rad = 0.3;
  Script script(params);
  script.ToServoing();
  EXPECT_EQ(script.directive().desired,
            (AxesPose{.x_m = 0.6, .y_m = 0.1, .z_m = -0.067, .yaw_rad = 0.3}));
  script.Repeat(10, 0.6);
  EXPECT_EQ(script.directive().stage, Stage::kVisualServoing);
  for (int n = 0; n < 5; ++n) script.Pose(0.6, 0.1, -0.067, 0.3);
  EXPECT_EQ(script.directive().stage, Stage::kDocking);
}

TEST(DockingProcedure, ALostFrameDriftsAtOnceAndStartsTheHoldAgain) {
  Script script;
  script.ToServoing();
  script.Repeat(4, 0.6);
  EXPECT_TRUE(script.directive().control);
  EXPECT_TRUE(script.directive().marker_seen);
  ExpectDrift(script.Fitness(0.2199));
  EXPECT_FALSE(script.directive().marker_seen);
  EXPECT_EQ(script.directive().frames_lost, 1);
  EXPECT_TRUE(script.Fitness(0.22).control);  // usable again
  EXPECT_EQ(script.directive().frames_lost, 0);
  script.Repeat(3, 0.6);
  EXPECT_EQ(script.directive().stage, Stage::kVisualServoing);
  EXPECT_EQ(script.Pose(0.6).stage, Stage::kDocking);
}

TEST(DockingProcedure, BackToApproachAfterFiveSecondsOfLoss) {
  Script script;
  script.ToServoing();
  script.LostFor(149);
  EXPECT_EQ(script.directive().stage, Stage::kVisualServoing);
  ExpectDrift(script.directive());
  script.Fitness(-0.2);
  ExpectTransition(script, Stage::kVisualServoing, Stage::kApproach);
  EXPECT_THAT(script.directive().transition->reason,
              AllOf(HasSubstr("marker lost"), HasSubstr("F < 0.22"), HasSubstr("150 frames"),
                    HasSubstr("5.00 s"), HasSubstr("-0.200")));
  // the search begins anew with its wait at neutral
  for (int n = 1; n < 150; ++n) ExpectDrift(script.Lost());
  EXPECT_EQ(script.Lost().open_loop.yaw_v, 0.5);
}

TEST(DockingProcedure, LossIsCountedFromTheLastUsableFrame) {
  Script script;
  script.ToServoing();
  script.LostFor(149);
  script.Pose(1.0);
  script.LostFor(149);
  EXPECT_EQ(script.directive().stage, Stage::kVisualServoing);
  EXPECT_EQ(script.Lost().stage, Stage::kApproach);
}

TEST(DockingProcedure, SkippedFramesPassTime) {
  Script script;
  script.ToServoing();
  script.SkipFrames(148);
  script.Lost();  // the 149th frame since the marker was seen
  EXPECT_EQ(script.directive().frames_lost, 149);
  EXPECT_EQ(script.directive().stage, Stage::kVisualServoing);
  EXPECT_EQ(script.Lost().stage, Stage::kApproach);
}

TEST(DockingProcedure, ReturnsFromApproachWhenFoundAgain) {
  Script script;
  script.ToServoing();
  script.LostFor(150);
  ASSERT_EQ(script.directive().stage, Stage::kApproach);
  script.Repeat(14, 1.0);
  EXPECT_EQ(script.directive().stage, Stage::kApproach);
  script.Pose(1.0);
  ExpectTransition(script, Stage::kApproach, Stage::kVisualServoing);
}

TEST(DockingProcedure, GivenUpAfterFifteenSecondsOfLossForGood) {
  Script script;
  script.ToServoing();
  script.LostFor(449);
  EXPECT_FALSE(script.directive().given_up);
  EXPECT_TRUE(script.directive().given_up_reason.empty());
  script.Lost();
  EXPECT_TRUE(script.directive().given_up);
  EXPECT_THAT(script.directive().given_up_reason,
              AllOf(HasSubstr("450 frames"), HasSubstr("15.00 s")));
  for (int n = 0; n < 100; ++n) script.Fitness(0.9);
  EXPECT_TRUE(script.directive().given_up);
  ExpectDrift(script.directive());
  EXPECT_EQ(script.directive().stage, Stage::kApproach);
}

// --- all stages

TEST(DockingProcedure, KeepsTheBestFitness) {
  Script script;
  EXPECT_EQ(script.Fitness(-0.2).best_fitness, -0.2);
  EXPECT_EQ(script.Fitness(0.7).best_fitness, 0.7);
  EXPECT_EQ(script.Fitness(0.3).best_fitness, 0.7);
}

TEST(DockingProcedure, HoldsOfZeroNeedOneFrame) {
  ProcedureParams params;
  params.found_hold_s = params.enter_hold_s = params.lost_after_s = 0;
  Script script(params);
  EXPECT_EQ(script.Pose(0.6).stage, Stage::kVisualServoing);
  EXPECT_EQ(script.Pose(0.6).stage, Stage::kDocking);
  EXPECT_EQ(script.Lost().stage, Stage::kVisualServoing);
}

TEST(DockingProcedureDeathTest, RefusesNanAndFramesThatGoBack) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  DockingProcedure procedure({}, kClock);
  PoseEstimate estimate;
  estimate.fitness = nan;
  EXPECT_DEATH(procedure.Update(estimate), "estimate must be finite");
  estimate.fitness = 0.1;  // not even where it would not be used
  estimate.X_HM.p.y() = nan;
  EXPECT_DEATH(procedure.Update(estimate), "estimate must be finite");
  estimate.X_HM.p.y() = 0;
  procedure.Update(estimate);
  EXPECT_DEATH(procedure.Update(estimate), "frames must increase");
}

// In the approach a filter learns from what is found only, afterwards from all that is seen.
TEST(DockingProcedure, AnEstimateIsTrustedWhenItIsFoundAndLaterWhenItIsSeen) {
  const ProcedureParams params;
  const double between = (params.lost_fitness + params.found_fitness) / 2;
  Script script;
  EXPECT_FALSE(script.Fitness(between).trusted);
  EXPECT_TRUE(script.Fitness(params.found_fitness).trusted);
  EXPECT_FALSE(script.Fitness(params.lost_fitness - 0.01).trusted);
  script.ToServoing();
  EXPECT_TRUE(script.Fitness(between).trusted);
  EXPECT_FALSE(script.Fitness(params.lost_fitness - 0.01).trusted);
}

PoseEstimate Judged(int64_t frame, bool detected) {
  PoseEstimate estimate;
  estimate.frame = frame;
  estimate.X_HM = {Eigen::Quaterniond::Identity(), {0.9, 0, 0}};
  estimate.fitness = 0.63;
  estimate.ball_support = {1, 1, detected ? 1.0 : 0.0};
  estimate.detected = detected;
  return estimate;
}

// Two balls of three have a reliable F, and the marker may be turned about their line.
TEST(DockingProcedure, FindsOnlyWhatTheEstimatorBearsOut) {
  DockingProcedure procedure({}, kClock);
  int64_t frame = 0;
  for (; frame < 60; ++frame)
    EXPECT_EQ(procedure.Update(Judged(frame, false)).stage, Stage::kApproach) << frame;
  PoseEstimate two = Judged(frame++, true);
  two.second = SecondPose{two.X_HM, 0.5};
  EXPECT_EQ(procedure.Update(two).stage, Stage::kApproach);
  EXPECT_EQ(procedure.Update(Judged(frame, true)).stage, Stage::kVisualServoing);
}

TEST(DockingProcedure, WaitsWhileThereAreTwoAnswers) {
  const ProcedureParams params{.blind_max_s = 0.1};
  DockingProcedure procedure(params, kClock);
  int64_t frame = 0;
  while (frame < 15) procedure.Update(Judged(frame++, true));
  const auto with_two = [&] {
    PoseEstimate estimate = Judged(frame++, true);
    estimate.second = SecondPose{estimate.X_HM, 0.1};
    return estimate;
  };
  EXPECT_TRUE(procedure.Update(Judged(frame++, true)).control);
  ExpectDrift(procedure.Update(with_two()));
  EXPECT_FALSE(procedure.WouldGoBlind(with_two())) << "servoing";
  for (; frame < 16 + 149;)
    EXPECT_EQ(procedure.Update(with_two()).stage, Stage::kVisualServoing) << frame;
  while (procedure.Update(with_two()).stage == Stage::kVisualServoing) ASSERT_LT(frame, 200);
  EXPECT_THAT(procedure.Update(Judged(frame, true)).stage, Stage::kApproach);
}

}  // namespace
}  // namespace turbidock::control
