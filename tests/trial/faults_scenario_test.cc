// Trials in which something fails: they end with the right outcome and reason, and no fault makes
// the record say docked while the pole is not in the hole.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"

namespace turbidock::trial {
namespace {

TrialResult Fly(const std::string& scenario, const std::string& faults,
                std::vector<std::string> assignments = {}) {
  assignments.insert(assignments.begin(), {"trial.seed=3", "faults=" + faults});
  const TrialResult result = RunTrial(LoadScenario(scenario, assignments));
  EXPECT_EQ(result.outcome == Outcome::kSuccess, result.docked && result.inserted) << faults;
  EXPECT_NE(result.outcome, Outcome::kFalseDock) << faults << ": " << result.reason;
  EXPECT_FALSE(result.reason.empty()) << faults;
  ::testing::Test::RecordProperty(
      faults, std::string(NameOf(result.outcome)) + " " + NameOf(result.failure));
  return result;
}

// The same without cameras, in a tenth of a second.
TrialResult FlyBlind(const std::string& faults) {
  return Fly("sea_night_active", faults, {"estimator.pose_source=true_pose"});
}

TEST(FaultsScenario, NoFaultIsTheSameTrial) {
  const TrialResult sound = FlyBlind("{}");
  EXPECT_EQ(sound.outcome, Outcome::kSuccess);
  // one that begins when all is over changes nothing
  const TrialResult later = FlyBlind("{thrusters: [{thruster: sway, begin_s: 59}]}");
  EXPECT_EQ(later.digest, sound.digest);
  EXPECT_NE(FlyBlind("{thrusters: [{thruster: sway, begin_s: 5}]}").digest, sound.digest);
}

struct Cell {
  const char* faults;
  Outcome outcome;
  Failure failure;
  const char* reason;  // a part of it
};

void Expect(const Cell& cell, const TrialResult& result) {
  EXPECT_EQ(result.outcome, cell.outcome) << cell.faults << ": " << result.reason;
  EXPECT_EQ(result.failure, cell.failure) << cell.faults << ": " << result.reason;
  EXPECT_THAT(result.reason, ::testing::HasSubstr(cell.reason)) << cell.faults;
}

TEST(FaultsScenario, AFailingThrusterEndsAsItShould) {
  const std::vector<Cell> cells = {
      {"{thrusters: [{thruster: surge_left, force_factor: 0.5, begin_s: 6}]}", Outcome::kSuccess,
       Failure::kNone, "the pole is in the hole"},
      {"{thrusters: [{thruster: sway, force_factor: 0, begin_s: 6}]}", Outcome::kSuccess,
       Failure::kNone, "the pole is in the hole"},
      {"{thrusters: [{thruster: sway, force_factor: -1, begin_s: 6, end_s: 8}]}", Outcome::kSuccess,
       Failure::kNone, "the pole is in the hole"},
      {"{thrusters: [{thruster: surge_left, force_factor: 0, begin_s: 6}]}", Outcome::kSuccess,
       Failure::kNone, "the pole is in the hole"},
      {"{thrusters: [{thruster: surge_left, force_factor: -1, begin_s: 6}]}", Outcome::kCollision,
       Failure::kCollision, "pole against station_plate"},
      {"{thrusters: [{thruster: sway, force_factor: -1, begin_s: 6}]}", Outcome::kTimeout,
       Failure::kTimeout, "are over in visual_servoing"},
      {"{thrusters: [{thruster: heave, force_factor: -1, begin_s: 6}]}", Outcome::kMarkerLost,
       Failure::kLostInServoing, "marker lost"}};
  for (const Cell& cell : cells) Expect(cell, FlyBlind(cell.faults));
}

TEST(FaultsScenario, AFailingCameraEndsAsItShould) {
  const std::vector<Cell> cells = {
      // what stands still is not believed in, and one camera is enough
      {"{images: [{kind: frozen, camera: both, begin_s: 6}]}", Outcome::kMarkerLost,
       Failure::kLostInDocking,
       "; the left camera has given the same image for 15.0 s; the right camera"},
      {"{images: [{kind: frozen, camera: left, begin_s: 6}]}", Outcome::kSuccess, Failure::kNone,
       "; the left camera has given the same image"},
      {"{images: [{kind: black, camera: both, begin_s: 4}]}", Outcome::kMarkerLost,
       Failure::kLostInDocking, "marker lost"},
      {"{misalignments: [{camera: both, yaw_pitch_roll_rad: [0.0349, 0, 0], begin_s: 6}]}",
       Outcome::kSuccess, Failure::kNone, "the pole is in the hole"}};
  for (const Cell& cell : cells) Expect(cell, Fly("sea_night_active", cell.faults));
  Expect({"{images: [{kind: swapped}]}", Outcome::kTimeout, Failure::kNeverFound, "never found"},
         Fly("sea_night_active", "{images: [{kind: swapped}]}", {"trial.duration_s=5"}));
}

}  // namespace
}  // namespace turbidock::trial
