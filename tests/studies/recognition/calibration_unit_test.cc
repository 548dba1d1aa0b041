#include "experiments/studies/recognition/calibration.h"

#include <gtest/gtest.h>

#include <cmath>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "sim/base/random.h"

namespace turbidock::recognition {
namespace {

FreeParameter Parameter(double low, double high, bool logarithmic) {
  FreeParameter p;
  p.key = "water.milk_ml_m3";
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
  EXPECT_EQ(Parameter(0.5, 32, true).Assignment(4.123456789), "water.milk_ml_m3=4.1235");
  FreeParameter steps = Parameter(1, 12, false);
  steps.integer = true;
  EXPECT_EQ(steps.ValueAt(0.3), 4);  // of 4.3
  EXPECT_EQ(steps.Assignment(steps.ValueAt(0.3)), "water.milk_ml_m3=4");
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
  std::vector<double> values;
  std::vector<std::string> assignments;
  for (const FreeParameter& p : plan.parameters) {
    values.push_back(p.ValueAt(0.3));
    assignments.push_back(p.Assignment(values.back()));
    EXPECT_FALSE(p.source.empty()) << p.key;
  }
  trial::Scenario read = RecognitionScenario(MarkerKind::kPassive, {});
  config::ReadFields(config::ParseYaml(CalibratedYaml(plan, values), "optics.yaml"), &read,
                     nullptr);
  EXPECT_EQ(config::SaveYaml(read),
            config::SaveYaml(RecognitionScenario(MarkerKind::kPassive, assignments)));
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
  plan.parameters[0].key = "sensor.white_balance[1]";
  TableRow row;
  row.cell = {MarkerKind::kActive, 80, 0.6};
  const TableByMarker tables = {{MarkerKind::kActive, {row}}};
  try {
    CalibrationExperiment experiment(plan, tables);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("white_balance"), std::string::npos) << error.what();
  }
}

double MisfitOf(const std::vector<Constraint>& constraints, const std::string& name) {
  for (const Constraint& c : constraints)
    if (c.name == name) return c.misfit;
  ADD_FAILURE() << "no constraint " << name;
  return -1;
}

TableComparison AllMet() {
  return {.rmse = 0,
          .area_agreement = 1,
          .loss_by_distance_m = {{0.4, {50, 50}}, {1, {20, 20}}},
          .lost_fitness_error = 0,
          .best_milk_ml_m3 = 5,
          .rise = 0.06,
          .fitness_std = 0.04};
}

// 0 where all is met, 1 where each is as far off as is accepted.
TEST(TableConstraints, AreInUnitsOfWhatIsAccepted) {
  const AcceptedErrors accepted;
  TableComparison run = AllMet();
  EXPECT_NEAR(Misfit(TableConstraints(MarkerKind::kActive, run, accepted)),
              0.04 / 0.06 / std::sqrt(7), 1e-12);  // of the deviation, which is always something
  run.rmse = 0.05;
  run.area_agreement = 0.92;
  run.loss_by_distance_m = {{0.4, {45, 50}}, {1, {22, 20}}};
  run.lost_fitness_error = -0.03;
  run.rise = 0.03;
  run.fitness_std = 0.02;
  for (const Constraint& c : TableConstraints(MarkerKind::kActive, run, accepted))
    EXPECT_NEAR(c.misfit, 1, 1e-12) << c.name;
  run.rise = -0.03;
  run.fitness_std = 0.09;
  const auto passive = TableConstraints(MarkerKind::kPassive, run, accepted);
  EXPECT_NEAR(MisfitOf(passive, "passive rmse"), 0.05 / 0.075, 1e-12);
  EXPECT_NEAR(MisfitOf(passive, "passive rise"), 3, 1e-12);
  EXPECT_NEAR(MisfitOf(passive, "passive deviation"), 1.5, 1e-12);
}

// A marker that is never lost is far off; a table in which it is never lost tells nothing of loss.
TEST(TableConstraints, OfWhatIsNotThere) {
  TableComparison run = AllMet();
  run.loss_by_distance_m = {{0.4, {std::nullopt, 50}}, {1, {20, std::nullopt}}};
  run.rise = std::nullopt;
  const auto constraints = TableConstraints(MarkerKind::kActive, run, {});
  EXPECT_EQ(MisfitOf(constraints, "active loss at 400 mm"), 3);
  EXPECT_EQ(constraints.size(), 5u);  // rmse, area, one loss, lost F, deviation
}

CalibrationResult ResultOf(const std::vector<std::vector<double>>& front) {
  CalibrationResult result;
  for (const std::vector<double>& misfits : front) {
    Evaluation evaluation;
    for (size_t i = 0; i < misfits.size(); ++i)
      evaluation.constraints.push_back(
          {std::string(1, static_cast<char>('a' + i)), {}, misfits[i]});
    result.front.push_back(evaluation);
  }
  result.best = result.front[0];
  return result;
}

TEST(Pulls, AreWhatTheLeastOfOneCostsTheOthers) {
  const std::vector<Pull> pulls = PullsOf(ResultOf({{1, 1, 0.5}, {0.2, 3, 1}, {2, 0.9, 0.5}}));
  ASSERT_EQ(pulls.size(), 3u);
  EXPECT_EQ(pulls[0].least_misfit, 0.2);
  EXPECT_EQ(pulls[0].against, "b");
  EXPECT_EQ(pulls[0].against_misfit, 3);
  EXPECT_EQ(pulls[1].least_misfit, 0.9);
  EXPECT_EQ(pulls[1].against, "a");
  EXPECT_EQ(pulls[2].against, "");  // it is as good as anywhere at the best
}

// Two tables, of which one is met and the other missed by twice what is accepted; and pictures.
TEST(CalibrationExperiment, BothTablesCount) {
  const RecognitionCell active{MarkerKind::kActive, 80, 0.6}, passive{MarkerKind::kPassive, 5, 0.6};
  CalibrationPlan plan;
  plan.parameters = {Parameter(0.5, 2, false)};
  const CalibrationExperiment experiment(plan, {{MarkerKind::kActive, {{active, 0.5, {}}}},
                                                {MarkerKind::kPassive, {{passive, 0.5, {}}}}});
  for (const auto& [of_active, of_passive] : {std::pair{0.5, 0.35}, {0.4, 0.5}}) {
    const auto constraints =
        experiment.ConstraintsOf({{.cell = active, .fitness_mean = of_active},
                                  {.cell = passive, .fitness_mean = of_passive}});
    EXPECT_NEAR(MisfitOf(constraints, "active rmse"), (0.5 - of_active) / 0.05, 1e-9);
    EXPECT_NEAR(MisfitOf(constraints, "passive rmse"), (0.5 - of_passive) / 0.075, 1e-9);
  }
}

// A known change of one parameter is found again from the table that it makes.
TEST(Calibrate, FindsWhatMadeTheTable) {
  CalibrationPlan plan;
  plan.cell_share = 1;
  FreeParameter power;
  power.key = "ball_lights.rim_radiance_w_m2_sr";
  power.low = 0.0012;
  power.high = 0.005;
  power.start = 0.0042;
  power.logarithmic = true;
  plan.parameters = {power};
  plan.accepted.ball_dn = 1;  // the picture has no say
  TableByMarker tables;
  TableRow row;
  row.cell = {MarkerKind::kActive, 80, 0.6};
  tables[MarkerKind::kActive] = {row};
  CalibrationExperiment experiment(plan, tables);
  ASSERT_EQ(experiment.rows().size(), 1u);
  const double truth = 0.0022;
  tables[MarkerKind::kActive][0].fitness_mean =
      experiment.Run({power.Assignment(truth)}, {}).front().fitness_mean;
  CalibrationExperiment known(plan, tables);
  const CalibrationResult result = Calibrate(plan, {.generations = 10}, &known);
  EXPECT_NEAR(std::log(result.best.values[0] / truth), 0, 0.15);
  EXPECT_LT(result.misfit, 0.6);  // F within 0.03, the same Area
  EXPECT_GT(result.misfit_beside[0].first, result.misfit);
  EXPECT_GT(result.misfit_beside[0].second, result.misfit);

  const CalibrationResult start = Calibrate(plan, {.generations = 0}, &known);
  EXPECT_EQ(start.evaluations, 1);
  EXPECT_EQ(start.front.size(), 1u);
  EXPECT_GT(result.evaluations, static_cast<int>(result.front.size()));
  EXPECT_NEAR(start.best.values[0], power.start, 1e-12);
  EXPECT_GT(start.misfit, 2 * result.misfit);
  EXPECT_LT(start.misfit_beside[0].first, start.misfit);  // the truth is lower
}

}  // namespace
}  // namespace turbidock::recognition
