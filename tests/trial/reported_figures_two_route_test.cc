// What a trial reports, computed once more from its log by plain loops: a trial that docks and
// holds, one that is late, one whose images are old.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"

namespace turbidock::trial {
namespace {

using control::Stage;

double Desired(const FrameRecord& frame, char axis) {
  return axis == 'x' ? frame.desired.x_m : axis == 'y' ? frame.desired.y_m : frame.desired.z_m;
}

// Marker in the camera head less the desired pose.
AxesPose ErrorOf(const FrameRecord& frame, const Pose& X_HM) {
  const Eigen::Vector3d ahead = X_HM.q * Eigen::Vector3d::UnitX();
  AxesPose error;
  error.x_m = X_HM.p.x() - Desired(frame, 'x');
  error.y_m = X_HM.p.y() - Desired(frame, 'y');
  error.z_m = X_HM.p.z() - Desired(frame, 'z');
  error.yaw_rad = std::atan2(ahead.y(), ahead.x()) - frame.desired.yaw_rad;
  return error;
}

void ExpectEqual(const AxesPose& reported, const AxesPose& expected) {
  EXPECT_NEAR(reported.x_m, expected.x_m, 1e-12);
  EXPECT_NEAR(reported.y_m, expected.y_m, 1e-12);
  EXPECT_NEAR(reported.z_m, expected.z_m, 1e-12);
  EXPECT_NEAR(reported.yaw_rad, expected.yaw_rad, 1e-9);
}

void ExpectReportedAsLogged(const TrialResult& result, double fps) {
  const std::vector<FrameRecord>& log = result.log.frames;
  ASSERT_FALSE(log.empty());
  // The first frame of the last time that it docked, if it stayed.
  auto docked = log.end();
  for (auto frame = log.begin(); frame != log.end(); ++frame) {
    if (frame->stage == Stage::kUndocking) docked = log.end();
    if (frame->stage == Stage::kDocked && docked == log.end()) docked = frame;
  }
  EXPECT_EQ(result.docked, docked != log.end());
  const FrameRecord& judged = result.docked ? *docked : log.back();
  const double end_s = static_cast<double>(log.size()) / fps;
  EXPECT_NEAR(result.time_s, result.docked ? static_cast<double>(judged.frame) / fps : end_s, 1e-9);
  ExpectEqual(result.final_error_true, ErrorOf(judged, judged.true_X_HM));
  ExpectEqual(result.final_error_estimated, ErrorOf(judged, judged.est_X_HM));

  // Steering counts from the first frame that is not of the approach, without later approaches.
  const bool found = std::any_of(log.begin(), log.end(), [](const FrameRecord& frame) {
    return frame.stage != Stage::kApproach;
  });
  double squares = 0, overshoot = 0, volts = 0, fitness = 0, best = -1, force = 0;
  double error2 = 0, claims = 0, false_claims = 0;
  int counted = 0, returns = 0, attempts = 0, dockings = 0, changes = 0;
  std::map<Stage, int> frames_of;
  for (size_t i = 0; i < log.size(); ++i) {
    const FrameRecord& frame = log[i];
    EXPECT_EQ(frame.frame, static_cast<int64_t>(i));
    for (const double v : frame.command.volts) volts += (v - 2.5) * (v - 2.5);
    fitness += frame.fitness;
    if (frame.normalised_error2) {
      ++claims;
      error2 += *frame.normalised_error2;
      false_claims += *frame.normalised_error2 > 20.06;
    }
    best = std::max(best, frame.fitness);
    force = std::max(force, frame.dock_force_newton);
    ++frames_of[frame.stage];
    if (!found || frame.stage != Stage::kApproach) {
      const double y = frame.true_X_HM.p.y() - frame.desired.y_m,
                   z = frame.true_X_HM.p.z() - frame.desired.z_m;
      squares += std::min(1.0, y * y) + std::min(1.0, z * z);
      overshoot = std::max(overshoot, frame.desired.x_m - frame.true_X_HM.p.x());
      ++counted;
    }
    // A transition is noted with the frame in which the vehicle first is in the new stage.
    if (i > 0 && frame.stage != log[i - 1].stage) {
      ASSERT_LT(changes, static_cast<int>(result.transitions.size()));
      const control::Transition& change = result.transitions[static_cast<size_t>(changes++)];
      EXPECT_EQ(change.frame, frame.frame);
      EXPECT_EQ(change.from, log[i - 1].stage);
      EXPECT_EQ(change.to, frame.stage);
      returns += change.from == Stage::kDocking && change.to == Stage::kVisualServoing;
      attempts += frame.stage == Stage::kDocking;
      dockings += frame.stage == Stage::kDocked;
    }
  }
  EXPECT_EQ(changes, static_cast<int>(result.transitions.size()));
  EXPECT_EQ(result.returns_to_servoing, returns);
  EXPECT_EQ(result.attempts, attempts);
  EXPECT_EQ(result.dockings, dockings);
  EXPECT_NEAR(result.tracking_rms_m, std::sqrt(squares / counted), 1e-12);
  EXPECT_NEAR(result.overshoot_m, std::min(overshoot, 1.0), 1e-12);
  EXPECT_NEAR(result.effort_v, std::sqrt(volts / (4.0 * static_cast<double>(log.size()))), 1e-12);
  EXPECT_NEAR(result.fitness_mean, fitness / static_cast<double>(log.size()), 1e-12);
  EXPECT_EQ(result.fitness_best, best);
  EXPECT_NEAR(result.false_confidence_s, false_claims / fps, 1e-9);
  EXPECT_NEAR(result.normalised_error2_mean.value_or(-1), claims > 0 ? error2 / claims : -1, 1e-9);
  EXPECT_EQ(result.dock_force_max_newton, force);
  for (const auto& [stage, count] : frames_of)
    EXPECT_NEAR(result.stage_time_s.at(stage), count / fps, 1e-9);
  EXPECT_EQ(result.stage_time_s.size(), frames_of.size());
}

TEST(ReportedFigures, OfATrialThatDocksAndHolds) {
  // Drifts on for two seconds after docking, in a current: the end is another place than the dock.
  const TrialResult result = RunTrial(LoadScenario(
      "sea_night_active",
      {"trial.seed=3", "estimator.pose_source=true_pose", "trial.after_docked_s=2",
       "estimator.true_pose.noise=[0.005, 0.004, 0.004, 0.02]", "cameras.delay_frames=3"}));
  ASSERT_EQ(result.outcome, Outcome::kSuccess) << result.reason;
  ASSERT_GE(std::ssize(result.log.frames) / 30.0, result.time_s + 1.9);
  const AxesPose at_end = ErrorOf(result.log.frames.back(), result.log.frames.back().true_X_HM);
  ASSERT_GT(std::abs(at_end.y_m - result.final_error_true.y_m), 1e-4);
  ExpectReportedAsLogged(result, 30);
}

// An estimate without noise is the truth of its image, which is that of the frame when the image
// was exposed: also where images are rare, late or lost on the way.
TEST(ReportedFigures, AnEstimateIsComparedWithTheTruthOfItsImage) {
  for (const auto& [delay, period, drops] :
       {std::tuple{0, 1, "0"}, {1, 1, "0"}, {3, 1, "0"}, {2, 3, "0"}, {1, 1, "0.4"}}) {
    SCOPED_TRACE(::testing::Message() << delay << " " << period << " " << drops);
    const TrialResult result = RunTrial(LoadScenario(
        "sea_night_active",
        {"trial.seed=3", "estimator.pose_source=true_pose", "trial.duration_s=4",
         "estimator.true_pose.noise=[0, 0, 0, 0]", "cameras.delay_frames=" + std::to_string(delay),
         "cameras.period_frames=" + std::to_string(period),
         "cameras.drop_probability=" + std::string(drops)}));
    const std::vector<FrameRecord>& log = result.log.frames;
    int old = 0;
    for (const FrameRecord& frame : log) {
      const Pose& truth = frame.true_at_image_X_HM;
      EXPECT_NEAR((frame.est_X_HM.p - truth.p).norm(), 0, 1e-12);
      EXPECT_NEAR(AngleBetween(frame.est_X_HM.q, truth.q), 0, 1e-7);
      const auto exposed = std::ranges::find(log, frame.image_time_s, &FrameRecord::time_s);
      ASSERT_NE(exposed, log.end());
      const int64_t age = frame.frame - exposed->frame;
      EXPECT_EQ(exposed->true_X_HM.p, truth.p);
      EXPECT_GE(age, std::min<int64_t>(delay, frame.frame));
      if (drops[1] == 0) {
        EXPECT_LE(age, delay + period - 1);
      }
      old += truth.p != frame.true_X_HM.p;
    }
    EXPECT_GT(old + (delay + period == 1), 0);
  }
}

// Both cameras look a sixth of a degree aside, which no covariance knows.
TEST(ReportedFigures, OfEstimatesThatClaimTooMuch) {
  const TrialResult result = RunTrial(
      LoadScenario("sea_night_active",
                   {"trial.seed=5", "trial.duration_s=3",
                    "faults.misalignments=[{camera: both, yaw_pitch_roll_rad: [0.003, 0, 0]}]"}));
  EXPECT_GT(result.false_confidence_s, 1);
  EXPECT_GT(result.normalised_error2_mean.value_or(0), 20);
  ExpectReportedAsLogged(result, 30);
}

TEST(ReportedFigures, OfATrialThatIsLate) {
  const TrialResult result = RunTrial(LoadScenario(
      "sea_night_active", {"trial.seed=5", "estimator.pose_source=true_pose", "trial.duration_s=6",
                           "estimator.true_pose.found_after_s=1", "cameras.delay_frames=2"}));
  ASSERT_EQ(result.outcome, Outcome::kTimeout) << result.reason;
  ASSERT_FALSE(result.transitions.empty());
  ExpectReportedAsLogged(result, 30);
}

TEST(ReportedFigures, OfATrialThatPressesAgainstTheDock) {
  const TrialResult result = RunTrial(LoadScenario(
      "pool_active", {"trial.seed=3", "estimator.pose_source=true_pose", "trial.duration_s=13",
                      "procedure.servo_z_m=-0.06", "vehicle.contact.friction=2"}));
  ASSERT_GT(result.dock_force_max_newton, result.log.frames.back().dock_force_newton);
  ExpectReportedAsLogged(result, 30);
}

TEST(ReportedFigures, OfATrialThatDocksTwice) {
  const TrialResult result = RunTrial(
      LoadScenario("docking_cycles", {"estimator.pose_source=true_pose", "procedure.cycles=2"}));
  EXPECT_EQ(result.outcome, Outcome::kSuccess) << result.reason;
  EXPECT_EQ(result.dockings, 2);
  EXPECT_GE(result.attempts, 2);
  EXPECT_GT(result.stage_time_s.at(Stage::kUndocking), 5);
  ExpectReportedAsLogged(result, 30);
}

// The time is up while it is docked for the first of two times: not docked as it shall be.
TEST(ReportedFigures, OfATrialThatStopsBetweenTwoDockings) {
  const TrialResult result =
      RunTrial(LoadScenario("docking_cycles", {"estimator.pose_source=true_pose",
                                               "procedure.cycles=2", "trial.duration_s=20"}));
  EXPECT_EQ(result.outcome, Outcome::kTimeout) << result.reason;
  EXPECT_EQ(result.dockings, 1);
  EXPECT_FALSE(result.docked);
  EXPECT_EQ(result.failure, Failure::kTimeout);
}

TEST(ReportedFigures, OfATrialThatGivesUp) {
  // aimed beside the hole: the pole meets the rim and does not get on
  const TrialResult result = RunTrial(LoadScenario(
      "docking_cycles", {"estimator.pose_source=true_pose", "procedure.servo_z_m=0.06",
                         "vehicle.contact.friction=2", "procedure.attempts=2", "trial.seed=3"}));
  EXPECT_EQ(result.outcome, Outcome::kGaveUp) << result.reason;
  EXPECT_EQ(result.attempts, 2);
  ExpectReportedAsLogged(result, 30);
}

TEST(ReportedFigures, OfATrialThatFindsNothing) {
  const TrialResult result = RunTrial(LoadScenario(
      "sea_night_active", {"trial.seed=5", "estimator.pose_source=true_pose", "trial.duration_s=2",
                           "estimator.true_pose.found_after_s=60"}));
  ASSERT_TRUE(result.transitions.empty());
  ExpectReportedAsLogged(result, 30);
}

}  // namespace
}  // namespace turbidock::trial
