// A batch gives the same rows however it is run: workers, shards, interruptions. Through the
// program, as a user meets it, on trials of a few frames.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <SQLiteCpp/SQLiteCpp.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "sim/base/random.h"
#include "tests/support/own_folder.h"
#include "tests/support/program.h"

namespace turbidock::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class Batch : public OwnFolder {
 protected:
  void SetUp() override {
    std::ofstream(plan_) << "schema_version: 1\n"
                            "description: tiny trials\n"
                            "seeds: 3\n"
                            "set: {trial.duration_s: 0.1}\n"
                            "grid: {scenario: [pool_active, sea_night_passive]}\n"
                            "random:\n"
                            "  water.milk_ml_m3: {uniform: [0, 30]}\n"
                            "  start.heading_rad: {choice: [0, 0.1]}\n";
  }

  std::string Run(const std::vector<std::string>& arguments, int expected_code = 0) {
    const ProgramEnd end = RunProgram(arguments);
    EXPECT_EQ(end.exit_code, expected_code) << end.err;
    return end.out + end.err;
  }
  std::string RunBatch(const std::string& db, const std::vector<std::string>& more = {},
                       int expected_code = 0) {
    std::vector<std::string> arguments = {"batch", plan_, "--out", File(db), "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Run(arguments, expected_code);
  }
  // Begins the batch and kills it so many times; what it leaves is not finished.
  void KillAtRandomMoments(const std::string& db, int times) {
    Rng rng = SeedTree(7).Stream("kill");
    for (int kills = 0, rounds = 0; kills < times; ++rounds) {
      ASSERT_LT(rounds, 10 * times);
      const pid_t pid =
          StartProgram({"batch", plan_, "--out", File(db), "--workers", "2", "--quiet"});
      std::this_thread::sleep_for(std::chrono::duration<double>(rng.Uniform(0.02, 0.6)));
      kill(pid, SIGKILL);
      int status = 0;
      ASSERT_EQ(waitpid(pid, &status, 0), pid);
      kills += WIFSIGNALED(status);
      // Every kill counts that meets a batch that has something left to do.
      if (!WIFSIGNALED(status)) fs::remove(File(db));
    }
  }
  // All that is in the view `results`, a line a trial.
  std::string Rows(const std::string& db) const {
    const SQLite::Database file(File(db));
    SQLite::Statement query(file, "SELECT * FROM results");
    std::string rows;
    while (query.executeStep()) {
      for (int i = 0; i < query.getColumnCount(); ++i) rows += query.getColumn(i).getString() + ",";
      rows += "\n";
    }
    return rows;
  }

  const std::string plan_ = (folder_ / "tiny.yaml").string();
};

TEST_F(Batch, WorkersAndShardsDoNotShowInTheRows) {
  RunBatch("one.db", {"--workers", "1"});
  RunBatch("two.db", {"--workers", "2"});
  const std::string rows = Rows("one.db");
  EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), 6);
  EXPECT_EQ(Rows("two.db"), rows);
  std::vector<std::string> merge = {"merge", "--complete", File("merged.db")};
  for (const char* shard : {"1", "2", "3", "4"}) {
    RunBatch(std::string("shard") + shard + ".db",
             {"--workers", "1", "--shard", std::string(shard) + "/4"});
    merge.push_back(File(std::string("shard") + shard + ".db"));
  }
  Run(merge);
  EXPECT_EQ(Rows("merged.db"), rows);

  Run({"replay", File("merged.db"), "4", "--out", File("replay"), "--no-video", "--quiet"});
  const auto status = nlohmann::json::parse(Run({"status", File("one.db"), "--json"}));
  EXPECT_EQ(status["done"], 6);
  EXPECT_EQ(status["running"], false);
  // a result, on stdout: what status says, however quiet
  EXPECT_EQ(RunProgram({"batch", plan_, "--out", File("one.db"), "--quiet"}).out,
            RunProgram({"status", File("one.db")}).out);
  EXPECT_THAT(Run({"status", File("one.db"), "--over", "start.heading_rad", "--by", "scenario"}),
              HasSubstr("below 50 % everywhere"));
}

TEST_F(Batch, KilledTwentyTimesAtRandomMomentsItLosesAndDoublesNothing) {
  RunBatch("whole.db");
  KillAtRandomMoments("killed.db", 20);
  RunBatch("killed.db");
  EXPECT_EQ(Rows("killed.db"), Rows("whole.db"));
}

// Cells that need different numbers of trials: in the calm sea those dock that have the time to.
const std::string kPrecisionPlan =
    "schema_version: 1\n"
    "description: as many trials as it takes\n"
    "seeds: 5\n"
    "precision: 0.2\n"
    "set: {estimator.pose_source: true_pose, trial.after_docked_s: 0}\n"
    "grid: {scenario: [sea_night_active], sea.state: [calm, rough]}\n"
    "random: {trial.duration_s: {choice: [0.1, 40]}}\n";

TEST_F(Batch, WithAPrecisionWorkersShardsAndKillsDoNotShowInTheRows) {
  std::ofstream(plan_) << kPrecisionPlan;
  RunBatch("one.db", {"--workers", "1"});
  const std::string rows = Rows("one.db");
  const auto status =
      nlohmann::json::parse(Run({"status", File("one.db"), "--json", "--by", "sea.state"}));
  const int calm = status["groups"][0]["trials"], rough = status["groups"][1]["trials"];
  EXPECT_NE(calm, rough);
  EXPECT_EQ(calm % 5 + rough % 5, 0);
  EXPECT_EQ(calm + rough, status["done"]);
  EXPECT_EQ(status["trials"], status["done"]);
  EXPECT_EQ(status["precision"]["reached"], 2);
  const auto& wilson = status["groups"][1]["wilson"];
  EXPECT_LE(wilson[1].get<double>() - wilson[0].get<double>(), 0.4);

  for (const char* workers : {"2", "3"}) {
    RunBatch("more.db", {"--workers", workers});
    EXPECT_EQ(Rows("more.db"), rows) << workers << " workers";
    fs::remove(File("more.db"));
  }
  std::vector<std::string> merge = {"merge", "--complete", File("merged.db")};
  for (const std::string shard : {"1", "2", "3"}) {  // two cells: one shard has nothing to do
    RunBatch("shard" + shard + ".db", {"--workers", "2", "--shard", shard + "/3"});
    merge.push_back(File("shard" + shard + ".db"));
  }
  Run(merge);
  EXPECT_EQ(Rows("merged.db"), rows);
  EXPECT_THAT(Run({"merge", "--complete", File("half.db"), File("shard1.db")}, 1),
              HasSubstr("half.db: "));

  KillAtRandomMoments("killed.db", 3);
  RunBatch("killed.db");
  EXPECT_EQ(Rows("killed.db"), rows);

  Run({"replay", File("merged.db"), "3", "--out", File("replay"), "--no-video", "--quiet"});
  RunBatch("six.db", {"--seeds", "6"});  // exactly so many, whatever the precision
  EXPECT_THAT(RunBatch("six.db", {"--seeds", "2"}, 2),
              HasSubstr("was begun with something else: seeds: 6 then, 2 now: trial "));
  const auto compared =
      nlohmann::json::parse(Run({"compare", File("one.db"), File("six.db"), "--json"}));
  EXPECT_EQ(compared["changes"][0]["pairs"], 12);
}

// What a trial reads counts by its content: a batch never goes on with another vehicle.
TEST_F(Batch, IsNotResumedWhenAModelFileHasChanged) {
  const std::string models = TURBIDOCK_TEST_DATA "/../../models/";
  const auto text_of = [](const std::string& file) {
    std::ifstream in(file);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const auto write = [&](const char* name, const std::string& text) {
    std::ofstream(File(name)) << text;
  };
  std::string vehicle = text_of(models + "vehicle.xml");
  vehicle.replace(vehicle.find("<mujoco>"), 8, "<mujoco><include file=\"looks.xml\"/>");
  const std::string hull = "<geom name=\"hull_deck\"";
  vehicle.insert(vehicle.find(hull), "<geom name=\"hull_fin\" type=\"mesh\" mesh=\"fin\"/>");
  write("own.xml", vehicle);
  write("own.yaml", text_of(models + "vehicle.yaml"));
  write("looks.xml", "<mujoco><asset><mesh name=\"fin\" file=\"fin.obj\"/></asset></mujoco>");
  write("fin.obj",
        "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  std::ofstream(plan_) << "schema_version: 1\nscenario: sea_night_active\nseeds: 2\n"
                          "set: {vehicle.model: '" +
                              File("own.xml") +
                              "', estimator.pose_source: true_pose, trial.duration_s: 0.1}\n";
  RunBatch("a.db", {"--shard", "1/2"});
  RunBatch("a.db", {"--shard", "1/2"});  // nothing has changed
  for (const char* name : {"own.xml", "looks.xml", "fin.obj", "own.yaml"}) {
    const std::string before = text_of(File(name));
    const bool is_xml = std::string(name).ends_with(".xml");
    write(name, before + (is_xml ? "<!-- heavier -->\n" : "# finer\n"));
    EXPECT_THAT(RunBatch("a.db", {"--shard", "1/2"}, 2),
                HasSubstr("the file " + File(name) + " has changed"));
    EXPECT_THAT(Run({"replay", File("a.db"), "0"}, 2),
                HasSubstr(File(name) + " is not what it was when the plan began"));
    write(name, before);
  }
  RunBatch("a.db", {"--shard", "1/2"});  // as it was
}

// What decides no result, but what is kept of one, does not change within a file either.
TEST_F(Batch, IsNotResumedWithOtherSeriesOrOtherLimits) {
  const auto write = [&](const std::string& settings) {
    std::ofstream(plan_) << "schema_version: 1\nscenario: sea_night_active\nseeds: 2\n"
                            "set: {trial.duration_s: 1}\n" +
                                settings;
  };
  write("series_every_frames: 2\n");
  RunBatch("series.db");
  write("series_every_frames: 3\n");
  EXPECT_THAT(RunBatch("series.db", {}, 2), HasSubstr("series_every_frames: 2 then, 3 now"));
  RunBatch("series.db", {"--anew"});
  RunBatch("series.db");
  write("trial_time_limit_s: 0.1\n");
  RunBatch("hung.db");
  EXPECT_THAT(Rows("hung.db"), HasSubstr("hung"));
  write("trial_time_limit_s: 300\n");
  EXPECT_THAT(RunBatch("hung.db", {}, 2), HasSubstr("trial_time_limit_s: 0.1 then, 300 now"));
  RunBatch("hung.db", {"--anew"});
  EXPECT_THAT(Rows("hung.db"), Not(HasSubstr("hung")));
}

// However its values are written, a plan is the same.
TEST_F(Batch, GoesOnWithOtherSpellings) {
  const auto write = [&](const std::string& description, const std::string& current) {
    std::ofstream(plan_) << "schema_version: 1\ndescription: " + description +
                                "\nscenario: sea_night_active\nseeds: 2\n"
                                "set: {estimator.pose_source: true_pose, trial.duration_s: 0.1}\n"
                                "grid: {sea.current.surface_velocity_mps: " +
                                current + "}\nrandom: {start.lateral_m: {uniform: [0, 0.1]}}\n";
  };
  write("a", "[[0, 0.1, 0], [0, 0.2, 0]]");
  RunBatch("a.db");
  const std::string rows = Rows("a.db");
  RunBatch("1.db", {"--shard", "1/2"});
  write("b", "[[0.0, 0.10, 0], [0,2e-1,0]]");
  RunBatch("a.db");
  EXPECT_EQ(Rows("a.db"), rows);
  RunBatch("2.db", {"--shard", "2/2"});
  Run({"merge", "--complete", File("all.db"), File("1.db"), File("2.db")});
  write("b", "[[0, 0.1, 0], [0, 0.10, 0.0]]");
  EXPECT_THAT(RunBatch("b.db", {}, 2), HasSubstr("is given twice"));
}

// A file of the user's that a bundled one's place is taken by.
TEST_F(Batch, NamesAFileThatHasTakenAnothersPlace) {
  const std::string models = TURBIDOCK_TEST_DATA "/../../models/";
  fs::copy_file(models + "sea_active.xml", File("scene.xml"));
  std::ofstream(plan_) << "schema_version: 1\nscenario: sea_night_active\nseeds: 2\n"
                          "set: {trial.scene: ./scene.xml, estimator.pose_source: true_pose, "
                          "trial.duration_s: 0.1}\n";
  RunBatch("a.db");
  fs::copy_file(models + "station.xml", File("station.xml"));
  EXPECT_THAT(RunBatch("a.db", {}, 2),
              HasSubstr("it reads the file " + File("station.xml") + " now"));
}

TEST_F(Batch, StopsOnASignalAndGoesOn) {
  for (const auto& [signal, code] : {std::pair(SIGINT, 130), {SIGTERM, 143}}) {
    fs::remove(File("err"));
    const pid_t pid = StartProgram(
        {"batch", plan_, "--out", File("a.db"), "--set", "trial.duration_s=50"}, File("err"));
    int status = 0;
    const auto is_at_work = [&] {
      std::ifstream said(File("err"));
      return std::string(std::istreambuf_iterator<char>(said), {}).find("plan ") !=
             std::string::npos;
    };
    while (!is_at_work()) ASSERT_EQ(waitpid(pid, &status, WNOHANG), 0);
    kill(pid, signal);
    ASSERT_EQ(waitpid(pid, &status, 0), pid);
    EXPECT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), code);
  }
}

TEST_F(Batch, ATamperedResultIsFoundOut) {
  RunBatch("a.db", {"--seeds", "1"});
  {
    SQLite::Database db(File("a.db"), SQLite::OPEN_READWRITE);
    db.exec("UPDATE trials SET digest = 'feedfeedfeedfeed' WHERE trial = 1");
  }
  EXPECT_THAT(Run({"replay", File("a.db"), "0", "--out", File("replay"), "--no-video"}),
              HasSubstr("the same digest as stored"));
  EXPECT_TRUE(fs::exists(File("replay/trajectory.csv")));
  EXPECT_THAT(Run({"replay", File("a.db"), "1", "--out", File("replay"), "--no-video"}, 5),
              HasSubstr("trial 1 ended timeout with digest feedfeedfeedfeed, now timeout with"));
  RunBatch("b.db", {"--seeds", "1"});
  EXPECT_THAT(Run({"merge", File("m.db"), File("a.db"), File("b.db")}, 5), HasSubstr("trial 1"));
  RunBatch("c.db", {"--seeds", "1", "--seed", "5"});
  EXPECT_THAT(Run({"merge", File("n.db"), File("b.db"), File("c.db")}, 5),
              HasSubstr("master_seed: 1 in " + File("b.db") + ", 5 in " + File("c.db")));
}

TEST_F(Batch, AHungTrialIsAnOutcome) {
  std::ofstream(plan_, std::ios::app) << "trial_time_limit_s: 0.5\n";
  RunBatch("a.db", {"--seeds", "1", "--set", "trial.duration_s=1000"});
  EXPECT_THAT(Rows("a.db"), HasSubstr(",hung,hung,no end after 0.5 s, the time limit,0,0,,"));
}

TEST_F(Batch, AFullDiskIsAClearErrorAndTheRestIsSafe) {
  RunBatch("whole.db");
  // The file may not grow beyond what the first few trials need.
  const std::string command = "ulimit -f 52; exec '" + ProgramPath() + "' batch '" + plan_ +
                              "' --out '" + File("full.db") + "' --quiet --workers 1 2> '" +
                              File("said") + "'";
  const int status = std::system(("bash -c \"" + command + "\"").c_str());
  EXPECT_EQ(WEXITSTATUS(status), 2);
  std::ifstream said(File("said"));
  EXPECT_THAT(std::string(std::istreambuf_iterator<char>(said), {}),
              HasSubstr("the trials stored so far are safe"));
  RunBatch("full.db");
  EXPECT_EQ(Rows("full.db"), Rows("whole.db"));
}

}  // namespace
}  // namespace turbidock::testing
