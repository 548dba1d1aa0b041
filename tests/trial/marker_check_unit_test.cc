// A marker that is not the scene's is noticed before a trial runs on it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiments/trial/trial.h"

namespace turbidock::trial {
namespace {

using ::testing::HasSubstr;

TEST(Marker, ADifferentOneIsAnErrorUnlessMeant) {
  const std::vector<std::string> quick = {"cameras.rig.width_px=64", "cameras.rig.height_px=48",
                                          "trial.duration_s=0.03"};
  Scenario scenario = LoadScenario("pool_active", quick);
  scenario.marker.balls[1].p_MQ_m.z() += 0.0009;  // within a millimetre
  EXPECT_EQ(RunTrial(scenario).log.frames.size(), 1u);
  scenario.marker.balls[1].p_MQ_m.z() += 0.0009;
  try {
    RunTrial(scenario);
    FAIL() << "a wrong marker must not run";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("ball red is known at [0, 0, 0.0718] m"));
    EXPECT_THAT(error.what(), HasSubstr("in the scene it is at [0, 0, 0.07] m"));
  }
  scenario.marker_may_differ = true;
  EXPECT_EQ(RunTrial(scenario).log.frames.size(), 1u);

  scenario = LoadScenario("pool_active", quick);
  scenario.marker.balls[0].radius_m = 0.03;
  EXPECT_THROW(RunTrial(scenario), ConfigError);
  scenario = LoadScenario("pool_active", quick);
  scenario.marker.balls[0].name = "cyan";
  EXPECT_THROW(RunTrial(scenario), ConfigError);
  scenario = LoadScenario("pool_active", quick);
  scenario.marker.balls.pop_back();
  EXPECT_THROW(RunTrial(scenario), ConfigError);
}

}  // namespace
}  // namespace turbidock::trial
