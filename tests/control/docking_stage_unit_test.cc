// The docking stage and what follows it, with scripted estimates: docked, stuck, tried again.

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

// --- docking

TEST(DockingProcedure, DesiredXIsLoweredAtTheRateAndStopsAtItsEnd) {
  Script script;
  script.ToDocking();
  for (int n = 1; n <= 300; ++n) {
    const Directive& directive = script.Pose(0.6);
    ASSERT_EQ(directive.stage, Stage::kDocking);
    EXPECT_TRUE(directive.control);
    EXPECT_NEAR(directive.desired.x_m, std::max(0.35, 0.6 - 0.03 * n / 30), 1e-12) << n;
    EXPECT_EQ(directive.desired.y_m, 0);
  }
  EXPECT_EQ(script.directive().desired.x_m, 0.35);
}

TEST(DockingProcedure, SkippedFramesLowerTheDesiredXToo) {
  Script script;
  script.ToDocking();
  script.SkipFrames(9);
  EXPECT_NEAR(script.Pose(0.6).desired.x_m, 0.6 - 0.03 * 10 / 30, 1e-12);
}

TEST(DockingProcedure, AShortLossFreezesTheDesiredXAndKeepsDocking) {
  Script script;
  script.ToDocking();
  script.Repeat(30, 0.6);
  EXPECT_NEAR(script.directive().desired.x_m, 0.57, 1e-12);
  for (int n = 1; n < 30; ++n) {
    ExpectDrift(script.Lost());
    EXPECT_EQ(script.directive().stage, Stage::kDocking);
  }
  script.Pose(0.6);
  EXPECT_TRUE(script.directive().control);
  EXPECT_NEAR(script.directive().desired.x_m, 0.6 - 0.03 * 31 / 30, 1e-12);
}

TEST(DockingProcedure, LossForOneSecondFallsBackToServoing) {
  Script script;
  script.ToDocking();
  script.LostFor(29);
  EXPECT_EQ(script.directive().stage, Stage::kDocking);
  script.Lost();
  ExpectTransition(script, Stage::kDocking, Stage::kVisualServoing);
  EXPECT_THAT(script.directive().transition->reason,
              AllOf(HasSubstr("marker lost"), HasSubstr("30 frames"), HasSubstr("1.00 s")));
  ExpectDrift(script.directive());
  EXPECT_EQ(script.directive().desired.x_m, 0.6);
  // the loss counts on: 5 s in all to approach, 15 s in all to give up
  script.LostFor(119);
  EXPECT_EQ(script.directive().stage, Stage::kVisualServoing);
  EXPECT_EQ(script.Lost().stage, Stage::kApproach);
  script.LostFor(299);
  EXPECT_FALSE(script.directive().given_up);
  EXPECT_TRUE(script.Lost().given_up);
}

TEST(DockingProcedure, AnErrorBeyondTheAllowanceFallsBackToServoing) {
  struct {
    double y_m, z_m, yaw_rad;
    const char* reason;
  } const outside[] = {{0.0401, 0, 0, "y +40.1 mm, allowed 40.0 mm"}, {-0.0401, 0, 0, "y -40.1 mm"},
                       {0, 0.0401, 0, "z +40.1 mm, allowed 40.0 mm"}, {0, -0.0401, 0, "z -40.1 mm"},
                       {0, 0, 0.263, "yaw +15.1°, allowed 15.0°"},    {0, 0, -0.263, "yaw -15.1°"}};
  for (const auto& e : outside) {
    Script script;
    script.ToDocking();
    script.Repeat(60, 0.55);
    script.Pose(0.34, e.y_m, e.z_m, e.yaw_rad);  // near enough, but not there
    ExpectTransition(script, Stage::kDocking, Stage::kVisualServoing);
    EXPECT_THAT(script.directive().transition->reason, HasSubstr(e.reason));
    EXPECT_TRUE(script.directive().control);
    EXPECT_EQ(script.directive().desired, (AxesPose{.x_m = 0.6}));
    // and again from the beginning
    script.Repeat(5, 0.6);
    EXPECT_EQ(script.directive().stage, Stage::kDocking);
    script.Pose(0.6);
    EXPECT_NEAR(script.directive().desired.x_m, 0.6 - 0.03 / 30, 1e-12);
  }
}

TEST(DockingProcedure, WithinTheAllowanceItGoesOn) {
  Script script;
  script.ToDocking();
  for (const double sign : {-1.0, 1.0})
    EXPECT_EQ(script.Pose(0.5, 0.0399 * sign, -0.0399 * sign, 0.26 * sign).stage, Stage::kDocking);
}

TEST(DockingProcedure, DockedWhenXIsReachedWithinTheBand) {
  Script script;
  script.ToDocking();
  EXPECT_EQ(script.Pose(0.3501).stage, Stage::kDocking);
  script.Pose(0.35, 0.0399, -0.0399);
  ExpectTransition(script, Stage::kDocking, Stage::kDocked);
  EXPECT_THAT(script.directive().transition->reason,
              AllOf(HasSubstr("x 350.0 mm"), HasSubstr("y +39.9 mm"), HasSubstr("z -39.9 mm"),
                    HasSubstr("40 mm")));
  EXPECT_TRUE(script.directive().control);
}

TEST(DockingProcedure, DockedNeedsItsOwnBandWhereTheAllowanceIsWider) {
  ProcedureParams params;
  params.allowance_y_m = params.allowance_z_m = 0.1;
  Script script(params);
  script.ToDocking();
  EXPECT_EQ(script.Pose(0.34, 0.041, 0).stage, Stage::kDocking);
  EXPECT_EQ(script.Pose(0.34, 0, -0.041).stage, Stage::kDocking);
  EXPECT_EQ(script.Pose(0.34, 0.039, -0.039).stage, Stage::kDocked);
}

TEST(DockingProcedure, DockedHoldCountsSuccessiveFrames) {
  ProcedureParams params;
  params.docked_hold_frames = 3;
  Script script(params);
  script.ToDocking();
  script.Repeat(2, 0.34);
  script.Pose(0.36);
  script.Repeat(2, 0.34);
  EXPECT_EQ(script.Lost().stage, Stage::kDocking);
  script.Repeat(2, 0.34);
  EXPECT_EQ(script.directive().stage, Stage::kDocking);
  EXPECT_EQ(script.Pose(0.34).stage, Stage::kDocked);
}

TEST(DockingProcedure, NearTheDockOutsideTheDockingStageIsNotDocked) {
  Script script;
  script.ToServoing();
  script.Repeat(30, 0.34);
  EXPECT_EQ(script.directive().stage, Stage::kVisualServoing);
}

TEST(DockingProcedure, DockedIsFinalAndHolds) {
  Script script;
  script.ToDocking();
  script.Repeat(29, 0.6);
  script.Pose(0.34);
  ASSERT_EQ(script.directive().stage, Stage::kDocked);
  const double held_x_m = script.directive().desired.x_m;
  EXPECT_NEAR(held_x_m, 0.57, 1e-12);
  script.Pose(0.9, 0.3);
  EXPECT_EQ(script.directive().stage, Stage::kDocked);
  EXPECT_TRUE(script.directive().control);
  EXPECT_EQ(script.directive().desired.x_m, held_x_m);
  script.LostFor(1000);
  EXPECT_EQ(script.directive().stage, Stage::kDocked);
  ExpectDrift(script.directive());
  EXPECT_FALSE(script.directive().given_up);
}

// --- trying again, docking cycles

TEST(DockingProcedure, BacksOffWhenItIsStuck) {
  ProcedureParams params;
  params.stuck_s = 2;
  Script script(params);
  script.ToDocking();
  // held at 0.5 m: the desired x is 30 mm ahead of it after 4.33 s, then 2 s of patience
  int frames = 0;
  while (script.Pose(0.5).stage == Stage::kDocking && ++frames < 1000) {
  }
  ExpectTransition(script, Stage::kDocking, Stage::kVisualServoing);
  EXPECT_NEAR(frames, (0.13 / 0.03 + 2) * 30, 3);
  EXPECT_THAT(script.directive().transition->reason, HasSubstr("stuck for 2 s at x 500.0 mm"));
  EXPECT_EQ(script.directive().desired.x_m, 0.6);
  script.Repeat(5, 0.6);
  EXPECT_EQ(script.directive().stage, Stage::kDocking);
  // slow is not stuck
  for (double x_m = 0.6; x_m > 0.36; x_m -= 0.005 / 30)
    ASSERT_EQ(script.Pose(x_m).stage, Stage::kDocking) << x_m;
}

TEST(DockingProcedure, NeverStuckUnlessItShallBe) {
  Script script;
  script.ToDocking();
  script.Repeat(5000, 0.5);
  EXPECT_EQ(script.directive().stage, Stage::kDocking);
}

TEST(DockingProcedure, GivesUpAfterItsAttempts) {
  ProcedureParams params;
  params.attempts = 2;
  Script script(params);
  script.ToDocking();
  script.Pose(0.5, 0.05);
  ExpectTransition(script, Stage::kDocking, Stage::kVisualServoing);
  EXPECT_FALSE(script.directive().given_up);
  script.Repeat(5, 0.6);
  script.Pose(0.5, -0.05);
  EXPECT_TRUE(script.directive().given_up);
  EXPECT_THAT(script.directive().given_up_reason,
              AllOf(HasSubstr("all 2 attempts to dock failed"), HasSubstr("y -50.0 mm")));
  ExpectDrift(script.Pose(0.6));
}

TEST(DockingProcedure, DocksAndUndocksAsOftenAsItShall) {
  ProcedureParams params;
  params.cycles = 2;
  params.stay_s = 1;
  params.attempts = 1;  // of each cycle
  Script script(params);
  script.ToDocking();
  script.Repeat(300, 0.4);
  script.Pose(0.34);
  ExpectTransition(script, Stage::kDocking, Stage::kDocked);
  EXPECT_FALSE(script.directive().done);
  script.Repeat(29, 0.34);
  EXPECT_EQ(script.directive().stage, Stage::kDocked);
  script.Pose(0.34);
  ExpectTransition(script, Stage::kDocked, Stage::kUndocking);
  EXPECT_THAT(script.directive().transition->reason, HasSubstr("docked 1 of 2 times"));
  EXPECT_EQ(script.directive().desired.x_m, 0.35);
  script.Repeat(30, 0.36);
  EXPECT_NEAR(script.directive().desired.x_m, 0.38, 1e-12) << "at the rate of docking";
  script.Repeat(600, 0.54);
  EXPECT_EQ(script.directive().stage, Stage::kUndocking);
  EXPECT_NEAR(script.directive().desired.x_m, 0.6, 1e-12);
  script.Pose(0.551);
  ExpectTransition(script, Stage::kUndocking, Stage::kVisualServoing);
  script.Repeat(5, 0.6);
  EXPECT_EQ(script.directive().stage, Stage::kDocking);
  EXPECT_FALSE(script.directive().given_up);
  script.Pose(0.34);
  EXPECT_EQ(script.directive().stage, Stage::kDocked);
  EXPECT_TRUE(script.directive().done);
  EXPECT_EQ(script.directive().dockings, 2);
  script.Repeat(1000, 0.34);
  EXPECT_EQ(script.directive().stage, Stage::kDocked);
}

TEST(DockingProcedure, AttemptsOfACycleAreNotThoseOfTheNext) {
  ProcedureParams params;
  params.cycles = 2;
  params.stay_s = 0;
  params.attempts = 2;
  Script script(params);
  script.ToDocking();
  script.Pose(0.5, 0.05);  // the first fails
  script.Repeat(5, 0.6);
  script.Pose(0.34);
  script.Pose(0.34);
  ASSERT_EQ(script.directive().stage, Stage::kUndocking);
  script.Repeat(600, 0.54);
  script.Pose(0.551);
  script.Repeat(5, 0.6);
  ASSERT_EQ(script.directive().stage, Stage::kDocking);
  script.Pose(0.5, 0.05);
  EXPECT_FALSE(script.directive().given_up) << "the first of this cycle";
  script.Repeat(5, 0.6);
  script.Pose(0.5, 0.05);
  EXPECT_TRUE(script.directive().given_up);
}

TEST(DockingProcedure, ALossWhileUndockingEndsInServoing) {
  ProcedureParams params;
  params.cycles = 2;
  params.stay_s = 0;
  Script script(params);
  script.ToDocking();
  script.Pose(0.34);
  script.Pose(0.34);
  ASSERT_EQ(script.directive().stage, Stage::kUndocking);
  script.LostFor(29);
  EXPECT_EQ(script.directive().stage, Stage::kUndocking);
  ExpectDrift(script.Lost());
  EXPECT_EQ(script.directive().stage, Stage::kVisualServoing);
}

}  // namespace
}  // namespace turbidock::control
