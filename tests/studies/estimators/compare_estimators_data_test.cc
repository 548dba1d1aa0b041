// Estimators side by side on painted frames: the budget, and that all of them repeat.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "experiments/media/png.h"
#include "experiments/studies/estimators/compare_estimators.h"
#include "tests/support/message_of.h"
#include "tests/support/paint_marker.h"

namespace turbidock::estimators {
namespace {

TEST(CompareEstimators, EachSpendsItsBudgetRepeatsAndClimbs) {
  trial::Scenario scenario = recognition::RecognitionScenario(recognition::MarkerKind::kActive, {});
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

TEST(CompareEstimators, ANameMayCarryKeysOfTheSearch) {
  trial::Scenario scenario = recognition::RecognitionScenario(recognition::MarkerKind::kActive, {});
  const StereoImage blank{{Image3u8(640, 480, 8), Image3u8(640, 480, 8)}};
  const auto evaluations = [&](const std::string& name) {
    return MakeEstimator(name, scenario, 3)->Update(blank).evaluations;
  };
  EXPECT_EQ(evaluations("default"), 60 + 20 * 24 - 1);  // nothing to refine
  EXPECT_EQ(evaluations("default/population=50/generations_per_frame=3"), 50 + 3 * 20 - 1);
  EXPECT_EQ(evaluations("published/generations_per_frame=20"), 60 + 20 * 24);
  const auto problem = [&](const std::string& name) -> std::string {
    try {
      MakeEstimator(name, scenario, 3);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(problem("default/creep_shar=0"), HasSubstr("creep_share"));
  EXPECT_THAT(problem("default/creep_share=2"), HasSubstr("creep_share"));
  EXPECT_THAT(problem("default/"), HasSubstr("KEY=VALUE"));
  EXPECT_THAT(problem("de/creep_share=0"), HasSubstr("'de/creep_share=0' is not known"));
}

TEST(CompareEstimators, RanksTellWhetherFitnessTellsTheError) {
  CompareRow row;
  row.estimator = "default";
  row.errors_m = {0.1, 0.2, 0.3, 0.4};
  row.fitness = {0.9, 0.8, 0.2, 0.1};
  CompareRow other = row;
  other.cell.marker = recognition::MarkerKind::kPassive;
  other.fitness = {0.1, 0.2, 0.3, 0.4};
  EXPECT_DOUBLE_EQ(
      FitnessErrorCorrelation({row, other}, recognition::MarkerKind::kActive, "default"), -1);
  row.fitness = {0.1, 0.2, 0.7, 0.8};
  EXPECT_DOUBLE_EQ(FitnessErrorCorrelation({row}, recognition::MarkerKind::kActive, "default"), 1);
  row.fitness = {0.5, 0.5, 0.5, 0.5};
  EXPECT_DOUBLE_EQ(FitnessErrorCorrelation({row}, recognition::MarkerKind::kActive, "default"), 0);
}

TEST(CompareEstimators, FramesByWhichAShareIsFound) {
  EXPECT_EQ(FrameBy(0.5, {9, 3, 1, 5}, 4), 3);
  EXPECT_EQ(FrameBy(0.95, {9, 3, 1, 5}, 4), 9);
  EXPECT_EQ(FrameBy(0.5, {9, 3, 1}, 6), 9);  // half of them never
  EXPECT_EQ(FrameBy(0.95, {9, 3, 1}, 6), std::nullopt);
  EXPECT_EQ(FrameBy(0.5, {}, 1), std::nullopt);
}

TEST(CompareEstimators, BinsTellWhatAFitnessIsWorth) {
  CompareRow row;
  row.estimator = "default";
  row.fitness = {-0.2, 0.1, 0.22, 0.6, 0.65, 0.69, 0.95, 1};
  row.errors_m = {0.3, 0.5, 0.2, 0.001, 0.002, 0.003, 0.004, 0.005};
  row.rotations_rad = {0.1, 0.3, 0.2, 0.01, 0.02, 0.03, 0.04, 0.05};
  row.is_found = {false, false, false, true, true, false, true, true};
  CompareRow other = row;
  other.cell.marker = recognition::MarkerKind::kPassive;
  const std::vector<FitnessBin> bins =
      FitnessBins({row, other}, recognition::MarkerKind::kActive, "default");
  ASSERT_EQ(bins.size(), 4u);  // none from 0.7 to 0.9
  const auto expect = [](const FitnessBin& bin, double low, double high, int found, int starts) {
    EXPECT_EQ(bin.low, low);
    EXPECT_EQ(bin.high, high);
    EXPECT_EQ(bin.found, found);
    EXPECT_EQ(bin.starts, starts);
  };
  expect(bins[0], -0.2, 0.22, 0, 2);
  expect(bins[1], 0.22, 0.6, 0, 1);
  expect(bins[2], 0.6, 0.7, 2, 3);
  expect(bins[3], 0.9, 1, 2, 2);
  EXPECT_DOUBLE_EQ(bins[2].error_median_m, 0.002);
  EXPECT_NEAR(bins[2].error_95_m, 0.0029, 1e-12);
  EXPECT_DOUBLE_EQ(bins[2].rotation_median_rad, 0.02);
  EXPECT_NEAR(bins[2].rotation_95_rad, 0.029, 1e-12);
  EXPECT_TRUE(FitnessBins({row}, recognition::MarkerKind::kActive, "blobs").empty());
}

TEST(CompareEstimators, RunsACell) {
  CompareOptions options;
  options.markers = {recognition::MarkerKind::kActive};
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
  ASSERT_TRUE(rows[0].frames_median && rows[0].frames_95);
  EXPECT_GE(*rows[0].frames_median, 1);
  EXPECT_GE(*rows[0].frames_95, *rows[0].frames_median);
  EXPECT_LE(*rows[0].frames_95, 15);
  EXPECT_EQ(rows[1].frames_median.has_value(), rows[1].found > 0);

  // A row of panels for the place; of one estimator, one for the marker.
  const std::string figure =
      (std::filesystem::temp_directory_path() / "turbidock_compare_estimators.png").string();
  for (const auto& shown : {rows, std::vector<CompareRow>{rows[0]}}) {
    WriteCompareFigure(figure, shown);
    const Image3u8 image = media::ReadPng(figure);
    EXPECT_EQ(image.width(), 1500);
    EXPECT_EQ(image.height(), 360);
    std::filesystem::remove(figure);
  }
  EXPECT_THAT(CompareText(rows), ::testing::HasSubstr("what F tells"));
}

// Tags are judged where there are any, beside the balls on the same images.
TEST(CompareEstimators, ReadsTagsOfTheFiducialMarkerAlone) {
  CompareOptions options;
  options.markers = {recognition::MarkerKind::kPassive, recognition::MarkerKind::kFiducial};
  options.distances_m = {0.6};
  options.milk_ml_m3 = {5};
  options.estimators = {"fiducial", "blobs"};
  options.starts = 2;
  options.frames = 2;
  const std::vector<CompareRow> rows = CompareEstimators(options);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].estimator, "blobs");
  EXPECT_EQ(rows[1].estimator, "fiducial");
  EXPECT_EQ(rows[1].cell.marker, recognition::MarkerKind::kFiducial);
  EXPECT_EQ(rows[1].found, 2);
  EXPECT_LT(rows[1].error_median_m, 0.01);
  EXPECT_EQ(rows[1].fitness_mean, 1);
  EXPECT_EQ(rows[2].estimator, "blobs");
  options.estimators = {"fiducial"};
  EXPECT_THAT(
      testing::MessageOf([&] { CompareEstimators(options); }),
      ::testing::HasSubstr("'fiducial' needs tags, which the passive marker does not have"));
}

TEST(CompareEstimators, SaysWhenTooFewAreFound) {
  CompareOptions options;
  options.markers = {recognition::MarkerKind::kPassive};
  options.distances_m = {0.8};
  options.milk_ml_m3 = {1000};  // white
  options.estimators = {"default"};
  options.starts = 2;
  options.frames = 2;
  const std::vector<CompareRow> rows = CompareEstimators(options);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].found, 0);
  EXPECT_EQ(rows[0].misses.size(), 2u);
  EXPECT_FALSE(rows[0].frames_median || rows[0].frames_95);
}

TEST(CompareEstimators, TellsAnAbsentMarkerFromAMovingOne) {
  CompareOptions options;
  options.markers = {recognition::MarkerKind::kActive};
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
  EXPECT_FALSE(moving[0].frames_median);  // its task is not to find
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
  options.markers = {recognition::MarkerKind::kPassive};
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
}  // namespace turbidock::estimators
