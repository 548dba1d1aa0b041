// Estimators side by side on painted frames: the budget, and that all of them repeat.

#include <gtest/gtest.h>

#include "experiments/estimators/compare_estimators.h"
#include "tests/support/paint_marker.h"

namespace turbidock::experiments {
namespace {

TEST(CompareEstimators, EachSpendsItsBudgetRepeatsAndClimbs) {
  Scenario scenario = RecognitionScenario(MarkerKind::kActive, {});
  const Pose X_HM = Pose::FromVectorPart({0.6, 0.03, -0.02}, {0.01, -0.02, 0.05});
  const StereoImage seen =
      turbidock::testing::PaintMarker(scenario.marker, scenario.rig.MakeRig(), X_HM, {}, nullptr);
  for (const std::string& name : EstimatorNames()) {
    const auto a = MakeEstimator(name, scenario, 3), b = MakeEstimator(name, scenario, 3);
    double first = 0, last = 0;
    for (int frame = 0; frame < 6; ++frame) {
      const PoseEstimate& estimate = a->Update(seen);
      EXPECT_LE(estimate.evaluations, 540) << name;
      EXPECT_GT(estimate.evaluations, name == "blobs" ? 0 : 200) << name;
      EXPECT_EQ(estimate.X_HM.p, b->Update(seen).X_HM.p) << name;
      (frame == 0 ? first : last) = estimate.fitness;
    }
    EXPECT_GE(last, first) << name;
  }
  EXPECT_THROW(MakeEstimator("best", scenario, 3), ConfigError);
}

TEST(CompareEstimators, RanksTellWhetherFitnessTellsTheError) {
  CompareRow row;
  row.estimator = "default";
  row.errors_m = {0.1, 0.2, 0.3, 0.4};
  row.fitness = {0.9, 0.8, 0.2, 0.1};
  EXPECT_DOUBLE_EQ(FitnessErrorCorrelation({row}, MarkerKind::kActive, "default"), -1);
  row.fitness = {0.1, 0.2, 0.7, 0.8};
  EXPECT_DOUBLE_EQ(FitnessErrorCorrelation({row}, MarkerKind::kActive, "default"), 1);
  row.fitness = {0.5, 0.5, 0.5, 0.5};
  EXPECT_DOUBLE_EQ(FitnessErrorCorrelation({row}, MarkerKind::kActive, "default"), 0);
}

TEST(CompareEstimators, RunsACell) {
  CompareOptions options;
  options.markers = {MarkerKind::kActive};
  options.distances_m = {0.6};
  options.milk_ml_m3 = {10};
  options.estimators = {"default", "blobs"};
  options.starts = 2;
  options.frames = 15;
  const std::vector<CompareRow> rows = CompareEstimators(options);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].found, 2);
  // The demand on clear water at this distance, with milk.
  EXPECT_LT(rows[0].error_median_m, 0.001);
  EXPECT_LT(rows[0].rotation_median_rad, 0.0087);
  EXPECT_LT(rows[0].error_median_m, rows[1].error_median_m);
}

TEST(CompareEstimators, TellsAnAbsentMarkerFromAMovingOne) {
  CompareOptions options;
  options.markers = {MarkerKind::kActive};
  options.distances_m = {0.6};
  options.milk_ml_m3 = {10};
  options.estimators = {"default"};
  options.starts = 1;
  options.frames = kMovingSettleFrames;
  options.task = CompareTask::kMoving;
  EXPECT_THROW(CompareEstimators(options), ConfigError);  // nothing would be judged
  options.frames += 5;
  const std::vector<CompareRow> moving = CompareEstimators(options);
  ASSERT_EQ(moving.size(), 1u);
  EXPECT_EQ(moving[0].found, 1);
  EXPECT_DOUBLE_EQ(moving[0].detected, 1);
  options.frames = 10;
  options.task = CompareTask::kAbsent;
  const std::vector<CompareRow> absent = CompareEstimators(options);
  ASSERT_EQ(absent.size(), 1u);
  EXPECT_EQ(absent[0].cell.distance_m, 0);
  EXPECT_EQ(absent[0].detected, 0);
  EXPECT_EQ(absent[0].found, 0);
  EXPECT_TRUE(absent[0].misses.empty());
}

TEST(CompareEstimators, StartsAnywhereAreOfAreaI) {
  CompareOptions options;
  options.task = CompareTask::kAnywhere;
  options.markers = {MarkerKind::kPassive};
  options.milk_ml_m3 = {0, 2000};  // in the latter none is
  options.estimators = {"default"};
  options.starts = 2;
  options.frames = 20;
  const std::vector<CompareRow> rows = CompareEstimators(options);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].starts, 2);
  EXPECT_EQ(rows[1].starts, 0);
}

}  // namespace
}  // namespace turbidock::experiments
