// Studies and tuning runs on short trials without cameras: what is refused, and that the result
// follows from the study alone.

#include "experiments/studies/tuning/tuner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <SQLiteCpp/SQLiteCpp.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "control/lqg.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/report/report.h"
#include "experiments/report/report_json.h"
#include "experiments/studies/tuning/study.h"
#include "sim/base/check.h"
#include "tests/studies/tuning/study_text.h"
#include "tests/support/message_of.h"
#include "tests/support/own_folder.h"
namespace turbidock::tuning {
namespace {

using ::testing::HasSubstr;

using TunerTest = testing::OwnFolder;

// What a trial reads counts by its content: a run never goes on with another vehicle.
TEST_F(TunerTest, IsNotResumedWhenAModelFileHasChanged) {
  const std::string own = File("own.xml");
  std::filesystem::copy_file(config::ModelPath("vehicle.xml"), own);
  std::filesystem::copy_file(config::ModelPath("vehicle.yaml"), File("own.yaml"));
  std::string trials = kTrials;
  trials.insert(trials.find("estimator.pose_source"), "vehicle.model: '" + own + "', ");
  const auto begin = [&] {
    const Study study = StudyOf(kHead + trials + kGains + kObjective);
    TuningOptions options;
    options.stop_requested = [] { return true; };
    try {
      Tune(study, File("evaluations.sqlite"), options);
    } catch (const batch::Stopped&) {
    }
  };
  begin();
  begin();
  std::ofstream(own, std::ios::app) << "<!-- heavier -->\n";
  EXPECT_THAT(testing::MessageOf(begin), HasSubstr("the file " + own + " has changed"));
}

TEST(Study, TheExampleIsReadAndStartsAtTheScenariosGains) {
  const Study study = StudyOf(kStudy);
  EXPECT_EQ(study.start(), (Gains{0.27}));
  const search::Candidate candidate = study.CandidateOf({0.6});
  EXPECT_NEAR(study.GainsAt(candidate)[0], 0.6, 1e-12);
  EXPECT_EQ(study.GainsAt({0}), (Gains{0.2}));
  EXPECT_EQ(study.GainsAt({1}), (Gains{3}));
  EXPECT_NEAR(study.GainsAt({0.5})[0], std::sqrt(0.2 * 3), 1e-12);
  const batch::Plan plan = study.TrialsOf(0, 4);
  EXPECT_EQ(LqgOf(study.ScenarioOf(plan, 1, {1.5})).sway.effort_share, 1.5);
  EXPECT_EQ(study.hash(), StudyOf(kStudy, "other.yaml").hash());
}

TEST(Study, WhatIsStoredOfItIsTheSameStudy) {
  const Study study = StudyOf(kStudy);
  const Study stored = StudyOf(study.resolved(), "stored");
  EXPECT_EQ(stored.resolved(), study.resolved());
  EXPECT_EQ(stored.start(), study.start());
}

TEST(Study, SeedsOfDifferentSetsHaveNothingInCommon) {
  const Study study = StudyOf(kStudy);
  std::set<int64_t> seeds;
  for (const uint64_t set : {0, 1, 2, 1000001})
    for (int64_t trial = 0; trial < 50; ++trial)
      seeds.insert(study.TrialsOf(set, 50).Trial(trial).seed);
  EXPECT_EQ(seeds.size(), 200u);
}

TEST(Study, WhatIsWrongIsSaid) {
  const auto with_gain = [](const std::string& gain) {
    return MessageOf(kHead + kTrials + "  gains: [" + gain + "]\n" + kObjective);
  };
  EXPECT_THAT(with_gain("{key: control.lqg.sway.effort_share, low: 3, high: 0.2}"),
              HasSubstr("gains[0].low: 3 must be below high (0.2)"));
  EXPECT_THAT(with_gain("{key: control.lqg.sway.efort_share, low: 0.2, high: 3}"),
              HasSubstr("is no number of a scenario; did you mean control.lqg.sway.effort_share?"));
  EXPECT_THAT(with_gain("{key: control.lqg.sway.effort_share, low: 0, high: 3, scale: log}"),
              HasSubstr("must be > 0 on a log scale"));
  EXPECT_THAT(with_gain("{key: control.lqg.sway.effort_share, low: 1, high: 3}"),
              HasSubstr("study.yaml:11: tuning.gains[0].key: the search begins at the trials' "
                        "control.lqg.sway.effort_share = 0.27, which must be in [1, 3]"));
  EXPECT_THAT(with_gain("{key: control.lqg.sway.limit_share, low: 0.5, high: 3}"),
              HasSubstr("must be in [0, 1]"));
  EXPECT_THAT(with_gain("{key: control.use, low: 1, high: 3}"), HasSubstr("no number"));
  EXPECT_THAT(MessageOf(kHead + kTrials + kGains + "  objective: [{metric: time}]\n"),
              HasSubstr("'time' is produced by no trial; did you mean time_s?"));
  EXPECT_THAT(MessageOf(kHead + kTrials + kGains + "  objective: []\n"),
              HasSubstr("study.yaml:12: tuning.objective: must have at least one"));
  EXPECT_THAT(MessageOf(kHead + kTrials + kGains),
              HasSubstr("study.yaml:10: tuning.objective: must have at least one"));
  for (const char* term : {"weight: 1e308", "failed: 1e308"})
    EXPECT_THAT(
        MessageOf(kHead + kTrials + kGains + "  objective: [{metric: time_s, " + term + "}]\n"),
        HasSubstr(" = 1e308, must be in "));
  EXPECT_THAT(MessageOf(kHead + "scenario: pool_active\n"),
              HasSubstr("study.yaml: tuning: this key is required"));
  EXPECT_THAT(MessageOf(kStudy + "  optimizer: {}\n"),
              HasSubstr("tuning.optimizer: unknown key; did you mean optimiser? Allowed: gains, "));
  EXPECT_THAT(
      MessageOf(kStudy + "  optimiser: {algorithm: nsga2}\n"),
      HasSubstr("study.yaml:13: tuning.optimiser.algorithm: unknown key; allowed: population, "));
  // an older study
  EXPECT_THAT(MessageOf(kHead + "trials: {scenario: pool_active}\ngains: []\n"),
              HasSubstr("study.yaml:3: trials: its keys now stand at the top of the file"));
}

TEST(Study, WhatTheTrialsCannotGiveIsRefused) {
  const auto with = [](const std::string& more, const std::string& group = "") {
    return MessageOf(kHead + more + kTrials + kGains + kObjective + group);
  };
  EXPECT_EQ(with(""), "no error");
  EXPECT_THAT(with("precision: 0.1\n"),
              HasSubstr("study.yaml:3: precision: a study runs exactly `seeds` trials"));
  const std::string strata = "strata: {a: {start.lateral_m: 0}, b: {start.lateral_m: 0.1}}\n";
  EXPECT_EQ(with(strata), "no error");
  EXPECT_THAT(with(strata, "  proof: {held_out_seeds: 5}\n"),
              HasSubstr("study.yaml: tuning.proof.held_out_seeds: 5 must be a multiple of 2"));
}

// A key of a controller or an estimator that no trial has would be tuned for nothing.
TEST(Study, AGainIsReadByATrial) {
  const auto with = [](const std::string& key, const std::string& more) {
    return MessageOf(kHead + "scenario: pool_active\n" + more + "tuning:\n  gains: [{key: " + key +
                     ", low: 0.01, high: " + (key.starts_with("control.pid") ? "9" : "1") + "}]\n" +
                     kObjective);
  };
  const std::string pid = "control.pid.sway.kp_per_s2";
  EXPECT_THAT(
      with(pid, "set: {control.use: lqg}\n"),
      HasSubstr("study.yaml:6: tuning.gains[0].key: control.pid.sway.kp_per_s2 changes no trial: "
                "control.use = lqg"));
  EXPECT_EQ(with(pid, "set: {control.use: pid}\n"), "no error");
  EXPECT_EQ(with(pid, "seeds: 50\nrandom: {control.use: {choice: [lqg, pid]}}\n"), "no error");
  EXPECT_EQ(with("trial.jam.time_s", ""), "no error");
  const std::string search = "estimator.rm_ga.mutation_rate";
  EXPECT_EQ(with(search, ""), "no error");
  EXPECT_THAT(with(search, "set: {estimator.pose_source: true_pose}\n"),
              HasSubstr("changes no trial: estimator.pose_source = true_pose"));
  EXPECT_THAT(with("estimator.fiducial.blur_px", ""),
              HasSubstr("changes no trial: estimator.use = rm_ga"));
}

// A gain that is tuned has one value in all trials: what gives it another would be written over.
TEST(Study, AGainIsNotVariedByTheTrials) {
  const auto with = [](const std::string& more) {
    return MessageOf(
        "schema_version: 1\nscenario: pool_active\nset: {control.use: lqg}\n" + more +
        "\ntuning:\n  gains: [{key: control.lqg.sway.effort_share, low: 0.001, high: 100}]\n" +
        kObjective);
  };
  EXPECT_EQ(with("grid: {water.milk_ml_m3: [0, 10]}"), "no error");
  EXPECT_EQ(with("cases: {a: {control.lqg: {sway: {error_m: 0.02}}}, b: {}}"), "no error");
  const std::string said =
      "study.yaml:6: tuning.gains[0].key: control.lqg.sway.effort_share is tuned and has one value "
      "in all "
      "trials, but also study.yaml:4: ";
  EXPECT_THAT(with("grid: {control.lqg.sway.effort_share: [1, 2]}"),
              HasSubstr(said + "grid.control.lqg.sway.effort_share[0]"));
  EXPECT_THAT(with("grid: {control.lqg: [{sway: {effort_share: 1}}]}"),
              HasSubstr(said + "grid.control.lqg[0].sway"));
  EXPECT_THAT(with("cases: {a: {}, b: {control.lqg: {sway: {effort_share: 2}}}}"),
              HasSubstr(said + "cases.b.control.lqg.sway.effort_share"));
  EXPECT_THAT(with("strata: {a: {control.lqg: {sway: {effort_share: 2}}}}"),
              HasSubstr(said + "strata.a.control.lqg.sway.effort_share"));
  for (const std::string drawn : {"control.lqg.sway.effort_share: {uniform: [1, 2]}",
                                  "control.lqg: {choice: [{sway: {effort_share: 2}}]}"})
    EXPECT_THAT(with("random: {" + drawn + "}"), HasSubstr(said + "random.control.lqg"));
}

// More trials than a plan may have are refused before any runs, not after the search.
TEST(Study, TooManyHeldOutTrialsAreRefused) {
  const auto with = [](const std::string& cells) {
    return MessageOf(
        "schema_version: 1\nscenario: pool_active\n"
        "set: {control.use: lqg}\ngrid: {water.milk_ml_m3: [" +
        cells +
        "]}\ntuning:\n  gains: [{key: control.lqg.sway.effort_share, low: 0.001, high: 100}]\n" +
        kObjective + "  proof: {held_out_seeds: 1000000}\n");
  };
  EXPECT_EQ(with("0, 1, 2, 3, 4, 5, 6, 7, 8, 9"), "no error");
  EXPECT_EQ(with("0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10"),
            "study.yaml: tuning.proof.held_out_seeds: more than 10000000 trials");
}

TEST(Study, EveryBundledOneIsRight) {
  ASSERT_FALSE(config::BundledNames("studies").empty());
  for (const std::string& name : config::BundledNames("studies"))
    EXPECT_FALSE(LoadStudy(name).plan().settings().description.empty()) << name;
}

TEST(Study, ATrialCostsItsTerms) {
  const Study study = StudyOf(kHead + kTrials + kGains +
                              "  objective: [{metric: time_s, weight: 2, failed: 10}, {metric: "
                              "final_error_true_y_m, weight: 100}, {metric: jam_time_s}]\n");
  trial::TrialRecord record;
  record.time_s = 7;
  record.final_error_true.y_m = -0.03;
  EXPECT_EQ(study.CostsOf(record), (std::vector<double>{14, 3, 0}));
  record.failure = trial::Failure::kTimeout;
  EXPECT_EQ(study.CostsOf(record), (std::vector<double>{34, 3, 0}));
  record.time_s = 1e300;  // costs stay finite, and what is made of them
  EXPECT_EQ(study.CostsOf(record)[0], 2 * (kMostCost + 10));
  record.outcome = trial::Outcome::kCrashed;  // nothing is known of it
  EXPECT_EQ(study.CostsOf(record), (std::vector<double>{20, 0, 0}));
}

// The result but for the time it took.
std::string TextOf(const Study& study, TuningResult result) {
  return report::JsonText(report::Document(ReportOf(study, result), TuningJson(study, result))) +
         GainsYaml(study, result);
}

TEST_F(TunerTest, WorkersAndInterruptionsChangeNothing) {
  const Study study = StudyOf(kStudy + kFast);
  const TuningResult alone = Tune(study, File("one.sqlite"), {.jobs = {.workers = 1}});
  EXPECT_EQ(alone.generations.size(), 3u);
  EXPECT_EQ(alone.trials, alone.trials_run);
  EXPECT_GT(std::ranges::count_if(alone.generations, &GenerationRecord::replaced), 0);
  const std::string expected = TextOf(study, alone);
  EXPECT_EQ(TextOf(study, Tune(study, File("three.sqlite"), {.jobs = {.workers = 3}})), expected);

  // stopped again and again after a few trials
  TuningResult result;
  for (int round = 0;; ++round) {
    ASSERT_LT(round, 50);
    int polls = 0;
    try {
      result = Tune(study, File("stopped.sqlite"),
                    {.jobs = {.workers = 2},
                     .on_progress = nullptr,
                     .on_result = nullptr,
                     .stop_requested = [&] { return ++polls > 9; }});
      break;
    } catch (const batch::Stopped&) {
    }
  }
  EXPECT_LT(result.trials_run, result.trials);
  EXPECT_EQ(TextOf(study, result), expected);

  // and once more over a complete file: nothing runs
  const TuningResult again = Tune(study, File("one.sqlite"), {.jobs = {.workers = 1}});
  EXPECT_EQ(again.trials_run, 0);
  EXPECT_EQ(TextOf(study, again), expected);
}

// Whoever looks while it runs sees what the end will say, as far as it is known.
TEST_F(TunerTest, WhatIsFoundSoFarIsABeginningOfWhatIsFound) {
  const Study study = StudyOf(kStudy + kFast);
  std::vector<TuningResult> told;
  std::set<double> shares;  // of the search
  const auto on_progress = [&](const std::string& what, double share) {
    if (what.starts_with("held out")) return;
    EXPECT_GE(share, (shares.empty() ? 0 : *shares.rbegin()) - 1e-9) << what;
    EXPECT_LE(share, 1 + 1e-9) << what;
    shares.insert(share);
  };
  const TuningResult result =
      Tune(study, File("told.sqlite"),
           {.jobs = {.workers = 2},
            .on_progress = on_progress,
            .on_result = [&](const TuningResult& so_far) { told.push_back(so_far); }});
  EXPECT_GT(shares.size(), 10u) << "the bar stands still within a generation";
  ASSERT_EQ(told.size(), 5u) << "beginning, 3 generations, end";
  const std::string generations = TuningJson(study, result)["generations"].dump();
  for (size_t i = 0; i < told.size(); ++i) {
    EXPECT_EQ(told[i].generations.size(), std::min<size_t>(i, 3));
    EXPECT_EQ(told[i].finished, i + 1 == told.size());
    EXPECT_EQ(told[i].held_out.has_value(), i >= 4);
    std::string begun = TuningJson(study, told[i])["generations"].dump();
    begun.pop_back();  // the list's end
    EXPECT_TRUE(generations.starts_with(begun)) << begun;
    EXPECT_GE(told[i].trials, told[i > 0 ? i - 1 : 0].trials);
  }
  EXPECT_EQ(TextOf(study, told.back()), TextOf(study, result));
  double by_terms = 0;
  for (const TermCost& term : result.held_out->terms) by_terms += term.tuned - term.before;
  const double whole = result.held_out->cost_difference.mean;
  EXPECT_NEAR(by_terms, whole, 1e-9 * (1 + std::abs(whole)));
}

// Any beginning of a candidate's trials is fair; the file has all that they differ in.
TEST_F(TunerTest, MeetsCellsAndStrataInTurnAndKeepsThem) {
  const Study study = StudyOf(kHead +
                              "grid: {cameras.delay_frames: [1, 2]}\nseries_every_frames: 10\n"
                              "strata: {near: {start.lateral_m: 0}, far: {start.lateral_m: 0.1}}\n"
                              "random: {vehicle.thrusters.lag_s: {uniform: [0.05, 0.12]}}\n" +
                              kTrials + kGains + kObjective + "  start_may_fail: true\n");
  bool is_enough = false;
  EXPECT_THROW(Tune(study, File("a.sqlite"),
                    {.jobs = {.workers = 1},
                     .on_progress = [&](const std::string& what,
                                        double) { is_enough = what.starts_with("generation 1"); },
                     .stop_requested = [&] { return is_enough; }}),
               batch::Stopped);
  SQLite::Database db(File("a.sqlite"));
  const auto first_8 = [&db](const std::string& what) {
    return db.execAndGet("SELECT " + what + " WHERE trial < 8").getString();
  };
  EXPECT_EQ(first_8("group_concat(\"cameras.delay_frames\" || stratum, ' ') FROM trials"),
            "1near 2near 1far 2far 1near 2near 1far 2far");
  EXPECT_EQ(
      first_8("sum(phase = 'generation 0 incumbent' AND \"control.lqg.sway.effort_share\" = 0.27) "
              "FROM trials"),
      "8");
  EXPECT_EQ(first_8("count(DISTINCT \"vehicle.thrusters.lag_s\") FROM trials"), "4");
  EXPECT_EQ(first_8("count(*) FROM series"), "8");
}

TEST_F(TunerTest, ADamagedFileOfTrialsIsNamed) {
  const Study study = StudyOf(kStudy + kFast);
  int polls = 0;
  const TuningOptions options{
      .jobs = {.workers = 1}, .on_progress = nullptr, .on_result = nullptr, .stop_requested = [&] {
        return ++polls > 9;
      }};
  EXPECT_THROW(Tune(study, File("damaged.sqlite"), options), batch::Stopped);
  SQLite::Database(File("damaged.sqlite"), SQLite::OPEN_READWRITE)
      .exec("UPDATE trials SET time_s = NULL");
  EXPECT_THAT(testing::MessageOf([&] { Tune(study, File("damaged.sqlite"), options); }),
              HasSubstr("damaged.sqlite: is damaged (trial 0 has no time)"));
}

TEST_F(TunerTest, HopelessCandidatesAreGivenUp) {
  // effort all but forbidden: the vehicle is left to itself
  const Study study =
      StudyOf(kHead + kTrials +
              "  gains: [{key: control.lqg.sway.error_m, low: 0.005, high: 50, scale: log}]\n" +
              kObjective + kFast);
  const TuningResult result = Tune(study, File("race.sqlite"), {.jobs = {.workers = 2}});
  int given_up = 0, candidates = 0;
  for (const GenerationRecord& generation : result.generations) {
    given_up += generation.given_up;
    candidates += generation.candidates;
  }
  EXPECT_GT(given_up, 0);
  EXPECT_LT(given_up, candidates);
  EXPECT_LE(result.tuned[0], 0.1);
}

TEST_F(TunerTest, AHopelessStartIsSaidWithTheEvidence) {
  const std::string said = testing::MessageOf(
      [&] { Tune(StudyOf(kStudy), File("hopeless.sqlite"), {.jobs = {.workers = 2}}); });
  EXPECT_THAT(said, HasSubstr("fail in every one of 4 trials"));
  EXPECT_THAT(said, HasSubstr("2.5 s are over"));
  EXPECT_THAT(said, HasSubstr("start_may_fail"));
}

TEST_F(TunerTest, TheGainsFileHoldsTheLawsGroupAndIsRead) {
  const Study study =
      StudyOf(kHead + kTrials +
              "  gains: [{key: control.lqg.sway.effort_share, low: 0.2, high: 3}, {key: "
              "procedure.docking_rate_mps, low: 0.01, high: 0.1}]\n" +
              kObjective);
  TuningResult result;
  result.start = study.start();
  result.tuned = {1.25, 0.0625};
  const std::string file = File("gains.yaml");
  std::ofstream(file) << GainsYaml(study, result);
  const trial::Scenario scenario = trial::LoadScenario("sea_night_active", {}, file);
  EXPECT_EQ(scenario.controller_name(), "lqg");
  EXPECT_EQ(LqgOf(scenario).sway.effort_share, 1.25);
  EXPECT_EQ(scenario.procedure.docking_rate_mps, 0.0625);
  EXPECT_EQ(config::SaveYaml(LqgOf(scenario).heave),
            config::SaveYaml(LqgOf(trial::LoadScenario("pool_active", {})).heave));
}

}  // namespace
}  // namespace turbidock::tuning
