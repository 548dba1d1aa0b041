// The word for why a trial failed, from made-up logs.

#include <gtest/gtest.h>

#include <cmath>

#include "experiments/trial/ending.h"

namespace turbidock::trial {
namespace {

using control::Stage;

// Ten seconds a stage with a perfect estimate at the desired pose.
TrialResult Trial(Outcome outcome, const std::vector<Stage>& stages) {
  TrialResult result;
  result.outcome = outcome;
  for (const Stage stage : stages) {
    for (int i = 0; i < 300; ++i) {
      FrameRecord frame;
      frame.frame = std::ssize(result.log.frames);
      frame.stage = stage;
      frame.fitness = stage == Stage::kApproach ? 0.1 : 0.8;
      frame.desired = {0.6, 0, 0, 0};
      frame.true_X_HM.p = {0.6, 0, 0};
      frame.est_X_HM = frame.true_at_image_X_HM = frame.true_X_HM;
      result.log.frames.push_back(frame);
    }
  }
  return result;
}

void LoseTheMarker(double last_s, TrialResult* result) {
  auto& frames = result->log.frames;
  for (auto frame = frames.end() - std::lround(30 * last_s); frame != frames.end(); ++frame)
    frame->fitness = 0;
}

TEST(ReasonOf, HasNoMinusZero) {
  TrialResult result = Trial(Outcome::kTimeout, {Stage::kDocking});
  result.handover_time_s = 1;
  result.final_error_estimated = {.x_m = -0.0004, .y_m = -0.0006, .z_m = 0.0004, .yaw_rad = -1e-4};
  const std::string reason = ReasonOf({Outcome::kTimeout, ""}, {}, result, {});
  EXPECT_NE(reason.find("estimated 0 mm, -1 mm, 0 mm and 0.0° from"), std::string::npos) << reason;
}

TEST(FailureOf, TakesTheOutcomesWord) {
  EXPECT_EQ(FailureOf({}, Trial(Outcome::kSuccess, {Stage::kDocking})), Failure::kNone);
  EXPECT_EQ(FailureOf({}, Trial(Outcome::kCollision, {Stage::kDocking})), Failure::kCollision);
  EXPECT_EQ(FailureOf({}, Trial(Outcome::kDiverged, {Stage::kDocking})), Failure::kDiverged);
  EXPECT_EQ(FailureOf({}, Trial(Outcome::kFalseDock, {Stage::kDocking})), Failure::kFalseLock);
  EXPECT_EQ(FailureOf({}, Trial(Outcome::kTimeout, {Stage::kApproach})), Failure::kNeverFound);
  EXPECT_EQ(FailureOf({}, Trial(Outcome::kTimeout, {Stage::kApproach, Stage::kVisualServoing})),
            Failure::kTimeout);
}

TEST(FailureOf, AJamComesFirstUnlessItDockedAfterAll) {
  TrialResult result = Trial(Outcome::kTimeout, {Stage::kDocking});
  result.jam_time_s = 4;
  EXPECT_EQ(FailureOf({}, result), Failure::kJammed);
  result.outcome = Outcome::kSuccess;
  EXPECT_EQ(FailureOf({}, result), Failure::kNone);
}

TEST(FailureOf, ALossBelongsToTheStageInWhichTheMarkerWasLastSeen) {
  TrialResult servoing = Trial(Outcome::kMarkerLost, {Stage::kDocking, Stage::kVisualServoing});
  LoseTheMarker(5, &servoing);
  EXPECT_EQ(FailureOf({}, servoing), Failure::kLostInServoing);
  // Lost while docking: the procedure goes back to servoing and to approach without an estimate.
  TrialResult docking = Trial(Outcome::kMarkerLost, {Stage::kVisualServoing, Stage::kDocking,
                                                     Stage::kVisualServoing, Stage::kApproach});
  LoseTheMarker(21, &docking);
  EXPECT_EQ(FailureOf({}, docking), Failure::kLostInDocking);
  docking.outcome = Outcome::kTimeout;
  EXPECT_EQ(FailureOf({}, docking), Failure::kLostInDocking);
  // Seen again within the time that a loss takes: no loss.
  docking.log.frames.back().fitness = 0.8;
  EXPECT_EQ(FailureOf({}, docking), Failure::kTimeout);
}

TEST(FailureOf, AWrongEstimateThatWasActedOnIsAFalseLock) {
  TrialResult result = Trial(Outcome::kTimeout, {Stage::kVisualServoing, Stage::kVisualServoing});
  auto& frames = result.log.frames;
  const auto mislead = [&](double last_s, double by_m) {
    for (auto frame = frames.end() - std::lround(30 * last_s); frame != frames.end(); ++frame)
      frame->est_X_HM.p.y() = by_m;
  };
  mislead(8, 0.099);
  EXPECT_EQ(FailureOf({}, result), Failure::kTimeout);
  mislead(7, 0.101);
  EXPECT_EQ(FailureOf({}, result), Failure::kTimeout);  // not half of the last 15 s
  mislead(8, 0.101);
  EXPECT_EQ(FailureOf({}, result), Failure::kFalseLock);
  result.outcome = Outcome::kMarkerLost;
  EXPECT_EQ(FailureOf({}, result), Failure::kFalseLock);
  for (FrameRecord& frame : frames) frame.true_at_image_X_HM = frame.est_X_HM;  // an old image
  EXPECT_NE(FailureOf({}, result), Failure::kFalseLock);
}

TEST(FailureOf, ACollisionOnAWrongEstimateIsAFalseLock) {
  TrialResult result = Trial(Outcome::kCollision, {Stage::kVisualServoing, Stage::kDocking});
  auto& frames = result.log.frames;
  for (auto frame = frames.end() - 44; frame != frames.end(); ++frame) frame->est_X_HM.p.y() = 0.11;
  EXPECT_EQ(FailureOf({}, result), Failure::kCollision);  // not half of the last 3 s
  for (auto frame = frames.end() - 46; frame != frames.end(); ++frame) frame->est_X_HM.p.y() = 0.11;
  EXPECT_EQ(FailureOf({}, result), Failure::kFalseLock);
  for (FrameRecord& frame : frames) frame.fitness = 0.1;  // nobody acts on that
  EXPECT_EQ(FailureOf({}, result), Failure::kCollision);
}

TEST(FailureOf, SwingsBeyondTheLimitsOfEntryAreAnOscillation) {
  const auto swinging = [](double amplitude_m, double period_s, double about_m = 0) {
    TrialResult result = Trial(Outcome::kTimeout, {Stage::kVisualServoing, Stage::kDocking});
    for (FrameRecord& frame : result.log.frames) {
      const double t_s = static_cast<double>(frame.frame) / 30;
      frame.true_X_HM.p.z() = about_m + amplitude_m * std::cos(2 * M_PI * t_s / period_s);
      frame.est_X_HM = frame.true_at_image_X_HM = frame.true_X_HM;
    }
    return FailureOf({}, result);
  };
  EXPECT_EQ(swinging(0.021, 5), Failure::kOscillation);
  EXPECT_EQ(swinging(0.019, 5), Failure::kTimeout);  // within enter_z_m
  EXPECT_EQ(swinging(0.1, 15), Failure::kTimeout);   // two swings in 15 s
  for (const double about_m : {-0.02, 0.02})         // beyond one limit only
    EXPECT_EQ(swinging(0.03, 5, about_m), Failure::kTimeout);
}

TEST(FailureOf, EachAxisSwingsBeyondItsOwnLimit) {
  Scenario scenario;
  scenario.procedure.enter_y_m = 0.01;
  scenario.procedure.enter_z_m = 0.03;
  scenario.procedure.enter_yaw_rad = 0.05;
  const auto swinging = [&](double y_m, double z_m, double yaw_rad) {
    TrialResult result = Trial(Outcome::kTimeout, {Stage::kVisualServoing, Stage::kDocking});
    for (FrameRecord& frame : result.log.frames) {
      const double wave = std::cos(2 * M_PI * static_cast<double>(frame.frame) / 150);
      frame.true_X_HM = {FromYawPitchRoll(yaw_rad * wave, 0, 0), {0.6, y_m * wave, z_m * wave}};
      frame.est_X_HM = frame.true_at_image_X_HM = frame.true_X_HM;
    }
    return FailureOf(scenario, result);
  };
  EXPECT_EQ(swinging(0.02, 0, 0), Failure::kOscillation);
  EXPECT_EQ(swinging(0, 0.02, 0), Failure::kTimeout);
  EXPECT_EQ(swinging(0, 0.04, 0), Failure::kOscillation);
  EXPECT_EQ(swinging(0, 0, 0.06), Failure::kOscillation);
  EXPECT_EQ(swinging(0.009, 0.029, 0.04), Failure::kTimeout);
}

}  // namespace
}  // namespace turbidock::trial
