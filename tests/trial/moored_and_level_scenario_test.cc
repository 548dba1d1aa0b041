// A station that moves and a vehicle that keeps itself level, each beside one that does not: what
// they are for is what they do.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "sim/base/units.h"

namespace turbidock::trial {
namespace {

TrialResult FlyBlind(const std::string& scenario, int seed, std::vector<std::string> assignments) {
  assignments.push_back("estimator.pose_source=true_pose");
  assignments.push_back("trial.seed=" + std::to_string(seed));
  return RunTrial(LoadScenario(scenario, assignments));
}

double MostPitch_deg(const TrialResult& result) {
  double most_rad = 0;
  for (const FrameRecord& frame : result.log.frames) {
    const double rise = (frame.true_X_WB.q * Eigen::Vector3d::UnitX()).z();
    most_rad = std::max(most_rad, std::abs(std::asin(rise)));
  }
  return units::DegFromRad(most_rad);
}

TEST(LevelScenario, BlueRov2PitchesLessWhenItKeepsItselfLevel) {
  for (const int seed : {1, 2, 3}) {
    const std::vector<std::string> sea = {"sea.state=moderate"};
    std::vector<std::string> without = sea;
    without.emplace_back("control.levelling.enabled=false");
    const TrialResult level = FlyBlind("bluerov2_sea_night", seed, sea);
    EXPECT_EQ(level.outcome, Outcome::kSuccess) << level.reason;
    EXPECT_LT(MostPitch_deg(level), 7) << seed;
    EXPECT_GT(MostPitch_deg(FlyBlind("bluerov2_sea_night", seed, without)), 9) << seed;
  }
}

int Docked(const std::string& scenario, const std::vector<std::string>& assignments) {
  int docked = 0;
  for (const int seed : {1, 2, 3, 4})
    docked += FlyBlind(scenario, seed, assignments).outcome == Outcome::kSuccess;
  return docked;
}

TEST(MooredScenario, ADockThatTurnsIntoTheCurrentIsReachedWhereAFixedOneIsNot) {
  const std::vector<std::string> across = {"sea.state=custom", "station.mooring.natural_period_s=0",
                                           "sea.current.surface_velocity_mps=[0, 0.2, 0]"};
  std::vector<std::string> turns = across;
  turns.emplace_back("station.mooring.weathervane_arm_m=1");
  EXPECT_EQ(Docked("sea_moored_active", across), 0);
  EXPECT_EQ(Docked("sea_moored_active", turns), 4);
}

TEST(MooredScenario, ASlowSwingIsFollowedAndAFastOneIsNot) {
  const auto swung = [](const char* period) {
    return Docked("sea_moored_active", {"sea.state=calm", "station.mooring.natural_period_s=0",
                                        "station.mooring.swing_y_m=0.15",
                                        std::string("station.mooring.swing_period_s=") + period});
  };
  EXPECT_EQ(swung("16"), 4);
  EXPECT_EQ(swung("2"), 0);
}

}  // namespace
}  // namespace turbidock::trial
