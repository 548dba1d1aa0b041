// Every key of a scenario that names a file: where it is found, and what is said of results once
// the file is another.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "experiments/batch/batch.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/studies/gate/gate.h"
#include "experiments/studies/tuning/tuner.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/trial.h"
#include "tests/settings/key_cases.h"
#include "tests/support/message_of.h"

namespace turbidock {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using testing::DifferenceOf;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using testing::MessageOf;

std::vector<std::string> FileKeys() {
  std::vector<std::string> keys;
  for (const config::KeyDoc& doc : trial::ScenarioKeys())
    if (doc.type == "file") keys.push_back(doc.key);
  return keys;
}

// "a.b" and a value as {a: {b: VALUE}}.
std::string Nested(std::string key, const std::string& value) {
  std::string closing;
  for (size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.', dot + 2)) {
    key.replace(dot, 1, ": {");
    closing += "}";
  }
  return key + ": " + value + closing;
}

void Write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

// A folder with two files that the key may name, and a working directory that is another one.
class NamedFile : public ::testing::TestWithParam<std::string> {
 protected:
  const std::string key_ = GetParam();
  const fs::path before_ = fs::current_path();
  const fs::path folder_ = fs::path(::testing::TempDir()) / ("named_" + key_);
  std::string own_, other_;  // without their folder

  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "scenes");
    fs::create_directories(folder_ / "elsewhere");
    own_ = fs::path(testing::MakeFileFor(key_, folder_, "own", 1)).filename();
    other_ = fs::path(testing::MakeFileFor(key_, folder_, "other", 2)).filename();
    fs::current_path(folder_ / "elsewhere");
  }
  void TearDown() override {
    fs::current_path(before_);
    fs::remove_all(folder_);
  }

  // What has trials of a moment.
  static std::string Set(const std::string& more = "") {
    return "{estimator.pose_source: true_pose, trial.duration_s: 0.2" + more + "}";
  }
  // What has them use the file.
  std::string Uses() const {
    return key_ == "control.playback.file" ? "control.use: playback" : "";
  }
  std::string SetWithOwn() const {
    return Set(fmt::format(", {}: {}{}", key_, own_, Uses().empty() ? "" : ", " + Uses()));
  }

  // The own file, and what else goes with it: a vehicle's data.
  std::vector<std::string> Own() const {
    std::vector<std::string> files;
    for (const auto& file : fs::directory_iterator(folder_))
      if (file.path().stem() == fs::path(own_).stem()) files.push_back(file.path().filename());
    return files;
  }
  void Change(const std::string& file) const {
    std::string text = system::ReadWhole(folder_ / file);
    if (const size_t at = text.find("mass_kg: 15"); at != std::string::npos) text[at + 10] = '6';
    Write(folder_ / file, text + "\n");
  }

  // Two trials with the own file, two with the other.
  batch::Plan LoadPlan() const {
    Write(folder_ / "plan.yaml",
          fmt::format("schema_version: 1\nscenario: pool_active\nseeds: 2\nset: {}\n"
                      "cases: {{one: {{{}}}}}\ngrid: {{{}: [{}, {}]}}\n",
                      Set(), Uses(), key_, own_, other_));
    return batch::LoadPlan("../plan.yaml");
  }

  void ExpectNames(const trial::Scenario& scenario, const fs::path& file) const {
    EXPECT_EQ(
        config::TextOf(scenario, key_),
        config::TextOf(trial::LoadScenario("pool_active", {key_ + "=" + file.string()}), key_));
    EXPECT_THAT(scenario.model_files, Contains(Field(&trial::ModelFile::file, file.string())));
  }
};

INSTANTIATE_TEST_SUITE_P(Of, NamedFile, ::testing::ValuesIn(FileKeys()),
                         [](const ::testing::TestParamInfo<std::string>& of) {
                           std::string name = of.param;
                           std::ranges::replace(name, '.', '_');
                           return name;
                         });

// In every place of a plan, also of one that is stored; also by a group as a whole.
TEST_P(NamedFile, IsFoundBesideThePlan) {
  const size_t dot = key_.rfind('.');
  const std::string value = fmt::format("{}: {}", key_, own_),
                    whole = dot == std::string::npos
                                ? value
                                : fmt::format("{}: {{{}: {}}}", key_.substr(0, dot),
                                              key_.substr(dot + 1), own_);
  int count = 0;
  for (const std::string& places :
       {"set: {" + value + "}", "set: {" + whole + "}", "cases: {one: {" + value + "}}",
        "cases: {one: {" + whole + "}}", "strata: {one: {" + value + "}}",
        "strata: {one: {" + whole + "}}", fmt::format("grid: {{{}: [{}]}}", key_, own_),
        fmt::format("grid: {{{}: [{}]}}", whole.substr(0, whole.find(": ")),
                    whole.substr(whole.find(": ") + 2)),
        fmt::format("random: {{{}: {{choice: [{}]}}}}", key_, own_),
        fmt::format("random: {{{}: {{choice: [{}]}}}}", whole.substr(0, whole.find(": ")),
                    whole.substr(whole.find(": ") + 2))}) {
    Write(folder_ / "plan.yaml", "schema_version: 1\nscenario: pool_active\n" + places + "\n");
    const batch::Plan plan = batch::LoadPlan("../plan.yaml");
    ExpectNames(plan.ScenarioOf(plan.Trial(0)), folder_ / own_);
    EXPECT_EQ(
        MessageOf([&] {
          const batch::Plan stored(plan.resolved(), "plan");
          EXPECT_EQ(
              DifferenceOf(plan.ScenarioOf(plan.Trial(0)), stored.ScenarioOf(stored.Trial(0))), "");
        }),
        "no error")
        << places;
    ++count;
  }
  EXPECT_EQ(count, 10);
}

TEST_P(NamedFile, IsFoundBesideTheScenarioTheGateAndTheStudy) {
  const fs::path scene = testing::MakeFileFor(key_, folder_ / "scenes", "beside", 1);
  // `trial` has the scene that is named; any other file is in a group beside it
  Write(folder_ / "scenes/mine.yaml",
        "schema_version: 1\ntrial: {seed: 1, duration_s: 1, scene: " +
            (key_ == "trial.scene" ? scene.filename().string() + "}\n"
                                   : "pool_active.xml}\n" + Nested(key_, scene.filename()) + "\n"));
  Write(folder_ / "plan.yaml", "schema_version: 1\nscenario: scenes/mine.yaml\n");
  const batch::Plan plan = batch::LoadPlan("../plan.yaml");
  ExpectNames(plan.ScenarioOf(plan.Trial(0)), scene);
  Write(folder_ / "gate.yaml", "schema_version: 1\ncases:\n  a: {scenario: pool_active, " +
                                   SetWithOwn().substr(1) +
                                   "\n  b: {scenario: scenes/mine.yaml}\n"
                                   "gate: {baseline: b.yaml}\n");
  const gate::Gate gate = gate::LoadGate("../gate.yaml");
  ExpectNames(gate.plan.ScenarioOf(gate.plan.FirstOf(0)), folder_ / own_);
  ExpectNames(gate.plan.ScenarioOf(gate.plan.FirstOf(1)), scene);
  Write(folder_ / "study.yaml",
        "schema_version: 1\nscenario: pool_active\nset: " + SetWithOwn() +
            "\ntuning: {gains: [{key: trial.jam.time_s, low: 0.5, high: 2}], "
            "objective: [{metric: time_s}]}\n");
  const tuning::Study study = tuning::LoadStudy("../study.yaml");
  ExpectNames(study.ScenarioOf(study.plan(), 0, study.start()), folder_ / own_);
}

TEST_P(NamedFile, IsWhatABatchWasBegunWith) {
  const batch::JobOptions jobs{.workers = 1};
  for (const std::string& file : Own()) {
    const std::string results = folder_ / (file + ".db");
    const batch::Plan plan = LoadPlan();
    {
      batch::ResultStore store = batch::OpenResults(results, plan, {}, /*anew=*/false, jobs);
      int64_t stored = 0;
      batch::RunBatch(plan,
                      {.jobs = jobs,
                       .on_trial = [&](const batch::StoredTrial&) { ++stored; },
                       .stop_requested = [&] { return stored >= 3; }},
                      {}, &store);
      ASSERT_THAT(store.Done(), ElementsAre(0, 1, 2));
    }
    Change(file);
    // while it runs
    const auto run = [&](int64_t trial) {
      return MessageOf([&] {
        batch::TrialWork().run(batch::TrialJob(trial, plan.ScenarioOf(plan.Trial(trial))).input);
      });
    };
    EXPECT_THAT(run(1), HasSubstr(file + " has changed"));
    EXPECT_EQ(run(3), "no error");
    // when it goes on
    const batch::Plan now = LoadPlan();
    try {
      batch::OpenResults(results, now, {}, /*anew=*/false, jobs);
      ADD_FAILURE() << "not refused: " << file;
    } catch (const batch::OtherResults& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr(file), HasSubstr("--anew")));
    }
    batch::ResultStore store = batch::OpenResults(results, now, {}, /*anew=*/true, jobs);
    EXPECT_THAT(store.Done(), ElementsAre(2));
  }
}

// Shards that ran in two copies of a folder are one batch; a folder that moves takes its results
// along.
TEST_P(NamedFile, MayMoveWithItsPlan) {
  const batch::JobOptions jobs{.workers = 1};
  LoadPlan();
  const fs::path copy = folder_.string() + "_copy";
  fs::remove_all(copy);
  fs::copy(folder_, copy, fs::copy_options::recursive);
  const auto run = [&](const fs::path& folder, int shard) {
    const batch::Plan plan = batch::LoadPlan(folder / "plan.yaml");
    batch::ResultStore store = batch::OpenResults(folder / "elsewhere/part.db", plan, {shard, 2},
                                                  /*anew=*/false, jobs);
    batch::RunBatch(plan, {.jobs = jobs}, {}, &store);
  };
  run(folder_, 1);
  run(copy, 2);
  batch::StoreHeader header = batch::ResultStore::Read(folder_ / "elsewhere/part.db").header();
  header.shard = {};
  {
    batch::ResultStore all = batch::ResultStore::Write(folder_ / "elsewhere/all.db", header);
    all.Merge(folder_ / "elsewhere/part.db");
    all.Merge(copy / "elsewhere/part.db");
    EXPECT_EQ(all.Done().size(), 4u);
  }
  fs::remove_all(copy);
  fs::current_path(before_);
  fs::rename(folder_, copy);
  const batch::ResultStore moved = batch::ResultStore::Read(copy / "elsewhere/all.db");
  const batch::Plan stored(moved.PlanHere(), "plan");
  for (const int64_t trial : moved.Done())
    EXPECT_EQ(trial::RunTrial(stored.ScenarioOf(stored.Trial(trial))).digest,
              moved.Trial(trial).record.digest);
  // and goes on there
  const batch::Plan again = batch::LoadPlan(copy / "plan.yaml");
  EXPECT_EQ(batch::OpenResults(copy / "elsewhere/all.db", again, {}, /*anew=*/false, jobs).Done(),
            moved.Done());
  fs::remove_all(copy);
}

TEST_P(NamedFile, IsWhatAGateAndAStudyWereBegunWith) {
  Write(folder_ / "gate.yaml", "schema_version: 1\nscenario: pool_active\nseeds: 9\nset: " +
                                   SetWithOwn() + "\ngate: {baseline: b.yaml}\n");
  Write(folder_ / "study.yaml",
        "schema_version: 1\nscenario: pool_active\nset: " + SetWithOwn() +
            "\ntuning: {gains: [{key: trial.jam.time_s, low: 0.5, high: 2}], "
            "objective: [{metric: time_s}], start_may_fail: true}\n");
  const auto open_gate = [&] {
    const gate::Gate gate = gate::LoadGate("../gate.yaml");
    batch::ResultStore store =
        gate::OpenTrials(folder_ / "gate.db", gate, /*anew=*/false, {},
                         [](const std::string& said) { ADD_FAILURE() << said; });
    int64_t stored = 0;
    gate::GateRun run(gate);
    try {
      run.Run({.on_trial = [&](const batch::StoredTrial&) { ++stored; },
               .stop_requested = [&] { return stored > 0; }},
              &store);
    } catch (const batch::Stopped&) {
    }
  };
  const auto tune = [&] {
    try {
      tuning::Tune(tuning::LoadStudy("../study.yaml"), folder_ / "tune.db",
                   {.stop_requested = [] { return true; }});
    } catch (const batch::Stopped&) {
    }
  };
  for (int again = 0; again < 2; ++again) {
    EXPECT_EQ(MessageOf(open_gate), "no error");
    EXPECT_EQ(MessageOf(tune), "no error");
  }
  Change(own_);
  EXPECT_THAT(MessageOf(open_gate),
              AllOf(HasSubstr("was begun with something else"), HasSubstr(own_)));
  EXPECT_THAT(MessageOf(tune), AllOf(HasSubstr("was begun with something else"), HasSubstr(own_)));
}

}  // namespace
}  // namespace turbidock
