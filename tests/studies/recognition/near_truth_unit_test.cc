#include "experiments/studies/recognition/near_truth.h"

#include <gtest/gtest.h>

#include <cmath>

namespace turbidock::recognition {
namespace {

using Scenarios = std::map<MarkerKind, trial::Scenario>;

Scenarios With(const std::vector<std::string>& assignments) {
  return {{MarkerKind::kActive, RecognitionScenario(MarkerKind::kActive, assignments)},
          {MarkerKind::kPassive, RecognitionScenario(MarkerKind::kPassive, assignments)}};
}

const std::vector<RecognitionCell> kCells = {{MarkerKind::kActive, 20, 0.6},
                                             {MarkerKind::kActive, 120, 0.4},
                                             {MarkerKind::kActive, 150, 1},
                                             {MarkerKind::kPassive, 5, 0.6},
                                             {MarkerKind::kPassive, 60, 0.4}};

// Recognised well, poorly and not at all.
TEST(NearTruth, IsWhatTheSearchEndsWith) {
  const Recognition recognition(With({}), kCells);
  NearTruth near_truth(recognition, 10);
  near_truth.Light();
  const std::vector<CellResult> searched = recognition.Run({.seconds = 1, .run = {.workers = 2}});
  for (size_t i = 0; i < kCells.size(); ++i)
    EXPECT_NEAR(near_truth.RunCell(i).fitness_mean, searched[i].fitness_mean, 0.04) << i;
}

// Light of unit strength is kept: what it makes under others is what is computed anew.
TEST(NearTruth, FollowsItsScenarios) {
  const std::vector<std::vector<std::string>> changes = {
      {"ball_lights.rim_radiance_w_m2_sr=0.004", "ball_lights.core_radiance_w_m2_sr=0.002",
       "lamps.intensity_w_sr=[0.002, 0.02, 0.01]"},
      {"water.scattering_scale=0.8"},
      {"ball_lights.core_width_m=0.009"},
      {"sensor.auto_level=0.1", "sensor.gain=40"},
      {"hue.window_rad=0.5"}};
  Recognition recognition(With({}), kCells);
  NearTruth near_truth(recognition, 2);
  near_truth.Light();
  std::vector<std::vector<float>> before;
  for (size_t i = 0; i < kCells.size(); ++i) before.push_back(near_truth.RunCell(i).fitness);
  for (const std::vector<std::string>& change : changes) {
    recognition.set_scenarios(With(change));
    near_truth.Light();
    NearTruth anew(recognition, 2);
    anew.Light();
    int changed = 0;
    for (size_t i = 0; i < kCells.size(); ++i) {
      const std::vector<float> fitness = near_truth.RunCell(i).fitness;
      EXPECT_EQ(fitness, anew.RunCell(i).fitness) << change[0] << ", cell " << i;
      changed += fitness != before[i];
    }
    EXPECT_GE(changed, 2) << change[0];
  }
}

TEST(NearTruth, KnowsNeitherSnowNorLenses) {
  for (const char* change : {"snow.flakes_per_m3=100", "lens.k1=-0.1"}) {
    const Recognition recognition(With({change}), {kCells[0]});
    EXPECT_THROW(NearTruth(recognition, 1).Light(), ConfigError) << change;
  }
}

}  // namespace
}  // namespace turbidock::recognition
