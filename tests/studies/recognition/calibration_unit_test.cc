#include "experiments/studies/recognition/calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <thread>

#include "experiments/batch/result_store.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/report/json.h"
#include "tests/support/message_of.h"

namespace turbidock::recognition {
namespace {

FreeParameter Parameter(double low, double high, bool logarithmic) {
  FreeParameter p;
  p.key = "water.scattering_scale";
  p.low = p.start = low;
  p.high = high;
  p.logarithmic = logarithmic;
  return p;
}

TEST(FreeParameter, PlacesAndValuesAreInverse) {
  for (const bool logarithmic : {false, true}) {
    const FreeParameter p = Parameter(0.5, 32, logarithmic);
    EXPECT_DOUBLE_EQ(p.ValueAt(0), 0.5);
    EXPECT_DOUBLE_EQ(p.ValueAt(1), 32);
    for (const double place : {0.1, 0.5, 0.77})
      EXPECT_NEAR(p.PlaceOf(p.ValueAt(place)), place, 1e-12);
  }
  EXPECT_DOUBLE_EQ(Parameter(0.5, 32, true).ValueAt(0.5), 4);
  CalibrationPlan plan;
  plan.parameters = {Parameter(0.5, 32, true)};
  EXPECT_EQ(plan.Assignments({4.123456789}),
            std::vector<std::string>{"water.scattering_scale=4.1235"});
}

TEST(FreeParameter, RefusesAnEmptyRange) {
  EXPECT_THROW(CheckFields(Parameter(2, 1, false), "p"), ConfigError);
  EXPECT_THROW(CheckFields(Parameter(0, 1, true), "p"), ConfigError);
  FreeParameter outside = Parameter(0, 1, false);
  outside.start = 2;
  EXPECT_THROW(CheckFields(outside, "p"), ConfigError);
}

// The bundled plan's keys are a scenario's, and what calibrate writes is read back as it was.
TEST(CalibrationPlan, WritesKeysThatAScenarioReads) {
  const CalibrationPlan plan = LoadCalibrationPlan(config::AssetPath("calibration.yaml"));
  const std::vector<double> values =
      plan.ValuesAt(std::vector<double>(plan.parameters.size(), 0.3));
  for (const FreeParameter& p : plan.parameters) EXPECT_FALSE(p.source.empty()) << p.key;
  trial::Scenario read = RecognitionScenario(MarkerKind::kPassive, {});
  config::ReadFields(config::ParseYaml(CalibratedYaml(plan, values), "optics.yaml"), &read,
                     nullptr);
  EXPECT_EQ(config::SaveYaml(read),
            config::SaveYaml(RecognitionScenario(MarkerKind::kPassive, plan.Assignments(values))));
}

// What every scenario begins with is where the bundled calibration begins, so that its ranges and
// sources are those of the shipped values.
TEST(CalibrationPlan, BeginsAtTheShippedOptics) {
  const CalibrationPlan plan = LoadCalibrationPlan(config::AssetPath("calibration.yaml"));
  EXPECT_EQ(
      config::SaveYaml(RecognitionScenario(MarkerKind::kPassive, plan.Assignments(plan.Start()))),
      config::SaveYaml(RecognitionScenario(MarkerKind::kPassive, {})));
}

// A list that the calibrated optics do not give cannot be written by its elements; better to hear
// of it before the search.
TEST(CalibrationExperiment, RefusesAnElementOfAListThatIsNotThere) {
  CalibrationPlan plan;
  plan.parameters = {Parameter(0.5, 2, false)};
  plan.parameters[0].key = "cameras.sensor.white_balance[1]";
  TableRow row;
  row.cell = {MarkerKind::kActive, 80, 0.6};
  try {
    ExperimentOf(plan, {row});
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("white_balance"), std::string::npos) << error.what();
  }
}

double MisfitOf(const std::vector<Constraint>& constraints, const std::string& name) {
  for (const Constraint& c : constraints)
    if (c.constraint == name) return c.misfit;
  ADD_FAILURE() << "no constraint " << name;
  return -1;
}

TableComparison AllMet() {
  return {.rmse = 0,
          .area_agreement = 1,
          .loss_by_distance_m = {{0.4, {50, 50}}, {1, {20, 20}}},
          .lost_fitness_error = 0,
          .fitness_std = 0.04};
}

// 0 where all is met, 1 where each is as far off as is accepted.
TEST(TableConstraints, AreInUnitsOfWhatIsAccepted) {
  TableComparison run = AllMet();
  EXPECT_NEAR(Misfit(TableConstraints(MarkerKind::kActive, run)), 0.04 / 0.06 / std::sqrt(6),
              1e-12);  // of the deviation, which is always something
  run.rmse = 0.05;
  run.area_agreement = 0.92;
  run.loss_by_distance_m = {{0.4, {45, 50}}, {1, {22, 20}}};
  run.lost_fitness_error = -0.03;
  run.fitness_std = 0.06;
  for (const Constraint& c : TableConstraints(MarkerKind::kActive, run))
    EXPECT_NEAR(c.misfit, 1, 1e-12) << c.constraint;
  run.fitness_std = 0.09;
  const auto passive = TableConstraints(MarkerKind::kPassive, run);
  EXPECT_NEAR(MisfitOf(passive, "passive rmse"), 0.05 / 0.075, 1e-12);
  EXPECT_NEAR(MisfitOf(passive, "passive deviation"), 1.5, 1e-12);
}

// A marker that is never lost is far off; a table in which it is never lost tells nothing of loss.
TEST(TableConstraints, OfWhatIsNotThere) {
  TableComparison run = AllMet();
  run.loss_by_distance_m = {{0.4, {std::nullopt, 50}}, {1, {20, std::nullopt}}};
  const auto constraints = TableConstraints(MarkerKind::kActive, run);
  EXPECT_EQ(MisfitOf(constraints, "active loss at 400 mm"), 3);
  EXPECT_EQ(constraints.size(), 5u);  // rmse, area, one loss, lost F, deviation
}

// The colour of a light is held while its brightness is searched.
TEST(CalibrationPlan, AListKeepsItsRatio) {
  CalibrationPlan plan;
  plan.parameters.resize(1);
  plan.parameters[0] = {
      "lights.lamps.intensity_w_sr", 0.01, 0.1, 0.02, true, "a test", {1.5, 1, 0.5}};
  EXPECT_THAT(plan.Assignments({0.04}),
              ::testing::ElementsAre("lights.lamps.intensity_w_sr=[0.06, 0.04, 0.02]"));
  EXPECT_THAT(CalibratedYaml(plan, {0.04}),
              ::testing::HasSubstr("intensity_w_sr: [0.06, 0.04, 0.02]"));
}

// A lamp may be in the hull though each of its coordinates is in its range.
TEST(CalibrationExperiment, CountsAnImpossiblePlaceAsPoorButNotAsAStart) {
  CalibrationPlan plan;
  plan.cell_share = 1;
  plan.parameters.resize(1);
  plan.parameters[0] = {"lights.lamps.shift_m[1]", -0.1, 0.1, 0, false, "a test"};
  const RecognitionCell cell{MarkerKind::kPassive, 0, 0.4};
  const CalibrationExperiment experiment = ExperimentOf(plan, {{cell, 0.5}});
  const Evaluation impossible = Evaluate(experiment, {-0.08});
  EXPECT_EQ(impossible.misfit, 3);
  EXPECT_TRUE(impossible.constraints.empty());
  plan.parameters[0].start = -0.08;
  EXPECT_THROW(ExperimentOf(plan, {{cell, 0.5}}), ConfigError);
}

// What the tables' cells give, and what is switched off, cannot be found.
TEST(CalibrationExperiment, RefusesAParameterWithoutEffect) {
  const RecognitionCell cell{MarkerKind::kActive, 40, 0.6};
  for (const char* key : {"water.milk_ml_m3", "start.distance_min_m", "water.snow.albedo"}) {
    CalibrationPlan plan;
    plan.parameters.resize(1);
    plan.parameters[0] = {key, 0.3, 0.8, 0.5, false, "a test"};
    EXPECT_THAT(turbidock::testing::MessageOf([&] {
                  ExperimentOf(plan, {{cell, 0.5}});
                }),
                ::testing::HasSubstr(std::string("parameters[0].key: ") + key +
                                     " changes nothing that this experiment sees"));
  }
}

TEST(CalibrationExperiment, BothTablesCount) {
  const RecognitionCell active{MarkerKind::kActive, 80, 0.6}, passive{MarkerKind::kPassive, 5, 0.6};
  CalibrationPlan plan;
  plan.parameters = {Parameter(0.5, 2, false)};
  const Evaluation one = Evaluate(ExperimentOf(plan, {{passive, 0.2}, {active, 0.5}}), {1});
  ASSERT_EQ(one.fitness.size(), 2u);
  EXPECT_NEAR(MisfitOf(one.constraints, "active rmse"), std::abs(one.fitness[0] - 0.5) / 0.05,
              1e-9);
  EXPECT_NEAR(MisfitOf(one.constraints, "passive rmse"), std::abs(one.fitness[1] - 0.2) / 0.075,
              1e-9);
  EXPECT_EQ(one.misfit, Misfit(one.constraints));
}

TEST(LeftOut, TakesNoPartButIsReported) {
  const std::vector<TableRow> tables = {{{MarkerKind::kActive, 40, 0.4}, 0.5},
                                        {{MarkerKind::kActive, 80, 0.8}, 0.5},
                                        {{MarkerKind::kPassive, 10, 0.8}, 0.4}};
  const std::vector<TableRow> rest = Without({0.8}, tables);
  ASSERT_EQ(rest.size(), 1u);
  EXPECT_EQ(rest[0].cell, tables[0].cell);
  EXPECT_THROW(Without({0.6}, tables), ConfigError);
  EXPECT_THROW(Without({0.4, 0.8}, tables), ConfigError);

  CalibrationPlan plan;
  plan.cell_share = 1;
  plan.parameters = {Parameter(0.5, 2, false)};
  const auto errors = ErrorsByColumn(plan, {1}, tables, {0.8});
  ASSERT_EQ(errors.size(), 3u);
  const Evaluation all = Evaluate(ExperimentOf(plan, tables), {1});
  for (size_t i = 0; i < errors.size(); ++i) {
    EXPECT_EQ(errors[i].marker, tables[i].cell.marker);
    EXPECT_EQ(errors[i].left_out, tables[i].cell.distance_m == 0.8);
    EXPECT_NEAR(errors[i].rmse, std::abs(all.fitness[i] - tables[i].fitness_mean), 1e-9);
    EXPECT_EQ(errors[i].area_agreement,
              AreaOf(all.fitness[i]) == AreaOf(tables[i].fitness_mean) ? 1 : 0);
  }
}

// One parameter, one cell.
CalibrationPlan RimPlan() {
  FreeParameter power;
  power.key = "lights.marker.rim_radiance_w_m2_sr";
  power.low = 0.0012;
  power.high = 0.005;
  power.start = 0.0042;
  power.logarithmic = true;
  CalibrationPlan plan;
  plan.cell_share = 1;
  plan.spread = 0.3;  // the start is far, and until F is near, one cell's Area is a plateau
  plan.parameters = {power};
  return plan;
}

CalibrationExperiment OneCell(const CalibrationPlan& plan, double fitness_mean) {
  const TableRow row{{MarkerKind::kActive, 80, 0.6}, fitness_mean};
  return ExperimentOf(plan, {row});
}

// A known change of one parameter is found again from the table that it makes.
TEST(Calibrate, FindsWhatMadeTheTable) {
  const CalibrationPlan plan = RimPlan();
  const double truth = 0.0022;
  const auto known = OneCell(plan, Evaluate(OneCell(plan, 0), {truth}).fitness.at(0));
  const CalibrationResult result = Calibrate({.generations = 10}, known);
  EXPECT_NEAR(std::log(result.best.values[0] / truth), 0, 0.15);
  EXPECT_LT(result.best.misfit, 0.2);
  EXPECT_EQ(result.evaluations, 1 + 10 * 5);
  EXPECT_TRUE(result.is_complete);

  const CalibrationResult start = Calibrate({.generations = 0}, known);
  EXPECT_EQ(start.evaluations, 1);
  EXPECT_NEAR(start.best.values[0], plan.parameters[0].start, 1e-12);
  EXPECT_GT(start.best.misfit, 2 * result.best.misfit);
}

std::string TextOf(const CalibrationResult& result) {
  return report::JsonText({{"best", result.best}, {"evaluations", result.evaluations}});
}

TEST(Calibrate, IsTheSameForAnyNumberOfWorkers) {
  const auto experiment = OneCell(RimPlan(), 0.5);
  const std::string alone = TextOf(Calibrate({.generations = 2}, experiment));
  // The second worker begins late, so that what it was given first ends last.
  const auto fork_second_late = [forked = 0]() mutable {
    const bool late = ++forked == 2;
    const pid_t pid = fork();
    if (pid == 0 && late) std::this_thread::sleep_for(std::chrono::milliseconds(500));
    return pid;
  };
  EXPECT_EQ(TextOf(Calibrate({.generations = 2, .jobs = {.workers = 2, .fork = fork_second_late}},
                             experiment)),
            alone);
  EXPECT_NE(TextOf(Calibrate({.generations = 2, .seed = 2}, experiment)), alone);
}

TEST(Calibrate, CountsWhatIsDone) {
  std::vector<int> done;
  Calibrate({.generations = 1,
             .on_progress =
                 [&](int now, int of, double best) {
                   done.push_back(now);
                   EXPECT_EQ(of, 1 + 5);
                   EXPECT_GT(best, 0);
                 }},
            OneCell(RimPlan(), 0.5));
  EXPECT_EQ(done, (std::vector<int>{1, 2, 3, 4, 5, 6}));
}

// Also of a generation of which some are done.
TEST(Calibrate, KeepsTheBestWhenItIsStopped) {
  int done = 0;
  const CalibrationResult result =
      Calibrate({.generations = 10,
                 .on_progress = [&](int now, int, double) { done = now; },
                 .stop_requested = [&] { return done == 4; }},
                OneCell(RimPlan(), 0.5));
  EXPECT_EQ(result.evaluations, 4);
  EXPECT_EQ(result.best.misfit, Misfit(result.best.constraints));
  EXPECT_FALSE(result.is_complete);
}

// What is in the file is not evaluated again, and the result is that of one that ran through; a
// longer search goes on with a shorter one.
TEST(Calibrate, GoesOnWhereItWasStopped) {
  const auto experiment = OneCell(RimPlan(), 0.5);
  const std::string through = TextOf(Calibrate({.generations = 3}, experiment));
  const std::string file = ::testing::TempDir() + "calibrate_goes_on.sqlite";
  std::filesystem::remove(file);
  int stops = 0;
  CalibrationResult result;
  for (; !result.is_complete; ++stops) {
    int done = 0;
    result = Calibrate({.generations = 3,
                        .file = file,
                        .on_progress = [&](int now, int, double) { done = now; },
                        .stop_requested = [&] { return done >= 4 * (stops + 1); }},
                       experiment);
    EXPECT_EQ(result.evaluations, std::min(1 + 3 * 5, 4 * (stops + 1)));
  }
  EXPECT_EQ(stops, 4);
  EXPECT_EQ(TextOf(result), through);

  const auto fork_none = [] { return pid_t{-1}; };  // nothing can be evaluated
  const batch::JobOptions none = {.fork = fork_none};
  EXPECT_EQ(TextOf(Calibrate({.generations = 3, .file = file, .jobs = none}, experiment)), through);
  EXPECT_EQ(Calibrate({.generations = 2, .file = file, .jobs = none}, experiment).evaluations, 11);
  EXPECT_THROW(Calibrate({.generations = 4, .file = file, .jobs = none}, experiment),
               SimulatorFault);
}

// Of other seeds and tables: one line, and nothing of it is believed.
TEST(Calibrate, RefusesAFileOfAnotherSearch) {
  const std::string file = ::testing::TempDir() + "calibrate_other.sqlite";
  std::filesystem::remove(file);
  Calibrate({.generations = 0, .file = file}, OneCell(RimPlan(), 0.5));
  EXPECT_THROW(Calibrate({.generations = 0, .seed = 2, .file = file}, OneCell(RimPlan(), 0.5)),
               batch::OtherResults);
  EXPECT_THROW(Calibrate({.generations = 0, .file = file}, OneCell(RimPlan(), 0.6)),
               batch::OtherResults);
  CalibrationPlan wider = RimPlan();
  wider.spread = 0.2;
  EXPECT_THROW(Calibrate({.generations = 0, .file = file}, OneCell(wider, 0.5)),
               batch::OtherResults);
}

// An evaluation here takes minutes.
TEST(Calibrate, DoesNotWaitForAnEvaluationWhenItIsStopped) {
  CalibrationPlan plan = RimPlan();
  plan.frames = 10000;
  const auto experiment = OneCell(plan, 0.5);
  const auto start = std::chrono::steady_clock::now();
  const CalibrationResult result = Calibrate({.stop_requested = [] { return true; }}, experiment);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));
  EXPECT_EQ(result.evaluations, 0);
}

// What a task on another machine does, which knows nothing but its job's text: of the bundled plan,
// both tables.
TEST(EvaluationWork, DoesWhatItsInputSays) {
  CalibrationPlan plan = LoadCalibrationPlan(config::AssetPath("calibration.yaml"));
  plan.cell_share = 0.03;
  plan.frames = 1;
  std::vector<TableRow> tables = PublishedTable(MarkerKind::kActive);
  for (const TableRow& row : PublishedTable(MarkerKind::kPassive)) tables.push_back(row);
  const CalibrationExperiment experiment = ExperimentOf(plan, tables);
  ASSERT_EQ(experiment.rows.size(), 6u);  // one of each column
  const std::string output = EvaluationWork().run(
      report::JsonLine({{"experiment", experiment}, {"values", plan.Start()}}));
  EXPECT_EQ(output, report::JsonLine(Evaluate(experiment, plan.Start())));
  EXPECT_EQ(report::ParseJson(output, "")["values"], report::Json(plan.Start()));
}

// Keys of the scene, too: what is drawn follows the values.
TEST(Evaluate, DrawsWhatTheValuesSay) {
  CalibrationPlan plan = RimPlan();
  plan.parameters = {Parameter(0.08, 0.2, false)};
  plan.parameters[0].key = "cameras.rig.baseline_m";
  const CalibrationExperiment experiment = OneCell(plan, 0.5);
  EXPECT_NE(Evaluate(experiment, {0.12}).fitness, Evaluate(experiment, {0.14}).fitness);
}

}  // namespace
}  // namespace turbidock::recognition
