// The recognition experiment: tables, comparison, cells.

#include "experiments/studies/recognition/recognition.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "experiments/batch/result_store.h"
#include "experiments/media/png.h"
#include "experiments/statistics/intervals.h"
#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/table.h"
#include "experiments/trial/world.h"
#include "tests/support/message_of.h"
#include "tests/support/program.h"

namespace turbidock::recognition {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class TableFile : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  std::vector<TableRow> Read(const std::string& text) {
    std::ofstream(path_) << text;
    return ReadRecognitionTable(path_, MarkerKind::kActive);
  }
  std::string Complaint(const std::string& text) {
    try {
      Read(text);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "none";
  }

  const std::string path_ =
      (std::filesystem::temp_directory_path() / "turbidock_table.csv").string();
};

TEST_F(TableFile, IsReadByColumnNames) {
  const auto rows =
      Read("distance_mm,ftu,fitness_mean,milk_ml_m3\r\n400,1.5,0.25,2.43\r\n\r\n1000,,-0.1,0\r\n");
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].cell, (RecognitionCell{MarkerKind::kActive, 2.43, 0.4}));
  EXPECT_EQ(rows[0].fitness_mean, 0.25);
  EXPECT_EQ(rows[1].cell, (RecognitionCell{MarkerKind::kActive, 0, 1.0}));
}

TEST_F(TableFile, ComplaintsNameLineAndColumn) {
  const std::string head = "milk_ml_m3,distance_mm,fitness_mean\n0,400,0.5\n";
  for (const auto& [text, said] : std::vector<std::pair<std::string, std::string>>{
           {"", "turbidock_table.csv: is empty"},
           {"milk_ml_m3,distance_mm\n0,400\n", ":1: fitness_mean: this column is missing"},
           {"milk_ml_m3,distance_mm,fitnes_mean\n0,400,1\n", "is it fitnes_mean?"},
           {"milk_ml_m3,milk_ml_m3,distance_mm,fitness_mean\n0,0,400,1\n", "occurs twice"},
           {head + "1,400\n", ":3: 2 columns, the header has 3"},
           {head + "1,400,x\n", ":3: fitness_mean = 'x', must be a number"},
           {head + "1,400," + std::string(1000, '9') + "\n", "'" + std::string(60, '9') + "...'"},
           {head + std::string("1,400,0\0\n", 9), ":3: holds a control character (0x00)"},
           {"milk\xe9\n", ":1: is no UTF-8 text (byte 0xe9)"},
           {head + "1,400,\n", ":3: fitness_mean = '', must be a number"},
           {head + "1 2,400,0\n", ":3: milk_ml_m3 = '1 2', must be a number"},
           {head + "-1,400,0\n", ":3: milk_ml_m3 = -1, must be in [0, 2000]"},
           {head + "nan,400,0\n", ":3: milk_ml_m3 = nan, must be in [0, 2000]"},
           {head + "1,0.4,0\n", ":3: distance_mm = 0.4, must be in [200, 10000]"},
           {head + "1,400,1.5\n", ":3: fitness_mean = 1.5, must be in [-1, 1]"},
           {head + "0,400,0.4\n", ":3: 0 ml/m3 at 400 mm occurs twice"},
           {"milk_ml_m3,distance_mm,fitness_mean\n", "no rows"}})
    EXPECT_THAT(Complaint(text), HasSubstr(said)) << text;
}

TEST_F(TableFile, BeginsWithAByteOrderMarkOrNot) {
  EXPECT_EQ(Read("\xef\xbb\xbfmilk_ml_m3,distance_mm,fitness_mean\n0,400,0.5\n").size(), 1u);
}

TEST_F(TableFile, IsAFile) {
  EXPECT_THAT(testing::MessageOf([] { ReadRecognitionTable("/dev/zero", MarkerKind::kActive); }),
              HasSubstr("/dev/zero: cannot be read: it is no regular file"));
}

// Milk at F = 0.22 of the published columns, worked out by hand from three-point means.
TEST(MilkAtLoss, OfThePublishedTables) {
  const auto loss = [](MarkerKind marker, double distance_m) {
    Curve column;
    for (const TableRow& row : PublishedTable(marker))
      if (row.cell.distance_m == distance_m) column[row.cell.milk_ml_m3] = row.fitness_mean;
    return MilkAtLoss(column).value();
  };
  EXPECT_NEAR(loss(MarkerKind::kActive, 0.4), 215.7, 0.1);
  EXPECT_NEAR(loss(MarkerKind::kActive, 1.0), 61.2, 0.1);
  EXPECT_NEAR(loss(MarkerKind::kPassive, 0.4), 107.9, 0.1);
  EXPECT_NEAR(loss(MarkerKind::kPassive, 1.0), 19.3, 0.1);
}

TEST(MilkAtLoss, NeedsACrossing) {
  EXPECT_FALSE(MilkAtLoss({}));
  EXPECT_FALSE(MilkAtLoss({{0, 0.9}, {10, 0.8}}));
  EXPECT_FALSE(MilkAtLoss({{0, 0.1}, {10, 0.0}}));
  // two-point means 0.5 and 0.0 at the ends, 0.3 in the middle
  EXPECT_DOUBLE_EQ(MilkAtLoss({{0, 0.9}, {10, 0.1}, {20, -0.1}}).value(), 10 + 10 * 0.08 / 0.3);
}

TEST(Areas, BeginAtThePublishedLimits) {
  EXPECT_EQ(AreaOf(0.60), Area::kI);
  EXPECT_EQ(AreaOf(std::nextafter(0.60, 0)), Area::kII);
  EXPECT_EQ(AreaOf(0.22), Area::kII);
  EXPECT_EQ(AreaOf(std::nextafter(0.22, 0)), Area::kIII);
}

TEST(Comparison, CountsByHand) {
  const auto row = [](double milk, double mean) {
    return TableRow{{MarkerKind::kActive, milk, 0.4}, mean};
  };
  const auto result = [](double milk, double mean) {
    return CellResult{.cell = {MarkerKind::kActive, milk, 0.4}, .fitness_mean = mean};
  };
  // what only one of both has does not count
  const TableComparison c =
      Compare({result(0, 0.7), result(1, 0.5), result(2, -0.1), result(3, -0.2)},
              {row(0, 0.8), row(1, 0.7), row(2, 0.1), row(4, 0)})
          .value();
  EXPECT_NEAR(c.rmse, std::sqrt((0.01 + 0.04 + 0.04) / 3), 1e-12);
  EXPECT_NEAR(c.area_agreement, 2.0 / 3, 1e-12);
  EXPECT_TRUE(c.loss_by_distance_m.at(0.4).simulated_ml_m3);
  EXPECT_FALSE(Compare({result(3, 1)}, {row(4, 0)}));
}

// The active marker 0.6 m ahead.
batch::Plan PlanOf(const std::string& milk, const std::string& more = "",
                   const std::string& set = "") {
  return {
      "schema_version: 1\nscenario: pool_active\nset: {trial.scene: tank_active.xml, "
      "cameras.optics: published, "
      "start: {distance_min_m: 0.6, distance_max_m: 0.6, lateral_m: 0, vertical_m: 0, heading_rad: "
      "0}" +
          set + "}\ngrid: {water.milk_ml_m3: [" + milk + "]}\n" + more,
      "plan"};
}

void ExpectSame(const CellResult& x, const CellResult& y) {
  EXPECT_EQ(x.cell, y.cell);
  EXPECT_EQ(x.fitness, y.fitness);
  EXPECT_EQ(x.fitness_mean, y.fitness_mean);
  EXPECT_EQ(x.position_error_mean_m, y.position_error_mean_m);
  EXPECT_EQ(x.last_X_HM.p, y.last_X_HM.p);
  EXPECT_EQ(x.last_X_HM.q.coeffs(), y.last_X_HM.q.coeffs());
}

// Whatever else is in the plan, in whatever order, by however many workers.
TEST(Recognition, CellsAreIndependent) {
  const RecognitionOptions brief{.seconds = 0.1, .settle_s = 0.1};
  RecognitionOptions shared = brief;
  shared.jobs.workers = 3;
  const auto both = Recognize(PlanOf("10, 200"), brief);
  const auto turned = Recognize(PlanOf("200, 10"), shared);
  ASSERT_EQ(both.size(), 2u);
  ASSERT_EQ(turned.size(), 2u);
  EXPECT_EQ(both[0].cell, (RecognitionCell{MarkerKind::kActive, 10, 0.6}));
  ExpectSame(both[0], turned[1]);
  ExpectSame(both[1], turned[0]);
  EXPECT_NE(both[0].fitness, both[1].fitness);
  EXPECT_EQ(both[0].fitness.size(), 3u);
}

// An interrupted run goes on, with the same plan and time only.
TEST(Recognition, GoesOnWithItsFile) {
  const std::string file =
      (std::filesystem::temp_directory_path() / "turbidock_recognition.db").string();
  std::filesystem::remove(file);
  RecognitionOptions kept{.seconds = 0.1, .settle_s = 0.1, .file = file};
  const auto whole = Recognize(PlanOf("10, 50, 200"), {.seconds = 0.1, .settle_s = 0.1});
  int done = 0;
  kept.on_progress = [&](int so_far, int) { done = so_far; };
  kept.stop_requested = [&] { return done > 0; };
  EXPECT_TRUE(Recognize(PlanOf("10, 50, 200"), kept).empty());
  EXPECT_LT(done, 3);
  kept.stop_requested = {};
  const auto again = Recognize(PlanOf("10, 50, 200"), kept);
  ASSERT_EQ(again.size(), 3u);
  for (size_t i = 0; i < 3; ++i) ExpectSame(again[i], whole[i]);
  EXPECT_THROW(Recognize(PlanOf("10, 50"), kept), batch::OtherResults);
  EXPECT_THAT(testing::MessageOf([&] { Recognize(PlanOf("10, 50"), kept); }),
              ::testing::EndsWith(". Write elsewhere or finish it as it was begun"));
  kept.seconds = 0.2;
  EXPECT_THROW(Recognize(PlanOf("10, 50, 200"), kept), batch::OtherResults);
  std::filesystem::remove(file);
}

// The bundled plans are the published experiment, as the calibration has it.
TEST(Recognition, ItsPlansAreTheCalibrations) {
  for (const auto& [marker, name] : EnumNames<MarkerKind>::kNames) {
    const batch::Plan plan = batch::LoadPlan(std::string("recognition_") + name);
    std::set<RecognitionCell> cells;
    for (int64_t trial = 0; trial < plan.trials(); ++trial) {
      trial::Scenario scenario = plan.ScenarioOf(plan.Trial(trial));
      const RecognitionCell cell = CellOf(scenario);
      EXPECT_EQ(cell.marker, marker);
      cells.insert(cell);
      trial::Scenario expected =
          RecognitionScenario(marker, {"water.milk_ml_m3=" + FormatNumber(cell.milk_ml_m3),
                                       "trial.seed=" + std::to_string(scenario.seed)});
      EXPECT_EQ(trial::StartPose(scenario).p, Eigen::Vector3d(-cell.distance_m, 0, 0));
      expected.start = scenario.start;
      scenario.model_files.clear();
      EXPECT_EQ(trial::SaveScenario(scenario), trial::SaveScenario(expected)) << trial;
    }
    EXPECT_EQ(std::ssize(cells), plan.trials());
    for (const TableRow& row : PublishedTable(marker)) EXPECT_TRUE(cells.contains(row.cell));
  }
}

// Any estimator of a scenario: who is right, and who is wrong and sure of it.
TEST(Recognition, ComparesEstimators) {
  const auto run = [](const std::string& set, const std::string& milk) {
    return Recognize(PlanOf(milk, "", set), {.seconds = 0.2, .settle_s = 0.5})[0];
  };
  const CellResult search = run("", "10"), blobs = run(", estimator.use: blobs", "10"),
                   blind = run("", "1000");
  EXPECT_EQ(search.right, 1);
  EXPECT_EQ(search.wrong_and_sure, 0);
  EXPECT_LT(search.position_error_mean_m, 0.001);
  EXPECT_GT(blobs.position_error_mean_m, search.position_error_mean_m);
  EXPECT_EQ(blind.right + blind.wrong_and_sure, 0);  // not found
}

// A pose that has found two balls of three has the F of a marker in sight, and is not sure.
TEST(Recognition, IsSureWhereTheEstimatorIs) {
  const batch::Plan plan =
      PlanOf("50", "cases: {1 m: {start.distance_min_m: 1, start.distance_max_m: 1}}\n");
  const CellResult cell = Recognize(plan, {.seconds = 0.5, .settle_s = 0.5})[0];
  EXPECT_EQ(cell.name, "1 m");
  EXPECT_GE(cell.fitness_mean, plan.ScenarioOf(plan.Trial(0)).procedure.lost_fitness);
  EXPECT_EQ(cell.wrong_and_sure, 0);
}

// The report says what the results say: limits and Areas worked out by hand.
class RecognitionReport : public ::testing::Test {
 protected:
  static CellResult Result(double milk, double mean) {
    CellResult result{.cell = {MarkerKind::kActive, milk, 0.4}};
    SetFitness({static_cast<float>(mean), static_cast<float>(mean)}, &result);
    return result;
  }
  static TableRow Row(double milk, double mean) { return {{MarkerKind::kActive, milk, 0.4}, mean}; }
  const std::vector<CellResult> results_ = {Result(0, 0.8), Result(20, 0.7), Result(40, 0.3),
                                            Result(100, -0.1)};
};

TEST_F(RecognitionReport, DrawsCurves) {
  const std::vector<TableRow> table = {Row(0, 0.9), Row(20, 0.5), Row(40, 0.1), Row(100, 0)};
  const report::Report report = ReportOf(results_, table);
  ASSERT_EQ(report.sections.size(), 3u);  // F over milk, the marker's tables
  const report::Panel& fitness = report.sections[0].panels.at(0);
  ASSERT_EQ(fitness.series.size(), 2u);  // the run and the table
  EXPECT_EQ(fitness.series[0].points[2].x, 40);
  EXPECT_NEAR(fitness.series[0].points[2].y, 0.3, 1e-6);
  EXPECT_EQ(fitness.series[0].mark, report::Mark::kLineWithBars);  // which has dots where measured
  EXPECT_EQ(fitness.series[1].points[2].y, 0.1);
  ASSERT_EQ(report.sections[1].table->rows().size(), 4u);
  EXPECT_THAT(report.sections[1].table->Text(), HasSubstr("0.30 II (table 0.10)"));
  EXPECT_THAT(report.sections[2].table->Text(), HasSubstr("40.0   0 / 0"));
  EXPECT_EQ(report.facts[0].label, "RMSE of mean F");
  EXPECT_EQ(report.facts[0].value, "0.158");  // root of (0.01 + 0.04 + 0.04 + 0.01) / 4
}

TEST_F(RecognitionReport, SaysHowTurbidItMayBe) {
  const auto limit = [](const std::vector<CellResult>& results) {
    return ReportOf(results, {Row(0, 0.9), Row(20, 0.5)}).facts.back();
  };
  // three-point means 0.75, 0.6, 0.3, 0.1: 0.22 is 0.4 of the way from 40 to 100
  EXPECT_EQ(ReportOf(results_, {}).facts.at(0).value, "64 ml/m³");
  EXPECT_EQ(limit(results_).label, "turbidity limit, active at 400 mm");
  EXPECT_EQ(limit({Result(0, 0.8), Result(20, 0.7)}).value, "beyond 20 ml/m³");
  EXPECT_EQ(limit({Result(5, 0.1), Result(20, 0)}).value, "lost at 5 ml/m³, the least tried");
  EXPECT_EQ(limit({Result(0, 0.8), Result(20, 0.7)}).note, "the table: beyond 20 ml/m³");
  // lost by its cells, not by their means of three
  const std::vector<CellResult> few = {Result(0, 0.85), Result(40, 0.53), Result(120, 0.04)};
  EXPECT_EQ(ReportOf(few, {}).facts.at(0).value, "40 to 120 ml/m³");
}

// Several trials of a cell are one; cells of another name are others, from whatever distance.
TEST_F(RecognitionReport, HasAColumnForEachCellOfThePlan) {
  std::vector<CellResult> results = {Result(0, 0.8), Result(0, 0.4), Result(0, 0.1)};
  results[2].name = "dim";
  const Columns columns = ColumnsOf(results, {Row(0, 0.9)}).at(MarkerKind::kActive);
  ASSERT_EQ(columns.size(), 2u);
  EXPECT_EQ(columns[0].name, "400 mm");
  EXPECT_NEAR(columns[0].simulated.at(0), 0.6, 1e-6);
  EXPECT_EQ(columns[0].cells.at(0).fitness.size(), 4u);
  EXPECT_EQ(columns[1].name, "dim");
  EXPECT_NEAR(columns[1].simulated.at(0), 0.1, 1e-6);
  EXPECT_EQ(columns[1].reference.at(0), 0.9);
}

// More milk is brighter, as the cameras see it: all images of a sheet have one contrast.
TEST(ImageSheet, ImagesCanBeCompared) {
  const std::string path =
      (std::filesystem::temp_directory_path() / "turbidock_sheet.png").string();
  const batch::Plan plan(
      "schema_version: 1\nscenario: pool_passive\nset: {trial.scene: tank_passive.xml, "
      "cameras.optics: "
      "published, "
      "start: {distance_min_m: 0.4, distance_max_m: 0.4, lateral_m: 0, vertical_m: 0, heading_rad: "
      "0}}\ngrid: {water.milk_ml_m3: [40, 120]}\n",
      "plan");
  std::vector<CellResult> results;
  for (const int64_t trial : {0, 1}) {
    results.push_back({.cell = CellOf(plan.ScenarioOf(plan.Trial(trial))), .trial = trial});
    SetFitness({0.5F}, &results.back());
  }
  results.push_back({.cell = {MarkerKind::kActive, 80, 0.4}});  // is on another sheet
  WriteImageSheet(path, plan, MarkerKind::kPassive, results);
  const Image3u8 sheet = media::ReadPng(path);
  std::filesystem::remove(path);
  ASSERT_EQ(sheet.width(), 90 + 2 * 496);
  // what nine tenths of an image are brighter than: the veil, which a stretch of its own hides
  const auto veil = [&](int column) {
    std::vector<double> green;
    for (int v = 26; v < 26 + 180; ++v)
      for (int u = 0; u < 240; ++u) green.push_back(sheet.at(90 + 496 * column + u, v)[1]);
    return *statistics::Quantile(std::move(green), 0.1);
  };
  EXPECT_GT(veil(1), 1.5 * veil(0));
}

TEST(RecognizeCommand, PrintsTheDocumentedKeys) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  const std::string table = folder / "turbidock_table.csv", plan = folder / "turbidock_tank.yaml";
  std::ofstream(table) << "milk_ml_m3,distance_mm,fitness_mean\n5,600,0.8\n300,600,0.1\n";
  std::ofstream(plan)
      << "schema_version: 1\nscenario: pool_passive\n"
         "set: {trial.scene: tank_passive.xml, cameras.optics: published, start: "
         "{distance_min_m: 0.6, distance_max_m: 0.6, lateral_m: 0, vertical_m: 0}}\n"
         "grid: {water.milk_ml_m3: [5, 300]}\n";
  const turbidock::testing::ProgramEnd end = turbidock::testing::RunProgram(
      {"recognize", plan, "--passive", table, "--seconds", "0.1", "--json"});
  for (const std::string& file : {table, plan}) std::filesystem::remove(file);
  ASSERT_EQ(end.exit_code, 0) << end.err;
  EXPECT_THAT(end.err, HasSubstr("turbidock_tank: 2 trials of 0.1 s"));
  const auto json = nlohmann::json::parse(end.out);
  EXPECT_EQ(json.at("kind"), "recognition");
  for (const char* key : {"rmse", "area_agreement", "loss_milk_ratio", "loss_milk_ml_m3",
                          "lost_fitness_error", "fitness_std"})
    EXPECT_TRUE(json.at("tables").at("passive").contains(key)) << key;
  ASSERT_EQ(json["cells"].size(), 2u);
  for (const char* key :
       {"marker", "milk_ml_m3", "distance_mm", "trial", "name", "fitness_mean", "fitness_std",
        "area", "position_error_mean_m", "right", "wrong_and_sure", "reference_mean"})
    EXPECT_TRUE(json["cells"][0].contains(key)) << key;
  EXPECT_EQ(json["cells"][0]["distance_mm"], 600);
  EXPECT_TRUE(json["tables"]["passive"]["loss_milk_ratio"].contains("600"));
}

// F of a tag is 1 or -1: it is read or not.
TEST(RecognizeCommand, ComparesTheTablesFWithThatOfTheSameEstimatorAlone) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  const std::string plan = folder / "turbidock_tags.yaml";
  const auto facts_with = [&](const std::string& scenarios) {
    std::ofstream(plan)
        << "schema_version: 1\nset: {water.milk_ml_m3: 2.43, cameras.optics: published, start: "
           "{distance_min_m: 0.4, distance_max_m: 0.4, lateral_m: 0, vertical_m: 0, heading_rad: "
           "0}}\ngrid: {scenario: " +
               scenarios + "}\n";
    return turbidock::testing::RunProgram({"recognize", plan, "--seconds", "0.1"}).out;
  };
  EXPECT_THAT(facts_with("[pool_passive]"), HasSubstr("against the table"));
  EXPECT_THAT(facts_with("[pool_passive, pool_fiducial]"),
              AllOf(HasSubstr("Recognition of the marker"), Not(HasSubstr("the table"))));
  std::filesystem::remove(plan);
}

TEST(RecognizeCommand, RefusesBadInput) {
  for (const auto& [arguments, said] :
       std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"--set", "water.scattering_scale=9"}, "must be in [0.1, 3]"},
           {{"--set", "estimator.pose_source=true_pose"}, "estimator.pose_source: must be cameras"},
           {{"--set", "estimator.use=best"}, "must be one of rm_ga, blobs, fiducial"},
           {{"--active", "no.csv"}, "no.csv: cannot be read"}}) {
    std::vector<std::string> all = {"recognize", "recognition_active"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const turbidock::testing::ProgramEnd end = turbidock::testing::RunProgram(all);
    EXPECT_EQ(end.exit_code, 2) << said;
    EXPECT_EQ(end.out, "");
    EXPECT_THAT(end.err, HasSubstr(said));
  }
  EXPECT_THAT(turbidock::testing::RunProgram({"recognize", "turbidity_sweep"}).err,
              HasSubstr("turbidity_sweep.yaml:5: precision: recognition has no success rate"));
}

}  // namespace
}  // namespace turbidock::recognition
