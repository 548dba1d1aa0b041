// Estimators from cold starts: who is right, who is wrong and sure of it, and what the report and
// the command make of it.

#include "experiments/studies/estimators/compare_estimators.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/message_of.h"
#include "tests/support/program.h"

namespace turbidock::estimators {
namespace {

using ::testing::HasSubstr;

// One cell at 0.6 m.
CompareOptions Brief(const std::string& scenario, double milk_ml_m3) {
  CompareOptions options;
  options.scenarios = {scenario};
  options.distances_mm = {600};
  options.milk_ml_m3 = {milk_ml_m3};
  options.starts = 2;
  options.frames = 15;
  return options;
}

TEST(CompareEstimators, CountsByHand) {
  CompareCell cell;
  for (const auto& [is_sure, error_m, rotation_rad] : {std::tuple{true, 0.001, 0.01},
                                                       {true, 0.02, 0.08},
                                                       {true, 0.021, 0.01},
                                                       {true, 0.01, 0.1},
                                                       {false, 0.001, 0.001},
                                                       {false, 1.0, 1.0}})
    cell.each.push_back({.is_sure = is_sure, .error_m = error_m, .rotation_rad = rotation_rad});
  Summarise({}, &cell);
  EXPECT_EQ(cell.starts, 6);
  EXPECT_EQ(cell.right, 2);
  EXPECT_EQ(cell.wrong_and_sure, 2);
  EXPECT_EQ(cell.not_found, 2);
  EXPECT_DOUBLE_EQ(cell.error_median_m.value(), 0.015);  // of those that are sure
  EXPECT_DOUBLE_EQ(cell.rotation_median_rad.value(), 0.045);
  EXPECT_LT(cell.right_interval.low, 2.0 / 6);
  EXPECT_GT(cell.right_interval.high, 2.0 / 6);

  CompareCell none;
  none.each = {{.is_sure = false, .error_m = 0.001}};
  Summarise({}, &none);
  EXPECT_EQ(none.not_found, 1);
  EXPECT_FALSE(none.error_median_m);
}

TEST(CompareEstimators, JudgesTheSameImages) {
  CompareOptions options = Brief("pool_active", 10);
  options.estimators = {"rm_ga", "blobs"};
  const std::vector<CompareCell> cells = CompareEstimators(options);
  ASSERT_EQ(cells.size(), 2u);
  EXPECT_EQ(cells[0].estimator, "rm_ga");
  EXPECT_EQ(cells[0].right, 2);
  // the demand on clear water at this distance, with milk
  EXPECT_LT(cells[0].error_median_m.value(), 0.001);
  EXPECT_LT(cells[0].rotation_median_rad.value(), 0.0087);
  EXPECT_LT(cells[0].error_median_m, cells[1].error_median_m);
  EXPECT_GT(cells[0].frame_s.value(), 0);
  EXPECT_EQ(cells[0].each[1].seed, cells[0].each[0].seed + 1);
  EXPECT_NE(cells[0].each[1].error_m, cells[0].each[0].error_m);

  // whoever makes them: the same but for the times, and alone as beside others
  options.jobs.workers = 2;
  options.estimators = {"rm_ga"};
  const std::vector<CompareCell> again = CompareEstimators(options);
  ASSERT_EQ(again.size(), 1u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(again[0].each[i].error_m, cells[0].each[i].error_m);
    EXPECT_EQ(again[0].each[i].fitness, cells[0].each[i].fitness);
  }

  const report::Report report = ReportOf(cells);
  EXPECT_EQ(report.kind, "estimators");
  ASSERT_EQ(report.facts.size(), 2u);
  EXPECT_EQ(report.facts[1].label, "rm_ga");
  EXPECT_EQ(report.facts[1].value, "2 of 2 right");
  ASSERT_EQ(report.sections.size(), 1u);
  ASSERT_EQ(report.sections[0].table->rows().size(), 2u);
  const std::vector<report::Cell>& row = report.sections[0].table->rows()[0];
  EXPECT_EQ(row.at(1).text, "600");
  EXPECT_EQ(row.at(4).text, "2/2");
  EXPECT_EQ(row.at(8).text, report::Fixed(1000 * *cells[0].error_median_m, 1));
}

// In white water nothing is found, and nobody is sure.
TEST(CompareEstimators, SaysWhatIsNotFound) {
  CompareOptions options = Brief("pool_passive", 1000);
  options.frames = 2;
  const std::vector<CompareCell> cells = CompareEstimators(options);
  ASSERT_EQ(cells.size(), 1u);
  EXPECT_EQ(cells[0].estimator, "rm_ga");  // the scenario's own
  EXPECT_EQ(cells[0].not_found, 2);
  EXPECT_FALSE(cells[0].error_median_m);
}

// A camera that has been turned aside since the calibration: every estimate is off.
TEST(CompareEstimators, FaultsOfTheScenarioAreInTheImages) {
  CompareOptions options = Brief("pool_active", 0);
  EXPECT_EQ(CompareEstimators(options)[0].right, 2);
  options.assignments = {"faults.misalignments=[{camera: left, yaw_pitch_roll_rad: [0.02, 0, 0]}]"};
  const CompareCell misaligned = CompareEstimators(options)[0];
  EXPECT_EQ(misaligned.right, 0);
  EXPECT_EQ(misaligned.wrong_and_sure, 2);
}

TEST(CompareEstimators, ReadsTagsWhereThereAreAny) {
  CompareOptions options = Brief("pool_fiducial", 5);
  options.estimators = {"fiducial"};
  options.frames = 2;
  const std::vector<CompareCell> cells = CompareEstimators(options);
  EXPECT_EQ(cells[0].right, 2);
  EXPECT_LT(cells[0].error_median_m.value(), 0.01);
  EXPECT_EQ(cells[0].each[0].fitness, 1);
  options.scenarios = {"pool_passive"};
  EXPECT_THAT(testing::MessageOf([&] { CompareEstimators(options); }), HasSubstr("tag"));
}

TEST(CompareEstimators, RefusesWhatCannotBeCompared) {
  CompareOptions options = Brief("pool_active", 0);
  options.estimators = {"best"};
  EXPECT_THAT(testing::MessageOf([&] { CompareEstimators(options); }),
              HasSubstr("must be one of rm_ga, blobs, fiducial"));
  options = Brief("pool_active", 0);
  options.assignments = {"pose_source=true_pose"};
  EXPECT_THAT(testing::MessageOf([&] { CompareEstimators(options); }),
              HasSubstr("pose_source: must be cameras"));
}

TEST(CompareEstimatorsCommand, PrintsADocument) {
  const turbidock::testing::ProgramEnd end = turbidock::testing::RunProgram(
      {"compare-estimators", "pool_active", "--distances", "600", "--milk", "0", "--starts", "1",
       "--frames", "2", "--json", "--quiet"});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  const auto json = nlohmann::json::parse(end.out);
  EXPECT_EQ(json.at("kind"), "estimators");
  EXPECT_EQ(json.at("cells").size(), 1u);
  for (const char* key : {"scenario", "distance_mm", "milk_ml_m3", "estimator", "starts", "right",
                          "wrong_and_sure", "not_found", "error_median_m", "each"})
    EXPECT_TRUE(json["cells"][0].contains(key)) << key;
}

}  // namespace
}  // namespace turbidock::estimators
