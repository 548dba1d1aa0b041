// Choosing a gate's conditions: the powers against sequences of trials, the choice against what
// anyone would choose.

#include "experiments/studies/gate/gate_design.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <SQLiteCpp/SQLiteCpp.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "experiments/config/yaml_node.h"
#include "experiments/farm/result_store.h"
#include "experiments/studies/gate/gate_plan.h"
#include "sim/base/random.h"
#include "tests/studies/gate/simulated_sequences.h"
#include "tests/support/message_of.h"

namespace turbidock::gate {
namespace {

using ::testing::HasSubstr;
using testing::MessageOf;

TEST(PairedRateTest, WhatItSaysOfABuildIsWhatSequencesOfTrialsDo) {
  const statistics::PairedRateTest test(0.15, 0.02, 0.1, 120);
  constexpr int kSequences = 20000;
  for (const auto& [coupling, name] : EnumNames<Coupling>::kNames)
    for (const double to : {0.9, 0.8, 0.75, 0.6}) {
      const Counted counted = CountPairs(test, coupling, 0.9, to, kSequences, 5);
      const auto [loss, gain] = SharesOf(coupling, 0.9, to);
      const statistics::Characteristic exact = test.At(loss, gain);
      const double deviation = 0.5 / std::sqrt(static_cast<double>(kSequences));
      EXPECT_NEAR(exact.p_fail, counted.fail, 4 * deviation) << name << to;
      EXPECT_NEAR(exact.p_pass, counted.pass, 4 * deviation) << name << to;
      EXPECT_NEAR(exact.p_fail + exact.p_pass + exact.p_inconclusive, 1, 1e-12);
      EXPECT_NEAR(exact.expected_trials, counted.mean_trials, 0.02 * counted.mean_trials) << to;
    }
  EXPECT_EQ(test.At(0).expected_trials, test.FewestPairs());
  EXPECT_EQ(test.At(0).p_pass, 1);
  EXPECT_LE(test.At(0.15).p_pass, 0.1);
  EXPECT_EQ(statistics::PairedRateTest(0.15, 0.02, 0.1, 5).FewestPairs(), 6) << "never";
}

// As in assets/measured/gate.md, where these were counted in 10,000 sequences.
TEST(GateSize, IsWhatWasMeasured) {
  const GateSize size = SizeOf({.no_worse = 0.95, .worse = 0.85, .alpha = 0.05, .beta = 0.05});
  const statistics::PairedRateTest test(0.1, 0.05, 0.05, 169);
  const auto at = [&](Coupling coupling, double rate) {
    const auto [loss, gain] = SharesOf(coupling, 0.95, rate);
    return test.At(loss, gain);
  };
  EXPECT_NEAR(at(Coupling::kIdentical, 0.95).expected_trials, 35, 1e-9);
  EXPECT_NEAR(at(Coupling::kIdentical, 0.85).expected_trials, 77.9, 1);
  EXPECT_NEAR(at(Coupling::kIndependent, 0.95).expected_trials, 79.8, 1);
  EXPECT_NEAR(at(Coupling::kIndependent, 0.85).expected_trials, 93.5, 1);
  EXPECT_NEAR(at(Coupling::kIndependent, 0.95).p_fail, 0.016, 0.004);

  ASSERT_EQ(size.exact.size(), 6u);
  EXPECT_EQ(size.exact[0].new_rate, 0.95);
  EXPECT_EQ(size.exact[0].expected_trials, 35);
  EXPECT_LE(size.exact[2].inconclusive, 0.01) << "after the loss, at the last trial";
  EXPECT_LE(size.exact[2].pass, 0.05);
  EXPECT_LE(size.exact[3].fail, 0.05);
  EXPECT_LT(size.max_trials, 200);
}

TEST(GateSize, WhatTakesTooManyTrialsIsRefused) {
  EXPECT_THAT(MessageOf([] { SizeOf({.no_worse = 0.95, .worse = 0.95 - 1e-6}); }),
              HasSubstr("that takes more than 10000 trials; give a larger margin"));
}

TEST(GateSize, TheReportHasARowForEachBuildAndDotsForIndependentOnes) {
  const report::Report report = ReportOf(SizeOf({}));
  EXPECT_EQ(report.kind, "gate_plan_size");
  EXPECT_EQ(report.sections[0].table->rows().size(), 6u);
  const report::Panel& verdicts = report.sections[1].panels[0];
  ASSERT_EQ(verdicts.series.size(), 6u);
  for (size_t i = 0; i < verdicts.series[0].points.size(); ++i) {
    double sum = 0;
    for (const size_t curve : {0, 2, 4}) sum += verdicts.series[curve].points[i].y;
    EXPECT_NEAR(sum, 1, 1e-9);
  }
  EXPECT_EQ(verdicts.series[1].points.size(), 3u);
}

Candidate Tried(const std::string& name, int docked, int trials, double trial_s = 2) {
  Candidate candidate{.name = name,
                      .scenario = "sea_night_active",
                      .settings = {},
                      .trials = trials,
                      .docked = docked,
                      .trial_s = trial_s,
                      .docked_well = {}};
  Rng rng = SeedTree(3).Stream(name);
  for (int i = 0; i < docked; ++i)
    candidate.docked_well.push_back({.time_s = 14 + rng.Normal(),
                                     .final_error_m = 0.01 + 0.001 * rng.Uniform(),
                                     .fitness = 0.7 + 0.02 * rng.Normal(),
                                     .effort_v = 1});
  return candidate;
}

TEST(GateDesign, ALossShowsAtTheEdgeAndNotWhereAllDock) {
  const GateDesign design =
      DesignGate({Tried("all dock", 200, 200), Tried("edge", 184, 200), Tried("few dock", 20, 200)},
                 {.budget_s = 600});
  ASSERT_EQ(design.candidates.size(), 3u);
  // 95 % to 85 % is 0.609 of a standard deviation: 0.9179 to Phi(1.3911 - 0.6086)
  EXPECT_NEAR(design.candidates[1].rate, 184.5 / 201, 1e-12);
  EXPECT_NEAR(design.candidates[1].lost_rate, 0.7827, 5e-4);
  EXPECT_EQ(design.candidates[1].margins.success_rate, 0.13);
  EXPECT_GT(design.candidates[1].power, 0.7);
  EXPECT_LT(design.candidates[0].power, 0.2);
  ASSERT_EQ(design.chosen.size(), 2u);
  EXPECT_EQ(design.chosen[0].name, "edge");
  EXPECT_EQ(design.chosen[1].name, "all dock");
  EXPECT_TRUE(design.chosen[1].easy);
  EXPECT_GE(design.power, design.chosen[0].power);
  EXPECT_LE(design.unchanged_s, 600);
}

TEST(GateDesign, ABudgetBuysPower) {
  const std::vector<Candidate> candidates = {Tried("easy", 200, 200), Tried("a", 190, 200),
                                             Tried("b", 184, 200), Tried("c", 180, 200)};
  double power = 0;
  for (const double budget_s : {60., 120., 240.}) {
    const GateDesign design = DesignGate(candidates, {.budget_s = budget_s});
    EXPECT_LE(design.unchanged_s, budget_s);
    EXPECT_GE(design.power, power);
    power = design.power;
  }
  EXPECT_THAT(MessageOf([&] { DesignGate(candidates, {.budget_s = 5}); }),
              HasSubstr("a budget of 5 s is too small: the cheapest gate with a condition at the "
                        "edge takes "));
}

TEST(GateDesign, ConditionsAreOfDifferentKindsAndOfThoseAlikeTheCheapest) {
  std::vector<Candidate> candidates = {Tried("easy", 60, 60), Tried("milk 38", 56, 60),
                                       Tried("milk 40", 52, 60), Tried("waves", 56, 60, 3)};
  candidates[1].settings = {{"water.milk_ml_m3", "38"}};
  candidates[2].settings = {{"water.milk_ml_m3", "40"}};
  candidates[3].settings = {{"sea.state", "moderate"}};
  const GateDesign design = DesignGate(candidates, {.beta = 0.05, .budget_s = 600});
  ASSERT_GE(design.chosen.size(), 3u);
  EXPECT_GT(design.candidates[1].power, design.candidates[2].power);
  EXPECT_NEAR(design.candidates[1].power, design.candidates[2].power, 0.01);
  EXPECT_LT(design.candidates[2].unchanged_s, design.candidates[1].unchanged_s);
  EXPECT_EQ(design.chosen[0].name, "milk 40");
  EXPECT_EQ(design.chosen[1].name, "waves");
}

TEST(GateDesign, WithoutAConditionAtTheEdgeThereIsNone) {
  EXPECT_THAT(
      MessageOf([] {
        DesignGate({Tried("calm", 40, 40), Tried("storm", 2, 40)}, {});
      }),
      HasSubstr("no candidate is at the edge, where 80 to 98 % dock and a loss shows: calm: 40 of "
                "40, storm: 2 of 40"));
}

farm::Plan CalmAndMurky(const std::string& milk, int seeds) {
  return farm::Plan(
      "schema_version: 1\nscenario: pool_active\nset: {duration_s: 9}\ncases: {calm: "
      "{}, murky: {water.milk_ml_m3: " +
          milk + "}}\nseeds: " + std::to_string(seeds),
      "plan.yaml");
}

// Of that plan, two trials a cell; the last times out.
std::string FileOf(const farm::Plan& plan, const std::string& name) {
  const std::string file = ::testing::TempDir() + name;
  std::filesystem::remove(file);
  farm::ResultStore store = farm::ResultStore::Write(file, HeaderOf(plan, {}));
  for (int64_t trial = 0; trial < plan.trials(); ++trial) {
    const farm::TrialSpec spec = plan.Trial(trial);
    farm::StoredTrial stored;
    stored.trial = trial;
    stored.cell = spec.cell;
    stored.sample = spec.sample;
    stored.parameters = spec.parameters;
    stored.record.outcome = trial == 3 ? trial::Outcome::kTimeout : trial::Outcome::kDocked;
    stored.record.failure = trial == 3 ? trial::Failure::kTimeout : trial::Failure::kNone;
    stored.record.time_s = 10.0 + static_cast<double>(trial);
    stored.record.cpu_time_s = 2;
    stored.record.wall_time_s = 3;
    store.Add(stored);
  }
  return file;
}

// Candidates are the cells of the plan that was flown, however many seeds; another plan's are none.
TEST(GateDesign, ResultsMustBeThePlans) {
  const std::string file = FileOf(CalmAndMurky("30", 2), "design.db");
  const std::vector<Candidate> candidates = CandidatesOf(CalmAndMurky("30", 5), file);
  ASSERT_EQ(candidates.size(), 2u);
  EXPECT_EQ(candidates[1].name, "murky");
  EXPECT_EQ(candidates[1].trials, 2);
  EXPECT_EQ(candidates[1].docked, 1);
  ASSERT_EQ(candidates[1].docked_well.size(), 1u);
  EXPECT_EQ(candidates[1].docked_well[0].time_s, 12);
  EXPECT_EQ(candidates[1].trial_s, 2);
  ASSERT_EQ(candidates[1].settings.size(), 2u);
  EXPECT_EQ(candidates[1].settings[1].Assignment(), "water.milk_ml_m3=30");
  EXPECT_THAT(MessageOf([&] { CandidatesOf(CalmAndMurky("31", 2), file); }),
              HasSubstr("of another plan: theirs differs in murky"));
}

TEST(GateDesign, DamagedResultsAreNamed) {
  const farm::Plan plan = CalmAndMurky("30", 2);
  const auto after = [&](const std::string& damage) {
    const std::string file = FileOf(plan, "damaged.db");
    SQLite::Database(file, SQLite::OPEN_READWRITE).exec(damage);
    return file;
  };
  for (const char* cell : {"7", "2", "-1"})
    EXPECT_THAT(MessageOf([&] {
                  CandidatesOf(plan, after("UPDATE trials SET cell = " + std::string(cell) +
                                           " WHERE trial = 1"));
                }),
                HasSubstr("damaged.db: is damaged: trial 1 is of cell " + std::string(cell) +
                          ", must be in [0, 1]"));
  // A time that is none is not known: the other one counts, or other trials' times.
  EXPECT_EQ(CandidatesOf(plan, after("UPDATE runs SET cpu_time_s = 9e999"))[0].trial_s, 3);
  EXPECT_EQ(CandidatesOf(plan, after("UPDATE runs SET cpu_time_s = 9e999, wall_time_s = 9e999 "
                                     "WHERE trial = 0"))[0]
                .trial_s,
            2);
  EXPECT_THAT(MessageOf([&] {
                CandidatesOf(plan, after("UPDATE runs SET cpu_time_s = 9e999, wall_time_s = -1 "
                                         "WHERE trial < 2"));
              }),
              HasSubstr("damaged.db: calm: no trial of it says how long it took"));
}

// A build whose trials have nothing to do with the baseline's passes all the same.
TEST(GateDesign, MarginsOfMediansAreNoFalseAlarms) {
  const Candidate edge = Tried("edge", 184, 200);
  const GateDesign design = DesignGate({Tried("easy", 200, 200), edge}, {.budget_s = 600});
  const DesignedCondition& condition = design.chosen[0];
  Rng rng = SeedTree(9).Stream("test");
  const statistics::HitTest pass = statistics::SignTest(0.1, condition.max_trials);
  int passed = 0;
  constexpr int kRepetitions = 2000;
  for (int r = 0; r < kRepetitions; ++r) {
    int within = 0, trials = 0;
    bool done = false;
    while (!done && trials < condition.max_trials) {
      within += rng.Normal() - rng.Normal() < condition.margins.median.time_s;
      done = pass.Rejects(++trials, within);
    }
    passed += done;
  }
  EXPECT_GT(passed, 0.95 * kRepetitions);
  EXPECT_LT(condition.margins.median.time_s, 2);
  // What all trials do alike has a margin too.
  EXPECT_EQ(condition.margins.median.returns_to_servoing, 1);
  EXPECT_EQ(condition.margins.median.effort_v, 0.02);
}

// Where nothing is easy no condition is taken twice.
TEST(GateDesign, TheEasiestAtTheEdgeIsNoEasyCondition) {
  std::vector<Candidate> candidates = {Tried("a", 184, 200), Tried("b", 180, 200)};
  const DesignOptions options{.budget_s = 1200};
  const GateDesign design = DesignGate(candidates, options);
  ASSERT_EQ(design.chosen.size(), 2u);
  for (const DesignedCondition& condition : design.chosen) EXPECT_FALSE(condition.easy);
  const std::string file = ::testing::TempDir() + "edge.yaml";
  std::ofstream(file) << GateYaml(design, candidates, "b.yaml", "");
  const GatePlan gate = LoadGatePlan(file);
  ASSERT_EQ(gate.conditions.size(), 2u);
  // alone it is a gate, too, and has all of alpha
  candidates.pop_back();
  const GateDesign alone = DesignGate(candidates, options);
  ASSERT_EQ(alone.chosen.size(), 1u);
  EXPECT_GT(alone.power, design.chosen[0].power);
}

// A scenario beside the plan is found from wherever the gate's file stands.
TEST(GateDesign, AScenarioBesideThePlanIsNamedFromTheGate) {
  const std::filesystem::path folder = ::testing::TempDir() + "design";
  std::filesystem::create_directories(folder / "out");
  std::ofstream(folder / "own.yaml")
      << "schema_version: 1\ndescription: own\nmodel: pool_active.xml\nduration_s: 9\nseed: 1\n";
  const farm::Plan plan(
      "schema_version: 1\nscenario: own.yaml\ncases: {easy: {}, edge: {duration_s: 8}}\n",
      (folder / "plan.yaml").string());
  std::vector<Candidate> candidates = {Tried("easy", 200, 200), Tried("edge", 184, 200)};
  for (size_t i = 0; i < 2; ++i) {
    candidates[i].scenario = plan.CellOf(static_cast<int64_t>(i)).scenario;
    candidates[i].settings = plan.CellOf(static_cast<int64_t>(i)).values;
  }
  const DesignOptions options{.budget_s = 600};
  const std::string file = (folder / "out/gate.yaml").string();
  std::ofstream(file) << GateYaml(DesignGate(candidates, options), candidates, "b.yaml",
                                  (folder / "out").string());
  const GatePlan gate = LoadGatePlan(file);
  EXPECT_EQ(gate.conditions[0].scenario, "../own.yaml");
  EXPECT_EQ(gate.conditions[0].Load({}, 1).duration_s, 8);
}

// Whatever a batch may be called and set to.
TEST(GateDesign, NamesAndValuesStayWhatTheyAre) {
  const std::vector<std::string> awkward = {"a, b", "x}", "s #1: x", "- d", "[0", "\"q\" 'r'", "5"};
  for (const std::string& text : awkward) {
    std::vector<Candidate> candidates = {Tried("easy", 200, 200), Tried(text, 184, 200)};
    // a plan's value, then that of the command line, which counts
    candidates[1].settings = {{"procedure", "{servo_x_m: 0.7}"},
                              {"description", config::TextNode(text, {}).OneLine()},
                              {"procedure.servo_x_m", "0.65"}};
    const DesignOptions options{.budget_s = 600};
    const std::string file = ::testing::TempDir() + "awkward.yaml";
    std::ofstream(file) << GateYaml(DesignGate(candidates, options), candidates,
                                    "gate.baseline.yaml", "");
    const GatePlan plan = LoadGatePlan(file);
    EXPECT_EQ(plan.conditions[0].name, text);
    const trial::Scenario scenario = plan.conditions[0].Load({}, 1);
    EXPECT_EQ(scenario.description, text);
    EXPECT_EQ(scenario.procedure.servo_x_m, 0.65);
  }
}

TEST(GateDesign, TheGatesFileIsRead) {
  std::vector<Candidate> candidates = {Tried("easy", 200, 200), Tried("rough: 5 cm/s", 184, 200)};
  candidates[1].settings = {{"sea.state", "moderate"},
                            {"sea.current.surface_velocity_mps", "[0, 0.05, 0]"},
                            {"faults", "{thrusters: [{thruster: sway, force_factor: 0.5}]}"}};
  const DesignOptions options{.budget_s = 600};
  const GateDesign design = DesignGate(candidates, options);
  const std::string file = ::testing::TempDir() + "gate.yaml";
  std::ofstream(file) << GateYaml(design, candidates, "gate.baseline.yaml", "");
  const GatePlan plan = LoadGatePlan(file);
  ASSERT_EQ(plan.conditions.size(), 2u);
  EXPECT_EQ(plan.alpha, options.alpha);
  EXPECT_EQ(plan.conditions[0].name, "rough: 5 cm/s");
  EXPECT_EQ(plan.conditions[0].margins.success_rate, design.chosen[0].margins.success_rate);
  for (const MedianMeasure& measure : kMedianMeasures)
    EXPECT_NEAR(plan.conditions[0].margins.median.*measure.value,
                design.chosen[0].margins.median.*measure.value, 1e-9)
        << measure.name;
  EXPECT_EQ(plan.conditions[0].max_trials, design.chosen[0].max_trials);
  const trial::Scenario scenario = plan.conditions[0].Load({}, 1);
  EXPECT_EQ(scenario.sea.state, vehicle::SeaState::kModerate);
  EXPECT_EQ(scenario.faults.thrusters.size(), 1u);
  // all tests share alpha as the design supposed
  EXPECT_NEAR(plan.OptionsFor(plan.conditions[0], true).alpha, options.alpha / 12, 1e-12);
}

}  // namespace
}  // namespace turbidock::gate
