// A gate that was stopped says what one says that ran through, and so does one with other workers.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <SQLiteCpp/SQLiteCpp.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "experiments/batch/batch_report.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/report/json.h"
#include "experiments/studies/gate/gate.h"
#include "sim/base/check.h"
#include "tests/support/message_of.h"
#include "tests/support/own_folder.h"

namespace turbidock::gate {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MessageOf;
using ::testing::StartsWith;

class GateRepeat : public testing::OwnFolder {
 protected:
  void SetUp() override {
    // Without cameras; docks in 2.7 to 2.8 s.
    std::ofstream(File("short.yaml"))
        << "schema_version: 1\n"
           "trial: {scene: pool_active.xml, seed: 1, duration_s: 3.5, after_docked_s: 0}\n"
           "estimator: {pose_source: true_pose}\ncontrol: {use: pid}\n"
           "start: {distance_min_m: 0.45, distance_max_m: 0.5, lateral_m: 0.02,\n"
           "        vertical_m: 0.02, heading_rad: 0.02}\n"
           "procedure: {found_hold_s: 0.1, servo_x_m: 0.45, docking_rate_mps: 0.1}\n";
    WriteGate(20);
  }

  void WriteGate(int seeds, int master_seed = 1,
                 const std::string& cases = "{plain: {}, '10': {start.lateral_m: 0.03}}") {
    std::ofstream(File("gate.yaml"))
        << "schema_version: 1\nscenario: short.yaml\nseeds: " << seeds
        << "\nmaster_seed: " << master_seed << "\ncases: " << cases
        << "\n"
           "gate: {baseline: gate.baseline.yaml, alpha: 0.1, beta: 0.1,\n"
           "       margins: {success_rate: 0.5, time_s: 1}}\n";
  }
  Gate Load(const std::vector<std::string>& assignments = {}) {
    return LoadGate(File("gate.yaml"), {}, config::ParseAssignments(assignments));
  }
  batch::ResultStore Open(const std::string& name, const std::vector<std::string>& assignments,
                          bool anew = false) {
    return OpenTrials(File(name), Load(assignments), anew, {},
                      [&](const std::string& text) { said_ += text; });
  }
  std::string Judge(const Baseline& baseline, const std::vector<std::string>& assignments,
                    const batch::RunOptions& options, batch::ResultStore* store) {
    const Gate gate = Load(assignments);
    GateRun run(gate, baseline);
    run.Run(options, store);
    return report::JsonText(run.Report());
  }
  Baseline Measure(const std::vector<std::string>& assignments = {},
                   const batch::RunOptions& options = {}, batch::ResultStore* store = nullptr) {
    const Gate gate = Load(assignments);
    GateRun run(gate);
    run.Run(options, store);
    return run.Measured();
  }

  std::string said_;
};

TEST_F(GateRepeat, StopsAndWorkersDoNotShowInTheVerdict) {
  const Baseline baseline = Measure();
  for (const std::vector<std::string>& assignments :
       {std::vector<std::string>{}, std::vector<std::string>{"trial.duration_s=2.7"}}) {
    const std::string expected = Judge(baseline, assignments, {.jobs = {.workers = 1}}, nullptr);
    EXPECT_THAT(expected, StartsWith(assignments.empty() ? "{\n  \"verdict\": \"pass\""
                                                         : "{\n  \"verdict\": \"fail\""));
    for (const auto& [workers, stop_after] : {std::pair{1, 3}, std::pair{2, 1}, std::pair{2, 8}}) {
      std::string judged;
      for (int rounds = 0; judged.empty(); ++rounds) {
        ASSERT_LT(rounds, 60);
        batch::ResultStore store = Open("trials.db", assignments);
        int64_t run = 0;
        try {
          judged = Judge(baseline, assignments,
                         {.jobs = {.workers = workers},
                          .on_trial = [&](const batch::StoredTrial&) { ++run; },
                          .stop_requested = [&, most = stop_after] { return run >= most; }},
                         &store);
        } catch (const batch::Stopped&) {
          EXPECT_GE(run, stop_after);
        }
      }
      EXPECT_EQ(judged, expected) << workers << " workers, stopped after " << stop_after;
      fs::remove(File("trials.db"));
    }
  }
  EXPECT_THAT(said_, IsEmpty());
}

TEST_F(GateRepeat, ABaselineGoesOnAfterAStop) {
  const std::string whole = BaselineText(Measure());
  std::string text;
  while (text.empty()) {
    batch::ResultStore store = Open("baseline.db", {});
    int64_t run = 0;
    try {
      text = BaselineText(Measure({},
                                  {.jobs = {.workers = 2},
                                   .on_trial = [&](const batch::StoredTrial&) { ++run; },
                                   .stop_requested = [&] { return run >= 7; }},
                                  &store));
    } catch (const batch::Stopped&) {
    }
  }
  EXPECT_EQ(text, whole);
}

// Another build's trials, in its file, are judged as if they had been run now.
TEST_F(GateRepeat, AFileThatAKilledRunLeftEmptyIsBegun) {
  WriteGate(3);
  std::ofstream(File("trials.db")).flush();
  EXPECT_EQ(Open("trials.db", {}).header().trials, 6);
  EXPECT_EQ(said_, "");
}

TEST_F(GateRepeat, AFileOfTrialsIsJudgedAsTheGateJudgedIt) {
  const Baseline baseline = Measure();
  const std::vector<std::string> slow = {"trial.duration_s=2.7"};
  std::string judged;
  {
    batch::ResultStore store = Open("trials.db", slow);
    judged = Judge(baseline, slow, {.jobs = {.workers = 2}}, &store);
  }
  const auto stored = batch::ResultStore::Read(File("trials.db"));
  const auto status = batch::ReportOf(batch::SummaryOf(stored, stored.file()));
  EXPECT_EQ(status.verdict.word, "not running") << "how many it needs, its plan does not say";
  EXPECT_THAT(report::Text(status), HasSubstr("By case"));
  GateReport again = ReportOfFile(File("trials.db"), Load(), baseline);
  EXPECT_EQ(again.assignments, slow) << "what that build had otherwise";
  EXPECT_EQ(report::JsonText(again), judged);
  WriteGate(20, /*master_seed=*/2);
  Baseline other = Measure();
  EXPECT_THAT(MessageOf([&] { ReportOfFile(File("trials.db"), Load(), other); }),
              HasSubstr("is none of the baseline's"));
}

// Whatever a trial depends on; not what only the verdict does. Another program is what a gate is
// there for: its trials are begun anew.
TEST_F(GateRepeat, TrialsOfAnotherGateAreRefusedAndOfAnotherProgramBegunAnew) {
  const auto stored = [&](const std::vector<std::string>& assignments) {
    return std::ssize(Open("trials.db", assignments).Done());
  };
  const auto fill = [&] {
    batch::ResultStore store = Open("trials.db", {});
    Measure({}, {.jobs = {.workers = 2}}, &store);
  };
  WriteGate(2);
  fill();
  EXPECT_EQ(stored({}), 4);
  WriteGate(3);
  EXPECT_EQ(stored({}), 4);
  EXPECT_THAT(said_, IsEmpty());
  EXPECT_THAT(MessageOf([&] { stored({"cameras.delay_frames=4"}); }),
              HasSubstr("cameras.delay_frames: 1 then, 4 now"));
  EXPECT_EQ(stored({}), 4);
  EXPECT_EQ(std::ssize(Open("trials.db", {"cameras.delay_frames=4"}, /*anew=*/true).Done()), 0);
  Open("trials.db", {}, /*anew=*/true);
  fill();
  WriteGate(3, /*master_seed=*/2);
  EXPECT_THAT(MessageOf([&] { stored({}); }), HasSubstr("master_seed: 1 then, 2 now"));
  WriteGate(3);
  EXPECT_THAT(said_, IsEmpty());
  // as by another build
  SQLite::Database(File("trials.db"), SQLite::OPEN_READWRITE)
      .exec(
          "UPDATE meta SET value = 'another' WHERE key = 'build'; UPDATE trials SET identity = "
          "'x'");
  EXPECT_EQ(stored({}), 0);
  EXPECT_THAT(said_, HasSubstr("has trials of another program (another): begun anew"));

  // Another key that varies needs other columns.
  std::ofstream(File("gate.yaml"))
      << "schema_version: 1\nscenario: short.yaml\nseeds: 2\ngrid: {start.lateral_m: [0.02]}\n"
         "gate: {baseline: gate.baseline.yaml, margins: {success_rate: 0.5}}\n";
  EXPECT_THAT(MessageOf([&] { stored({}); }), HasSubstr("or run what changed with --anew"));
  {
    batch::ResultStore store = Open("trials.db", {}, /*anew=*/true);
    Measure({}, {}, &store);
  }
  EXPECT_EQ(stored({}), 2);
  // Trials that the gate has no more are in nobody's way, but for a batch's file.
  WriteGate(3);
  EXPECT_THAT(MessageOf([&] { stored({}); }), HasSubstr("--anew"));
  EXPECT_EQ(std::ssize(Open("trials.db", {}, /*anew=*/true).Done()), 0);
  fill();
  WriteGate(2, 1, "{renamed: {}, '10': {start.lateral_m: 0.03}}");
  EXPECT_THAT(MessageOf([&] { stored({}); }), HasSubstr("(--anew: without its trials)"));
  EXPECT_EQ(std::ssize(Open("trials.db", {}, /*anew=*/true).Done()), 0);
  std::ofstream(File("notes.db")) << "what I noted";
  EXPECT_THROW(Open("notes.db", {}), ConfigError);
}

// What a trial reads counts by its content: no verdict is on two vehicles.
TEST_F(GateRepeat, TrialsOfAVehicleThatHasChangedAreRefused) {
  const std::string own = File("own.xml");
  fs::copy_file(config::ModelPath("vehicle.xml"), own);
  fs::copy_file(config::ModelPath("vehicle.yaml"), File("own.yaml"));
  const std::vector<std::string> assignments = {"vehicle.model=" + own};
  WriteGate(1);
  {
    batch::ResultStore store = Open("trials.db", assignments);
    Measure(assignments, {}, &store);
  }
  EXPECT_EQ(std::ssize(Open("trials.db", assignments).Done()), 2);
  std::ofstream(own, std::ios::app) << "<!-- heavier -->\n";
  EXPECT_THAT(MessageOf([&] { Open("trials.db", assignments); }), HasSubstr(own + " has changed"));
  EXPECT_THAT(Open("trials.db", assignments, /*anew=*/true).Done(), IsEmpty());
}

TEST_F(GateRepeat, ACrashIsNoVerdictAndRunsAgain) {
  const std::vector<std::string> assignments = {"trial.duration_s=1000", "trial.after_docked_s=60"};
  batch::ResultStore store = Open("trials.db", assignments);
  EXPECT_THROW(Measure(assignments, {.time_limit_s = 0.2}, &store), SimulatorFault);
  EXPECT_THAT(store.Done(), IsEmpty());
}

}  // namespace
}  // namespace turbidock::gate
