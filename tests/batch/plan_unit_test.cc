// Plans: which trials they name, and what is said of bad ones.

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

TEST(Plan, SaysWhereDrawsLeaveOutTheVehiclesOwnValue) {
  const auto drawn = [](const std::string& how) {
    return Make("scenario: pool_active\nrandom: {vehicle.thrusters.lag_s: " + how + "}\n")
        .remarks();
  };
  EXPECT_THAT(drawn("{uniform: [0.05, 0.12]}"), ::testing::IsEmpty());
  EXPECT_THAT(drawn("{uniform: [0.1, 0.2]}"),
              ::testing::ElementsAre("vehicle.thrusters.lag_s is drawn from 0.1 to 0.2 "
                                     "(`random`): its own 0.08 is never tried"));
}

TEST(Plan, NamesEveryCombinationOfTheGrid) {
  const Plan plan = Make(
      "seeds: 2\n"
      "set: {trial.duration_s: 12}\n"
      "grid:\n"
      "  scenario: [pool_active, sea_night_passive]\n"
      "  sea.state: [calm, rough]\n"
      "  sea.current.surface_velocity_mps: [[0, 0.05, 0], [0, 0.1, 0], [0, 0.15, 0]]\n");
  EXPECT_EQ(plan.cells(), 12);
  ASSERT_EQ(plan.trials(), 24);
  const TrialSpec spec = plan.Trial(2 * (1 * 6 + 0 * 3 + 2) + 1);
  EXPECT_EQ(spec.cell, 8);
  EXPECT_EQ(spec.sample, 1);
  EXPECT_EQ(spec.parameters[0].value, "sea_night_passive");
  const trial::Scenario scenario = plan.ScenarioOf(spec);
  EXPECT_EQ(scenario.model, "sea_passive.xml");
  EXPECT_EQ(scenario.duration_s, 12);
  EXPECT_EQ(scenario.sea.state, vehicle::SeaState::kCalm);
  EXPECT_EQ(scenario.sea.current.surface_velocity_mps.y(), 0.15);
  EXPECT_EQ(scenario.seed, spec.seed);
}

// A file of results has a number as it likes.
TEST(Plan, KnowsItsTrialsHoweverANumberIsWritten) {
  const Plan plan =
      Make("scenario: pool_active\nseeds: 2\ngrid: {trial.duration_s: [1.0, 2.50, 1e1]}\n");
  EXPECT_EQ(plan.NumberOf({{"trial.duration_s", "1"}}, 1), 1);
  EXPECT_EQ(plan.NumberOf({{"trial.duration_s", "2.5"}}, 0), 2);
  EXPECT_EQ(plan.NumberOf({{"trial.duration_s", "10"}}, 0), 4);
  EXPECT_EQ(plan.NumberOf({{"trial.duration_s", "3"}}, 0), std::nullopt);
  EXPECT_EQ(plan.Trial(0).parameters, (std::vector<Parameter>{{"trial.duration_s", "1"}}));
}

TEST(Plan, CasesAreCellsOfSeveralKeys) {
  const std::string text =
      "scenario: sea_night_active\nseeds: 2\n"
      "cases:\n"
      "  as planned: {}\n"
      "  'heavier, 30 %': {vehicle.rigid_body.mass_kg: 19.5, cameras.delay_frames: 2}\n"
      "  \"12\": {faults: {misalignments: [{camera: both}]}}\n"
      "grid: {sea.state: [calm, moderate]}\n";
  const Plan plan = Make(text);
  EXPECT_EQ(plan.cells(), 6);
  EXPECT_EQ(plan.keys(), (std::vector<std::string>{"case", "sea.state"}));
  const TrialSpec heavier = plan.Trial(2 * (1 * 2 + 1));
  EXPECT_EQ(heavier.parameters[0].value, "heavier, 30 %");
  const trial::Scenario scenario = plan.ScenarioOf(heavier);
  EXPECT_EQ(scenario.vehicle.rigid_body.mass_kg, 19.5);
  EXPECT_EQ(scenario.camera_delay_frames, 2);
  EXPECT_EQ(scenario.sea.state, vehicle::SeaState::kModerate);
  EXPECT_EQ(plan.ScenarioOf(plan.Trial(0)).vehicle.rigid_body.mass_kg, 15);
  EXPECT_EQ(plan.ScenarioOf(plan.Trial(8)).faults.misalignments.size(), 1u);
  // resolved, it is the same plan
  const Plan again(plan.resolved(), "resolved");
  EXPECT_EQ(again.resolved(), plan.resolved());
  for (int64_t trial = 0; trial < plan.trials(); ++trial)
    EXPECT_EQ(trial::SaveScenario(again.ScenarioOf(again.Trial(trial))),
              trial::SaveScenario(plan.ScenarioOf(plan.Trial(trial))));
}

TEST(Plan, ACaseMayHaveAScenarioOfItsOwn) {
  const std::string text =
      "seeds: 2\nset: {cameras.delay_frames: 2}\n"
      "cases:\n"
      "  pool: {scenario: pool_passive, trial.duration_s: 20}\n"
      "  other pool: {scenario: pool_passive}\n"
      "  sea: {SEA}\n"
      "grid: {sea.state: [calm, moderate]}\n";
  const auto with = [&](const std::string& head, const std::string& sea) {
    std::string all = head + text;
    return Make(all.replace(all.find("SEA"), 3, sea));
  };
  for (const Plan& plan :
       {with("scenario: sea_night_active\n", ""), with("", "scenario: sea_night_active")}) {
    EXPECT_EQ(plan.keys(), (std::vector<std::string>{"case", "sea.state"}));
    ASSERT_EQ(plan.trials(), 12);
    EXPECT_THAT(plan.files(), ::testing::IsSupersetOf({"pool_passive", "sea_night_active"}));
    const Plan again(plan.resolved(), "resolved");
    EXPECT_EQ(again.resolved(), plan.resolved());
    for (int64_t trial = 0; trial < 12; ++trial) {
      const TrialSpec spec = plan.Trial(trial);
      const trial::Scenario scenario = plan.ScenarioOf(spec);
      EXPECT_EQ(scenario.model, trial < 8 ? "pool_passive.xml" : "sea_active.xml");
      EXPECT_EQ(scenario.duration_s == 20, trial < 4);
      EXPECT_EQ(scenario.camera_delay_frames, 2);
      EXPECT_EQ(plan.NumberOf(spec.parameters, spec.sample), trial);
      EXPECT_EQ(trial::SaveScenario(again.ScenarioOf(again.Trial(trial))),
                trial::SaveScenario(scenario));
    }
  }
  EXPECT_NE(with("", "scenario: sea_night_active").hash(),
            with("", "scenario: sea_night_passive").hash());
  const auto error = [](const std::string& more) {
    return testing::MessageOf([&] { Make("cases: {a: {scenario: pool_active}, b: {}}\n" + more); });
  };
  EXPECT_THAT(error(""), HasSubstr("scenario: this key is required, or in every case"));
  EXPECT_THAT(error("grid: {scenario: [pool_passive]}\n"),
              HasSubstr("plan.yaml:3: grid.scenario[0]: this key is given twice, also by "
                        "plan.yaml:2: cases.a.scenario"));
  EXPECT_THAT(testing::MessageOf([] { Make("cases: {a: {scenario: [pool_active]}}\n"); }),
              HasSubstr("plan.yaml:2: cases.a.scenario: '': must be a name"));
}

TEST(Plan, NamesTheCaseAndCellOfATrialThatCannotBe) {
  EXPECT_THAT(ErrorOf("cases: {fine: {}, tags: {estimator.use: fiducial}}\n"
                      "grid: {water.milk_ml_m3: [0, 5]}\n"),
              HasSubstr("plan.yaml: trial 2 (case=tags, water.milk_ml_m3=0): "));
}

TEST(Plan, LeavesToItsUsesWhatIsTheirs) {
  const std::string text = "scenario: pool_active\n";
  const Plan plan = Make(text), both = Make(text + "gate: {any: thing}\ntuning: [1]\n");
  EXPECT_EQ(both.resolved(), plan.resolved());
  // who reads one is told of the other alone
  EXPECT_EQ(both.remarks().size(), 2u);
  EXPECT_THAT(Make(text + "gate: {}\ntuning: {}\n", {.use = "gate"}).remarks(),
              ::testing::ElementsAre("tuning: is not read here; these are settings of "
                                     "`turbidock tune` (list study-keys)"));
}

TEST(Plan, RefusesWhatAUseCannotTakeOrIsNoMore) {
  const PlanOverrides gate{.refused = {{"precision", "a gate runs until its tests know"}}};
  EXPECT_THAT(ErrorOf("seeds: 2\nprecision: 0\n", gate),
              HasSubstr("plan.yaml:4: precision: a gate runs until its tests know"));
  EXPECT_EQ(ErrorOf("seeds: 2\n", gate), "no error");
  EXPECT_EQ(testing::MessageOf(
                [&] { Plan(Make("scenario: pool_active\n").resolved(), "resolved", gate); }),
            "no error");
  EXPECT_THAT(ErrorOf("conditions: []\n"), HasSubstr("plan.yaml:3: conditions: is now `cases`"));
  EXPECT_THAT(ErrorOf("trials: {}\n"), HasSubstr("plan.yaml:3: trials: its keys now stand at the"));
  EXPECT_THAT(ErrorOf("model_files: {}\n"), HasSubstr("plan.yaml:3: model_files: only a resolved"));
  EXPECT_THAT(ErrorOf("folder: /tmp\n"), HasSubstr("plan.yaml:3: folder: only a resolved"));
}

TEST(Plan, SaysAllItsKeys) {
  std::string all;
  for (const config::KeyDoc& doc : PlanKeys()) {
    EXPECT_FALSE(doc.doc.empty()) << doc.key;
    all += (all.empty() ? "" : ", ") + doc.key;
  }
  EXPECT_THAT(ErrorOf("strate: {}\n"),
              HasSubstr("plan.yaml:3: strate: unknown key; did you mean strata? Allowed: " + all));
}

// Those in its header, the second of which stands in place of keys of the first.
TEST(Plan, ExamplesAreRead) {
  std::ifstream header(TURBIDOCK_TEST_DATA "/../../experiments/batch/plan.h");
  std::vector<std::string> examples(1);
  bool is_in = false;
  for (std::string line; std::getline(header, line) && examples.size() < 3;) {
    const bool is_line = line.starts_with("//   ");
    if (is_line) examples.back() += line.substr(5) + "\n";
    if (is_in && !is_line) examples.emplace_back();
    is_in = is_line;
  }
  const Plan grid(examples.at(0), "plan.yaml");
  EXPECT_EQ(grid.cells(), 18);
  EXPECT_EQ(grid.keys().size(), 8u);
  EXPECT_TRUE(Plan("schema_version: 1\nscenario: sea_night_active\n" + examples.at(1), "plan.yaml")
                  .decides());
}

TEST(Plan, PutsPresetsFirstInItsSet) {
  const Plan plan = Make(
      "scenario: pool_active\nset: {vehicle.rigid_body.mass_kg: 18, "
      "vehicle.model: bluerov2_heavy.xml}\n");
  EXPECT_EQ(plan.ScenarioOf(plan.Trial(0)).vehicle.rigid_body.mass_kg, 18);
  EXPECT_TRUE(plan.remarks().empty());
}

TEST(Plan, RefusesCasesThatSayNothingOrTwice) {
  EXPECT_THAT(ErrorOf("cases: {}\n"), HasSubstr("cases: must be a map of names"));
  EXPECT_THAT(ErrorOf("cases: [1]\n"), HasSubstr("plan.yaml:3: cases"));
  EXPECT_THAT(ErrorOf("cases: {a: {trial.duration_s: 5}}\ngrid: {trial.duration_s: [6]}\n"),
              HasSubstr("this key is given twice, also by plan.yaml:3: cases.a.trial.duration_s"));
  EXPECT_THAT(ErrorOf("cases: {a: {trial.seed: 5}}\n"), HasSubstr("set master_seed"));
  EXPECT_THAT(ErrorOf("cases: {a: {scenario: x}}\n"), HasSubstr("x: no such file"));
  EXPECT_THAT(ErrorOf("cases: {a: {}, a: {}}\n"), HasSubstr("duplicate key"));
  EXPECT_THAT(ErrorOf("cases: {a: {trial.duration: 5}}\n"), HasSubstr("mean duration_s"));
  EXPECT_THAT(ErrorOf("grid: {case: [a]}\n"), HasSubstr("`cases` makes"));
  EXPECT_THAT(ErrorOf("random: {case: {choice: [a]}}\n"), HasSubstr("`cases` makes"));
}

TEST(Plan, ResolvedIsItselfWhateverItsTextsHold) {
  const Plan plan = Make(
      "seeds: 2\n"
      "grid: {scenario: [pool_active], description: ['a, b', 'c]', '- d #1: x']}\n"
      "cases: {'<<': {control.use: pid}, 'x}, y: {': {station.model: 'station.xml'}}\n"
      "strata: {'~': {trial.duration_s: 5}, 'a, b': {trial.duration_s: 6}}\n");
  EXPECT_EQ(plan.cells(), 6);
  const Plan again(plan.resolved(), "resolved");
  EXPECT_EQ(again.resolved(), plan.resolved());
  for (int64_t trial = 0; trial < plan.trials(); ++trial) {
    EXPECT_EQ(again.Trial(trial).parameters, plan.Trial(trial).parameters);
    EXPECT_EQ(trial::SaveScenario(again.ScenarioOf(again.Trial(trial))),
              trial::SaveScenario(plan.ScenarioOf(plan.Trial(trial))));
  }
  EXPECT_EQ(plan.ScenarioOf(plan.Trial(2)).description, "c]");
}

TEST(Plan, RefusesNamesThatAreNone) {
  const std::string must = "must be a name of one line and at most 1000 bytes";
  EXPECT_THAT(ErrorOf("cases: {'': {}}\n"), HasSubstr(must));
  EXPECT_THAT(ErrorOf("strata: {\"a\\nb\": {}}\n"), HasSubstr(must));
  EXPECT_THAT(ErrorOf("cases:\n  ? " + std::string(1001, 'x') + "\n  : {}\n"), HasSubstr(must));
  EXPECT_NO_THROW(Make("scenario: pool_active\ncases: {" + std::string(1000, 'x') + ": {}}\n"));
}

TEST(Plan, SaysWhereAWrongValueStands) {
  EXPECT_THAT(ErrorOf("grid:\n  trial.duration_s:\n    - 5\n    - -5\n"),
              HasSubstr("plan.yaml:6: trial.duration_s = -5"));
  EXPECT_THAT(ErrorOf("cases:\n  a: {trial.duration_s: 5}\n  b: {trial.duration_s: -5}\n"),
              HasSubstr("plan.yaml:5: trial.duration_s = -5"));
  EXPECT_THAT(
      ErrorOf("seeds: 2\nstrata:\n  a: {trial.duration_s: 5}\n  b: {trial.duration_s: -5}\n"),
      HasSubstr("plan.yaml:6: trial.duration_s = -5"));
  // of two that do not go together
  EXPECT_THAT(ErrorOf("set: {control.use: lqg, procedure.blind_max_s: 6}\n"
                      "cases:\n  a: {}\n  b: {control.use: p_voltage}\n"),
              HasSubstr("plan.yaml:3: procedure.blind_max_s: 6 needs a controller that predicts"));
  EXPECT_THAT(ErrorOf("random:\n  trial.duration_s: {uniform: [-2, -1]}\n"),
              HasSubstr("plan.yaml:4: trial.duration_s = -"));
}

TEST(Plan, RefusesStrataThatAreNotMetEquallyOftenOrNameAKeyTwice) {
  const auto error = [](const std::string& text, const PlanOverrides& overrides = {}) {
    return ErrorOf("seeds: 4\n" + text, overrides);
  };
  const std::string strata = "strata: {a: {trial.duration_s: 5}, b: {trial.duration_s: 6}}\n";
  EXPECT_NO_THROW(Make("scenario: pool_active\nseeds: 4\n" + strata));
  EXPECT_THAT(error(strata, {.seeds = 5}),
              HasSubstr("--seeds: 5 must be a multiple of 2: each stratum is met equally often"));
  EXPECT_THAT(error("strata: {a: {trial.duration_s: 5}, b: {trial.duration_s: 6}, c: "
                    "{trial.duration_s: 7}}\n"),
              HasSubstr("plan.yaml: seeds: 4 must be a multiple of 3"));
  EXPECT_THAT(error("strata: {}\n"), HasSubstr("strata: must be a map of names"));
  EXPECT_THAT(error("strata: {a: {trial.duration: 5}}\n"), HasSubstr("mean duration_s"));
  EXPECT_THAT(error("strata: {a: {trial.duration_s: 5}, b: {trial.duration_s: -5}}\n"),
              HasSubstr("trial.duration_s"));
  EXPECT_THAT(error("strata: {a: {scenario: x}}\n"),
              HasSubstr("plan.yaml:4: strata.a.scenario: belongs in the grid or in a case"));
  for (const std::string other :
       {"grid: {trial.duration_s: [6]}\n", "random: {trial.duration_s: {uniform: [5, 6]}}\n",
        "cases: {c: {trial.duration_s: 6}}\n"})
    EXPECT_THAT(error(strata + other), HasSubstr("trial.duration_s: this key is given twice"));
  EXPECT_THAT(error("grid: {stratum: [a]}\n"), HasSubstr("`strata` make"));
}

TEST(Plan, RefusesToSetWhatItGivesEachTrial) {
  const auto error = [](const std::string& text,
                        const std::string& assignment = "lights.lamps.enabled=true") {
    return ErrorOf("seeds: 2\n" + text, {.assignments = {config::ParseAssignment(assignment)}});
  };
  EXPECT_THAT(error("cases: {a: {trial.duration_s: 5}, b: {}}\n", "trial.duration_s=9"),
              HasSubstr("cases.a.trial.duration_s: this key is given twice, also by --set"));
  EXPECT_THAT(error("cases: {a: {start.heading_rad: 0.1}}\n", "start={heading_rad: 0.2}"),
              HasSubstr("given twice, also by --set start.heading_rad"));
  for (const std::string varied :
       {"grid: {trial.duration_s: [5]}\n", "random: {trial.duration_s: {uniform: [5, 6]}}\n",
        "strata: {a: {trial.duration_s: 5}, b: {trial.duration_s: 6}}\n"}) {
    EXPECT_THAT(error(varied + "set: {trial.duration_s: 9}\n"),
                HasSubstr("this key is given twice, also by plan.yaml:5: set.trial.duration_s"));
    EXPECT_THAT(error(varied, "trial.duration_s=9"),
                HasSubstr("this key is given twice, also by --set trial.duration_s"));
  }
  EXPECT_THAT(error("grid: {start.heading_rad: [0, 1]}\nset: {start: {heading_rad: 0.1}}\n"),
              HasSubstr("given twice, also by plan.yaml:5: set.start.heading_rad"));
  EXPECT_THAT(error("grid: {sea.current.surface_velocity_mps: [[0, 0, 0]]}\n",
                    "sea.current.surface_velocity_mps[1]=0.1"),
              HasSubstr("given twice, also by --set sea.current.surface_velocity_mps[1]"));
  for (const std::string element :
       {"sea.current.surface_velocity_mps.1", "'sea.current.surface_velocity_mps[1]'"})
    EXPECT_THAT(
        error("grid: {sea.current.surface_velocity_mps: [[0, 0, 0]], " + element + ": [0.1]}\n"),
        HasSubstr("given twice, also in the list of plan.yaml:4: "
                  "grid.sea.current.surface_velocity_mps"));
  EXPECT_THAT(error("grid: {water.milk_ml_m3: [1]}\n"
                    "strata: {a: {water: {milk_ml_m3: 3}}, b: {trial.duration_s: 6}}\n"),
              HasSubstr("plan.yaml:5: strata.a.water.milk_ml_m3: this key is given twice"));
  EXPECT_THAT(
      error("grid: {'lights.lamps.intensity_w_sr[0]': [1], lights.lamps.intensity_w_sr.0: [2]}\n"),
      HasSubstr("this key is given twice"));
  EXPECT_NO_THROW(Make(
      "scenario: pool_active\nset: {start: {lateral_m: 0.1}}\ngrid: {start.heading_rad: [0]}\n"));
  EXPECT_THAT(error("", "trial.seed=7"),
              HasSubstr("--set trial.seed: the plan gives each trial its seed"));
  // A part of what is set before.
  EXPECT_NO_THROW(
      Make("scenario: pool_active\nset: {lights.lamps.intensity_w_sr: [1, 2, 3]}\n"
           "grid: {'lights.lamps.intensity_w_sr[0]': [4]}\n"));
  // A case may say otherwise than the rest.
  EXPECT_NO_THROW(
      Make("scenario: pool_active\nset: {trial.duration_s: 9}\ncases: {a: {}, b: "
           "{trial.duration_s: 5}}\n"));
}

TEST(Plan, ResolvedIsAPlanOfTheSameTrials) {
  const Plan plan = Make(
      "description: \"it's: odd\"\nseeds: 3\n"
      "set: {trial.duration_s: 12}\n"
      "grid:\n  scenario: [pool_active, pool_passive]\n  sea.state: [calm]\n"
      "random:\n  start.vertical_m: {normal: [0, 1], within: [0.5, 3]}\n"
      "  cameras.delay_frames: {choice: [1, 2]}\n",
      {.assignments = config::ParseAssignments({"water.milk_ml_m3=7"}),
       .master_seed = 99,
       .seeds = 4});
  const Plan again(plan.resolved(), "resolved");
  EXPECT_EQ(again.resolved(), plan.resolved());
  EXPECT_EQ(again.hash(), plan.hash());
  ASSERT_EQ(again.trials(), 8);
  for (int64_t trial = 0; trial < 8; ++trial) {
    const trial::Scenario a = plan.ScenarioOf(plan.Trial(trial)),
                          b = again.ScenarioOf(again.Trial(trial));
    EXPECT_EQ(config::SaveYaml(a), config::SaveYaml(b));
    EXPECT_EQ(b.light.water.milk_ml_m3, 7);
  }
}

TEST(Plan, ItsHashSeesWhateverChangesATrial) {
  const std::string text = "scenario: pool_active\n";
  std::set<std::string> hashes = {Make(text).hash()};
  for (const char* more :
       {"seeds: 2\n", "master_seed: 2\n", "set: {trial.duration_s: 12}\n", "precision: 0.1\n",
        "precision: 0.2\n", "grid: {water.milk_ml_m3: [1]}\n",
        "random: {start.lateral_m: {uniform: [0, 1]}}\n"})
    EXPECT_TRUE(hashes.insert(Make(text + more).hash()).second) << more;
  EXPECT_FALSE(hashes.insert(Make(text).hash()).second);
}

using PlanFiles = testing::OwnFolder;

// Also one that none of the trials that are looked at has drawn.
TEST_F(PlanFiles, ItsHashSeesEveryModelThatMayBeDrawn) {
  std::string choices;
  std::vector<std::string> models;
  for (const char* name : {"a", "b", "c"}) {
    models.push_back(File(std::string(name) + ".xml"));
    std::filesystem::copy_file(config::ModelPath("station.xml"), models.back());
    choices += (choices.empty() ? "'" : ", '") + models.back() + "'";
  }
  const auto plan = [&] {
    return Make("scenario: pool_active\nseeds: 1\nrandom: {station.model: {choice: [" + choices +
                "]}}\n");
  };
  const Plan before = plan();
  for (const std::string& model : models) {
    const std::string name = std::filesystem::path(model).filename();
    EXPECT_THAT(before.resolved(), HasSubstr("/" + name + ": content "));
    std::ofstream(model, std::ios::app) << "<!-- heavier -->\n";
    EXPECT_NE(plan().hash(), before.hash()) << model;
  }
}

TEST(Plan, SaysWhatIsWrongAndWhere) {
  const std::pair<const char*, const char*> cases[] = {
      {"seed: 3\n", "plan.yaml:3: seed: unknown key; did you mean seeds?"},
      {"seeds: 0\n", "plan.yaml:3: seeds = 0, must be in [1, 1e+06]"},
      {"set:\n  water.milk_ml_m4: 1\n",
       "plan.yaml:4: water.milk_ml_m4: unknown key; did you mean milk_ml_m3?"},
      {"set: {start.distance_min_m: -1}\n", "plan.yaml:3: start.distance_min_m = -1, must be in"},
      {"grid: {water.milk_ml_m4: [1]}\n",
       "plan.yaml:3: water.milk_ml_m4: unknown key; did you mean milk_ml_m3?"},
      {"grid: {water.milk_ml_m3: [1, -1]}\n", "plan.yaml:3: water.milk_ml_m3 = -1"},
      {"grid: {water.milk_ml_m3: [1, 2, 1]}\n",
       "plan.yaml:3: grid.water.milk_ml_m3[2]: '1' is given twice"},
      {"grid: {water.milk_ml_m3: [0.1, 1.0e-1]}\n",
       "plan.yaml:3: grid.water.milk_ml_m3[1]: '1.0e-1' is given twice"},
      {"grid: {water.milk_ml_m3: 3}\n",
       "plan.yaml:3: grid.water.milk_ml_m3: must be a list of values"},
      {"grid: {trial.seed: [1]}\n", "set master_seed"},
      {"grid: {scenario: [pool_passive]}\n", "leave one out"},
      {"grid: {start.lateral_m: [1]}\nrandom: {start.lateral_m: {uniform: [0, 1]}}\n",
       "plan.yaml:4: random.start.lateral_m: this key is given twice"},
      {"random: {start.lateral_m: {uniform: [1, 0]}}\n", "low must be below high"},
      {"random: {start.lateral_m: {uniform: [1]}}\n",
       "plan.yaml:3: random.start.lateral_m.uniform has 1 element, must be a list of 2 numbers"},
      {"random: {start.lateral_m: {log_uniform: [0, 1]}}\n", "low must be > 0"},
      {"random: {start.lateral_m: {normal: [1, 0]}}\n", "the standard deviation must be > 0"},
      {"random: {start.lateral_m: {normal: [38, 0.5], within: [13, 17]}}\n",
       "plan.yaml:3: random.start.lateral_m: `within` is more than 5 standard deviations"},
      {"random: {start.lateral_m: {normal: [-9, 1], within: [0, 1]}}\n",
       "more than 5 standard deviations"},
      {"random: {start.lateral_m: {gamma: [1, 2]}}\n",
       "must be one of uniform, normal, log_uniform, choice"},
      {"seeds: 50\nrandom: {start.lateral_m: {normal: [0.5, 1]}}\n", "start.lateral_m = -"},
      {"random: {water.milk_ml_m3: {uniform: [0, 2000.5]}}\n",
       "plan.yaml:3: random.water.milk_ml_m3: 2000.5 cannot be drawn: must be in [0, 2000]"},
      {"random: {start.lateral_m: {normal: [0.5, 0.1], within: [-0.01, 1]}}\n",
       "-0.01 cannot be drawn: must be in [0, 5]"},
      {"precision: 0.6\n", "plan.yaml:3: precision = 0.6, must be in [0, 0.5]"},
      {"precision: .nan\n", "plan.yaml:3: precision"},
      {"precision: high\n", "plan.yaml:3: precision = 'high', must be"},
      {"precision: 0.1\nmax_trials: 40\n", "plan.yaml:4: max_trials: unknown key"},
      {"precision: 0.001\ngrid: {water.milk_ml_m3: [0,1,2,3,4,5,6,7,8,9,10]}\n",
       "more than 10000000 trials"},
      {"seeds: 1000000\ngrid: {water.milk_ml_m3: [0,1,2,3,4,5,6,7,8,9,10]}\n",
       "more than 10000000 trials"},
  };
  for (const auto& [text, said] : cases) EXPECT_THAT(ErrorOf(text), HasSubstr(said)) << text;
  EXPECT_THAT(testing::MessageOf([] { Make(""); }),
              HasSubstr("plan.yaml: scenario: this key is required"));
  EXPECT_THAT(testing::MessageOf([] { Make("scenario: pool_activ\n"); }),
              HasSubstr("did you mean pool_active?"));
}

}  // namespace
}  // namespace turbidock::batch
