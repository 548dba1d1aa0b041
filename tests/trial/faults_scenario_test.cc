// Trials in which something fails: they end with the right outcome and reason, and no fault makes
// the record say docked while the pole is not in the hole.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"

namespace turbidock::trial {
namespace {

TrialResult Fly(const std::string& scenario, const std::string& faults,
                std::vector<std::string> assignments = {}) {
  assignments.insert(assignments.begin(), {"seed=3", "faults=" + faults});
  const TrialResult result = RunTrial(LoadScenario(scenario, assignments));
  EXPECT_EQ(result.outcome == Outcome::kDocked, result.docked && result.inserted) << faults;
  EXPECT_NE(result.outcome, Outcome::kFalseDock) << faults << ": " << result.reason;
  EXPECT_FALSE(result.reason.empty()) << faults;
  ::testing::Test::RecordProperty(
      faults, std::string(NameOf(result.outcome)) + " " + NameOf(result.failure));
  return result;
}

TrialResult FlyBlind(const std::string& faults) {
  return Fly("sea_night_active", faults, {"pose_source=true_pose"});
}

TEST(FaultsScenario, NoFaultIsTheSameTrial) {
  const TrialResult sound = FlyBlind("{}");
  EXPECT_EQ(sound.outcome, Outcome::kDocked);
  // one that begins when all is over changes nothing
  const TrialResult later = FlyBlind("{thrusters: [{thruster: sway, begin_s: 59}]}");
  EXPECT_EQ(later.digest, sound.digest);
  EXPECT_NE(FlyBlind("{thrusters: [{thruster: sway, begin_s: 5}]}").digest, sound.digest);
}

}  // namespace
}  // namespace turbidock::trial
