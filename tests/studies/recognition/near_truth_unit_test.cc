// F near the true pose, which the calibration asks for instead of a search.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>

#include "experiments/studies/recognition/calibration.h"

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
  const Scenarios scenarios = With({});
  std::string cases;
  for (const RecognitionCell& cell : kCells)
    cases += fmt::format(
        "  {0} {1} {2}: {{scenario: pool_{0}, trial.scene: tank_{0}.xml, cameras.optics: "
        "published, "
        "water.milk_ml_m3: {1}, start.distance_min_m: {2}, start.distance_max_m: {2}}}\n",
        NameOf(cell.marker), cell.milk_ml_m3, cell.distance_m);
  const batch::Plan plan(
      "schema_version: 1\nset: {start: {lateral_m: 0, vertical_m: 0, heading_rad: 0}}\ncases:\n" +
          cases,
      "plan");
  const std::vector<CellResult> searched = Recognize(plan, {.seconds = 1, .jobs = {.workers = 2}});
  for (size_t i = 0; i < kCells.size(); ++i) {
    EXPECT_EQ(searched[i].cell, kCells[i]);
    const trial::Scenario& scenario = scenarios.at(kCells[i].marker);
    const trial::FixedView view = ViewOf(scenario, kCells[i]);
    const light::Water water = WaterOf(view, scenario, kCells[i]);
    EXPECT_NEAR(RunNearTruth(view, water, scenario, kCells[i], 10).fitness_mean,
                searched[i].fitness_mean, 0.06)
        << i;
  }
}

TEST(NearTruth, FollowsItsScenarios) {
  std::vector<trial::FixedView> views;
  for (const RecognitionCell& cell : kCells)
    views.push_back(ViewOf(With({}).at(cell.marker), cell));
  const auto fitness = [&](const std::vector<std::string>& assignments) {
    std::vector<std::vector<float>> of_cells;
    for (size_t i = 0; i < kCells.size(); ++i) {
      const trial::Scenario scenario = With(assignments).at(kCells[i].marker);
      const light::Water water = WaterOf(views[i], scenario, kCells[i]);
      of_cells.push_back(RunNearTruth(views[i], water, scenario, kCells[i], 2).fitness);
    }
    return of_cells;
  };
  const auto before = fitness({});
  EXPECT_EQ(fitness({}), before);
  for (const char* change :
       {"lights.marker.rim_radiance_w_m2_sr=0.004", "water.scattering_scale=0.8",
        "cameras.sensor.gain=40", "estimator.hue.window_rad=0.5"})
    EXPECT_NE(fitness({change}), before) << change;
}

}  // namespace
}  // namespace turbidock::recognition
