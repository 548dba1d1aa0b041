// How a plan spreads its seeds and draws, and when its trials are enough.

#include "experiments/batch/plan.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <utility>
#include <vector>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "tests/batch/plan_text.h"
#include "tests/support/message_of.h"
#include "tests/support/own_folder.h"

namespace turbidock::batch {
namespace {

using ::testing::HasSubstr;

TEST(Plan, MeetsItsStrataInTurnWithinEveryCell) {
  const std::string text =
      "scenario: pool_active\nseeds: 4\n"
      "strata:\n"
      "  near: {start.distance_min_m: 0.6, start.distance_max_m: 0.9}\n"
      "  \"12\": {start.distance_min_m: 0.9, start.distance_max_m: 1.2}\n"
      "grid: {water.milk_ml_m3: [1, 2, 3]}\n"
      "random: {trial.duration_s: {uniform: [5, 6]}}\n";
  for (const std::string more : {"", "precision: 0.1\n"}) {
    const Plan plan = Make(text + more);
    EXPECT_EQ(plan.cells(), 3);
    EXPECT_EQ(plan.keys(),
              (std::vector<std::string>{"water.milk_ml_m3", "stratum", "trial.duration_s"}));
    const Plan again(plan.resolved(), "resolved");
    EXPECT_EQ(again.resolved(), plan.resolved());
    for (int64_t trial = 0; trial < plan.trials(); ++trial) {
      const TrialSpec spec = plan.Trial(trial);
      const bool is_near = spec.sample % 2 == 0;
      EXPECT_EQ(spec.parameters[1], (Parameter{"stratum", is_near ? "near" : "12"}));
      const trial::Scenario scenario = plan.ScenarioOf(spec);
      EXPECT_EQ(scenario.start.distance_min_m, is_near ? 0.6 : 0.9);
      EXPECT_EQ(scenario.start.distance_max_m, is_near ? 0.9 : 1.2);
      EXPECT_EQ(scenario.light.water.milk_ml_m3, static_cast<double>(spec.cell + 1));
      EXPECT_EQ(trial::SaveScenario(again.ScenarioOf(again.Trial(trial))),
                trial::SaveScenario(scenario));
    }
  }
  EXPECT_EQ(Make(text, {.seeds = 6}).Trial(5).parameters[1].value, "12");
}

TEST(Plan, CommonSeedsAreTheSameInEveryCellAndOthersAreAllDifferent) {
  const std::string text =
      "scenario: pool_active\nseeds: 5\n"
      "grid: {water.milk_ml_m3: [0, 10, 20]}\n"
      "random: {cameras.sensor.read_noise_electrons: {uniform: [1, 2]}}\n";
  const Plan common = Make(text), own = Make(text + "common_seeds: false\n");
  std::set<int64_t> common_seeds, own_seeds;
  std::set<std::string> common_draws, own_draws;
  for (int64_t trial = 0; trial < 15; ++trial) {
    common_seeds.insert(common.Trial(trial).seed);
    own_seeds.insert(own.Trial(trial).seed);
    common_draws.insert(common.Trial(trial).parameters[1].value);
    own_draws.insert(own.Trial(trial).parameters[1].value);
  }
  EXPECT_EQ(common_seeds.size(), 5u);
  EXPECT_EQ(own_seeds.size(), 15u);
  EXPECT_EQ(common_draws.size(), 5u);
  EXPECT_EQ(own_draws.size(), 15u);
  EXPECT_GE(*own_seeds.begin(), 0);
  EXPECT_EQ(common.Trial(7).seed, common.Trial(12).seed);
}

TEST(Plan, MoreSeedsAndKeysLeaveTheFirstTrialsAlone) {
  const std::string text =
      "scenario: pool_active\nrandom:\n  cameras.sensor.read_noise_electrons: {uniform: [1, 2]}\n";
  const Plan few = Make(text + "seeds: 3\n"), many = Make(text + "seeds: 30\n");
  const Plan wider = Make(text + "  start.lateral_m: {uniform: [0, 1]}\nseeds: 3\n");
  for (int64_t trial = 0; trial < 3; ++trial) {
    EXPECT_EQ(few.Trial(trial).seed, many.Trial(trial).seed);
    EXPECT_EQ(few.Trial(trial).parameters[0], many.Trial(trial).parameters[0]);
    EXPECT_EQ(few.Trial(trial).parameters[0], wider.Trial(trial).parameters[0]);
  }
}

TEST(Plan, EachDistributionKeepsToItsLimitsAndItsMedian) {
  const Plan plan = Make(
      "scenario: pool_active\nseeds: 4000\n"
      "random:\n"
      "  start.lateral_m: {uniform: [0.2, 0.6]}\n"
      "  cameras.sensor.read_noise_electrons: {log_uniform: [0.1, 10]}\n"
      "  vehicle.rigid_body.mass_kg: {normal: [15, 1]}\n"
      "  start.vertical_m: {normal: [0, 1], within: [0.5, 3]}\n"
      "  cameras.delay_frames: {choice: [0, 2, 5, 7]}\n");
  const auto quantile = [&](size_t parameter, double share) {
    std::vector<double> draws = Draws(plan, parameter, 0, 4000);
    std::sort(draws.begin(), draws.end());
    return draws[static_cast<size_t>(share * 4000)];
  };
  // The median of 4000 is known to a standard deviation of 0.008 in share.
  EXPECT_GE(quantile(0, 0), 0.2);
  EXPECT_LE(quantile(0, 0.9999), 0.6);
  EXPECT_NEAR(quantile(0, 0.5), 0.4, 0.01);
  EXPECT_NEAR(quantile(1, 0.5), 1, 0.12);
  EXPECT_NEAR(quantile(2, 0.5), 15, 0.06);
  EXPECT_NEAR(quantile(2, 0.8413447), 16, 0.1);
  EXPECT_GE(quantile(3, 0), 0.5);
  EXPECT_LE(quantile(3, 0.9999), 3);
  EXPECT_NEAR(quantile(3, 0.5), 1.0159, 0.04);  // Phi^-1 half way from Phi(0.5) to Phi(3)
  std::map<double, int> counts;
  for (const double choice : Draws(plan, 4, 0, 4000)) ++counts[choice];
  EXPECT_EQ(counts.size(), 4u);
  for (const auto& [choice, count] : counts) EXPECT_NEAR(count, 1000, 110) << choice;
}

TEST(Plan, NumbersItsTrialsTheSameForAnyPrecision) {
  const std::string text =
      "scenario: pool_active\nseeds: 5\ngrid: {water.milk_ml_m3: [0, 10, 20]}\n"
      "random: {cameras.sensor.read_noise_electrons: {uniform: [1, 2]}}\n";
  for (const std::string more : {"", "common_seeds: false\n"}) {
    const Plan few = Make(text + more + "precision: 0.15\n"),
               many = Make(text + more + "precision: 0.05\n");
    ASSERT_EQ(few.trials(), 120);
    ASSERT_EQ(many.trials(), 1155);
    std::set<std::pair<int64_t, int64_t>> places;
    for (int64_t trial = 0; trial < 120; ++trial) {
      const TrialSpec a = few.Trial(trial), b = many.Trial(trial);
      EXPECT_EQ(a.cell, b.cell);
      EXPECT_EQ(a.sample, b.sample);
      EXPECT_EQ(a.seed, b.seed);
      EXPECT_EQ(a.parameters, b.parameters);
      EXPECT_EQ(a.parameters[0].value, std::to_string(10 * a.cell));
      places.emplace(a.cell, a.sample);
    }
    EXPECT_EQ(places.size(), 120u);
  }
  // The k-th trials of all cells share a seed, and it is that of a plan without a precision.
  const Plan plan = Make(text + "precision: 0.05\n"),
             plain = Make(text, {.assignments = {}, .master_seed = {}, .seeds = 5});
  EXPECT_EQ(plain.trials(), 15);
  for (int64_t cell = 0; cell < 3; ++cell)
    for (int64_t sample = 0; sample < 5; ++sample) {
      EXPECT_EQ(plan.Trial(3 * sample + cell).seed, plain.Trial(5 * cell + sample).seed);
      EXPECT_EQ(plan.Trial(3 * sample + cell).parameters,
                plain.Trial(5 * cell + sample).parameters);
    }
}

TEST(Plan, ReachesItsPrecisionWhateverTheRate) {
  const std::string text = "scenario: pool_active\nprecision: 0.03\n";
  EXPECT_EQ(Make(text + "seeds: 30\n").trials(), 1080);  // 1064 in whole batches
  EXPECT_EQ(Make(text + "seeds: 2000\n").trials(), 2000);
  EXPECT_EQ(Make("scenario: pool_active\nprecision: 0.001\nseeds: 700000\n").trials(), 1400000);
  EXPECT_EQ(Make("scenario: pool_active\nprecision: 0.5\nseeds: 1\n").trials(), 1);
  const Plan plan = Make(text), again(plan.resolved(), "resolved");
  EXPECT_EQ(again.resolved(), plan.resolved());
  EXPECT_EQ(again.trials(), 1064);
  EXPECT_EQ(again.settings().precision, 0.03);
}

TEST(Plan, ForSoManySeedsHasNoPrecision) {
  EXPECT_EQ(Make("scenario: pool_active\nprecision: 0.03\n",
                 {.assignments = {}, .master_seed = {}, .seeds = 1})
                .resolved(),
            Make("scenario: pool_active\n").resolved());
}

TEST(Plan, LooksAtTheFirstTenThousandOfItsDraws) {
  const std::string text =
      "scenario: pool_active\nseeds: 10002\nrandom: {trial.duration_s: {normal: [5, 1]}}\n";
  const Plan plan = Make(text);
  const trial::Scenario last = plan.ScenarioOf(plan.Trial(10001));
  EXPECT_EQ(FormatNumber(last.duration_s), plan.Trial(10001).parameters[0].value);
  EXPECT_THAT(ErrorOf("seeds: 9999\nrandom: {trial.duration_s: {normal: [2, 1]}}\n"),
              HasSubstr("duration_s = -"));
}

TEST(Shard, PartsTogetherHaveEveryTrialOnce) {
  for (int64_t trial = 0; trial < 20; ++trial) {
    int owners = 0;
    for (int index = 1; index <= 3; ++index) owners += Shard{index, 3}.Has(trial);
    EXPECT_EQ(owners, 1);
  }
  EXPECT_EQ(ParseShard("2/4"), (Shard{2, 4}));
  for (const char* bad : {"", "1", "0/4", "5/4", "1/0", "a/b", "1/4x", "-1/4"})
    EXPECT_THROW(ParseShard(bad), ConfigError) << bad;
}

TEST(BundledPlans, AllLoad) {
  const auto names = config::BundledNames("plans");
  EXPECT_GE(names.size(), 4u);
  for (const std::string& name : names) EXPECT_GT(LoadPlan(name).trials(), 0) << name;
}

}  // namespace
}  // namespace turbidock::batch
