// Other people's files and careless command lines, through the real program: exit code 2, one line
// that says what is wrong, and nothing lost.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <thread>

#include "tests/support/own_folder.h"
#include "tests/support/program.h"

namespace turbidock::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class BadInput : public OwnFolder {
 protected:
  void SetUp() override {
    for (const char* side : {"left", "right"})
      fs::copy_file(
          std::string(TURBIDOCK_TEST_DATA) + "/pathtraced/active_015ml_0500mm_" + side + ".png",
          File(std::string(side) + ".png"));
  }

  // A batch's file with two trials.
  std::string Batch(const std::string& name) const {
    const std::string plan =
        File("two.yaml",
             "schema_version: 1\nscenario: pool_active\nseeds: 2\n"
             "set: {estimator.pose_source: true_pose, trial.duration_s: 0.1}\n");
    EXPECT_EQ(RunProgram({"batch", plan, "--out", File(name), "--quiet"}).exit_code, 0);
    return File(name);
  }
  // Every file of the folder with its bytes.
  std::map<std::string, std::string> All() const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
      if (std::error_code loop; entry.is_regular_file(loop))
        all[entry.path().string()] = TextOf(entry.path().string());
    return all;
  }

  // Exit code 2, nothing on stdout, one line at the end of stderr that has these words; every file
  // as it was, and none that was not.
  void Refused(const std::vector<std::string>& arguments, const std::string& words) const {
    const auto before = All();
    const ProgramEnd end = RunProgram(arguments);
    EXPECT_EQ(end.exit_code, 2) << end.err;
    EXPECT_EQ(end.out, "");
    const size_t last = end.err.rfind("turbidock: ");
    ASSERT_NE(last, std::string::npos) << end.err;
    const std::string message = end.err.substr(last);
    EXPECT_THAT(message, HasSubstr(words));
    EXPECT_EQ(message.find('\n'), message.size() - 1) << message;
    EXPECT_TRUE(All() == before) << message;
  }
};

TEST_F(BadInput, ARefusedCommandDestroysNothing) {
  File("o/video.mp4", "precious");
  Refused({"run", "sea_night_active", "--set", "marker.balls[0].radius_m=0.05", "--out", File("o"),
           "--video"},
          "marker.balls");
}

TEST_F(BadInput, AnOutputIsNoInput) {
  const std::string left = File("left.png"), right = File("right.png");
  const std::string read = " is read by this command";
  Refused({"estimate", "--left", left, "--right", right, "--overlay", left}, left + ":" + read);
  Refused({"estimate", "--left", File("*.png"), "--right", right, "--overlay", left},
          left + ":" + read);
  const std::string table = File("t.csv", "milk_ml_m3,distance_mm,fitness_mean\n0,400,0.9\n");
  Refused({"calibrate", "--active", table, "--out", table}, table + ":" + read);
  const std::string scenario =
      File("resolved.yaml",
           "schema_version: 1\ntrial: {seed: 3, duration_s: 0.2, scene: pool_active.xml}\n");
  Refused({"run", scenario, "--out", folder_.string()}, scenario + ":" + read);
  const std::string plan = File("plan.yaml", "schema_version: 1\nscenario: pool_active\n");
  Refused({"batch", plan, "--out", plan}, plan + ":" + read);
  // a result is not overwritten by the page that shows it
  const std::string page = File("x.html");
  Refused({"batch", "smoke", "--out", page}, page + ": is written by it twice");
  const std::string db = Batch("x.db");
  Refused({"report", db, "--out", db}, db + ":" + read);
  File("trial/result.json", "{}");
  Refused({"report", File("trial"), "--out", File("trial/result.json")},
          File("trial/result.json") + ":" + read);
  Refused({"view", scenario, "--out", folder_.string()}, scenario + ":" + read);
}

// What nobody asked for by its name replaces only its own kind.
TEST_F(BadInput, WhatIsNobodysOutputIsNotReplaced) {
  const std::string plan = File("plan.yaml",
                                "schema_version: 1\nscenario: s.html\nseeds: 1\n"
                                "set: {estimator.pose_source: true_pose, trial.duration_s: 0.1}\n");
  const std::string scenario = File(
      "s.html", "schema_version: 1\ntrial: {seed: 1, duration_s: 1, scene: pool_active.xml}\n");
  Refused({"batch", plan, "--out", File("s.db")}, scenario + ": is read by this command");
  const std::string page = File("x.html", "<!doctype html>\n<p>mine</p>\n");
  Refused({"batch", plan, "--out", File("x.db")}, page + ": is no page of this program and is not");
  const std::string report = File("o/report.html", "<!doctype html>\n<p>mine</p>\n");
  Refused({"run", "pool_active", "--report", "--out", File("o")},
          report + ": is no page of this program");
  const std::string gains = File("o/gains.yaml", "control: {use: pid}\n");
  Refused({"tune", "tryout", "--out", File("o"), "--figure", File("none/x.png")},  // never begins
          gains + ": is no gains file of tune and is not");
  // a page of a batch before is
  EXPECT_EQ(RunProgram({"batch", plan, "--out", File("y.db"), "--quiet"}).exit_code, 0);
  EXPECT_EQ(RunProgram({"batch", plan, "--out", File("y.db"), "--quiet"}).exit_code, 0);
}

TEST_F(BadInput, ResultsAreReplacedByNothingElse) {
  const std::string db = Batch("x.db"), other = Batch("y.db");
  Refused({"calibrate", "--out", other},
          other + ": is a result file and is not replaced by another kind");
  for (const std::string& kept : {other, File("plan.yaml", "seeds: 3\n")}) {
    Refused({"report", db, "--out", kept}, kept + ": is no page of this program and is not");
    Refused({"compare", db, db, "--out", kept}, kept + ": is no page of this program and is not");
  }
  for (const char* name : {"x.pdf", "html"}) {
    Refused({"report", db, "--out", File(name)}, "will be a page of this program: its name must");
    Refused({"compare", db, other, "--out", File(name)}, std::string(name) + ": will be a page");
  }
  fs::create_symlink(other, File("x.png"));
  Refused({"report", db, "--figure", File("x.png")}, "x.png: is a result file and is not replaced");
}

TEST_F(BadInput, AResultOfAnotherShapeIsNoFault) {
  const std::string none = "x.json: is no result";
  for (const char* text : {R"({"verdict": 1, "conditions": [], "description": 4})",
                           R"({"groups": [], "a": 1, "b": 2, "pairs": 3})"})
    Refused({"report", File("x.json", text), "--out", File("x.html")}, none);
  std::string deep = R"({"cells": )" + std::string(100'000, '[') + std::string(100'000, ']') + "}";
  Refused({"report", File("x.json", deep), "--out", File("x.html")},
          "nested deeper than 64 levels");
  const std::string trial = File("trial");
  ASSERT_EQ(RunProgram({"run", "pool_active", "--set", "estimator.pose_source=true_pose", "--set",
                        "trial.duration_s=0.1", "--out", trial})
                .exit_code,
            0);
  File("trial/result.json", "[]");
  Refused({"report", trial, "--out", File("x.html")}, "result.json: is no trial's result");
}

TEST_F(BadInput, AnOptionThatSaysNothingHereIsRefused) {
  const std::string db = Batch("x.db"), json = File("x.json", R"({"cells": []})");
  Refused({"report", json, "--by", "scenario", "--out", File("x.html")},
          "x.json: --by, --over and --figure are for a batch's file");
  Refused({"report", json, "--figure", File("x.png")}, "--figure are for a batch's file");
  Refused({"report", db, db, "--out", File("x.html")},
          "report shows one result; turbidock compare A B --out FILE.html shows two");
  Refused({"report", db, "--over", "seed", "--out", File("x.html")},
          "seed: trials cannot be grouped by this");
  Refused({"report", db, "--figure", File("x.png")}, "has nothing to draw");
  EXPECT_FALSE(fs::exists(File("x.png")));
  Refused({"list", "keys", "--show", "pool_active"}, "excludes");
  for (const auto& [text, words] :
       {std::pair{"family: aruco_7x7\ntags: [{id: 1}]\n",
                  "tags.yaml:1: family = 'aruco_7x7', must be"},
        {"family: aruco_4x4\ntags: [{id: 250}]\n",
         "is not in family aruco_4x4, which has 0 to 249"},
        {"family: aruco_4x4\n", "tags.yaml: tags: must name at least one tag"}})
    Refused({"list", "--tags", File("tags.yaml", text)}, words);
  Refused({"list", "scenario"},
          "'scenario' must be one of all, scenarios, plans, gates, studies, keys");
  Refused({"batch", "smoke", "--out", File("new.db"), "--sbatch=--time=1"},
          "--sbatch requires --slurm");
}

TEST_F(BadInput, AResultFileBringsItsFolderAndBadInputDoesNot) {
  Refused({"batch", "smok", "--out", File("none/x.db")}, "did you mean smoke?");
  EXPECT_FALSE(fs::exists(File("none")));
  EXPECT_TRUE(fs::exists(Batch("new/x.db")));
}

// It becomes a line of a script.
TEST_F(BadInput, AnOptionOfSbatchIsOneLine) {
  const std::string line = " must be one line that begins with -";
  Refused({"batch", "smoke", "--slurm", "2", "--out", File("x.db"), "--sbatch=--time=1\nrm -r x"},
          "'--time=1 rm -r x'" + line);
  Refused({"batch", "smoke", "--slurm", "2", "--out", File("x.db"), "--sbatch", "time=1"},
          "'time=1'" + line);
}

TEST_F(BadInput, TextThatIsNoneIsRefusedAtTheBeginning) {
  const std::string plan =
      File("plan.yaml", "schema_version: 1\ndescription: caf\xe9\nscenario: pool_active\n");
  Refused({"batch", plan, "--out", File("x.db")}, plan + ":2: is no UTF-8 text (byte 0xe9)");
  Refused({"run", "pool_active", "--set", "description=caf\xe9"},
          "--set description: is no UTF-8 text (byte 0xe9)");
  Refused({"run", "pool_active", "--set", "a\x1b[31m=1"}, "--set a\\x1b[31m");
}

TEST_F(BadInput, WhatIsPrintedOfACommandLineIsOneLineOfText) {
  const std::string red = "\x1b[31m\nx", plain = "\\x1b[31m x", out = File("x");
  Refused({"batch", "smoke", "--out", out, "--seeds", red}, "--seeds: '" + plain + "' must be");
  Refused({"run", "pool_active", "--expect", red}, "'" + plain + "' must be one of success,");
  Refused({"run", "pool_active", red}, "not expected here: " + plain);
  Refused({red}, "not expected here: " + plain);
  Refused({"run"}, "scenario is required; see --help");
  Refused({"run", "pool_active", "--set", std::string(100'000, 'x') + "=1"},
          std::string(100, 'x') + "..." + std::string(99, 'x') + ":");
  const ProgramEnd end = RunProgram({"report", Batch("x.db"), "--out", File("\x1b[31m\n.html")});
  EXPECT_EQ(end.exit_code, 0);
  EXPECT_EQ(end.err.find(File("\\x1b[31m .html") + ": "), 0u) << end.err;
  EXPECT_EQ(end.err.find('\n'), end.err.size() - 1) << end.err;
}

// What is not --set is no YAML.
TEST_F(BadInput, AnOptionSaysWhatItSays) {
  Refused({"run", "pool_active", "--seed", "7 # x"}, "--seed: '7 # x' must be a whole number");
  Refused({"batch", "smoke", "--seed", "*a"}, "--seed");
}

TEST_F(BadInput, AliasesEndInWords) {
  const std::string self =
      File("self.yaml",
           "schema_version: 1\nscenario: pool_active\ngrid: &a\n  water.milk_ml_m3: [*a]\n");
  Refused({"batch", self, "--out", File("x.db")}, self + ":4: grid.water.milk_ml_m3[0]: an alias");
}

TEST_F(BadInput, WhatIsNoFileIsNotRead) {
  mkfifo(File("pipe.png").c_str(), 0666);
  mkfifo(File("pipe.mp4").c_str(), 0666);
  fs::create_symlink("loop", File("loop"));
  const std::string right = File("right.png");
  Refused({"run", "/dev/zero"}, "/dev/zero: is no regular file");
  Refused({"run", "pool_active", "--gains", "/dev/zero"}, "/dev/zero: cannot be read");
  Refused({"run", folder_.string()}, folder_.string() + ": is a directory");
  Refused({"status", folder_.string()}, folder_.string() + ": is a directory");
  Refused({"estimate", "--left", File("pipe.png"), "--right", right}, "is no regular file");
  Refused({"estimate", "--left", File("pipe.mp4"), "--right", right}, "is no regular file");
  Refused({"report", File("pipe.png"), "--out", File("x.html")}, "is no regular file");
  Refused({"view", File("pipe.png")}, "is no regular file");
  for (const std::string& table : {std::string("/dev/zero"), File("pipe.png")}) {
    Refused({"recognize", "recognition_active", "--active", table}, table + ": cannot be read");
    Refused({"calibrate", "--passive", table}, table + ": cannot be read");
  }
  Refused({"run", File("loop")}, "Too many levels of symbolic links");
  Refused({"estimate", "--left", File("loop"), "--right", right}, "Too many levels");
  Refused({"run", "pool_active", "--out", File("loop")}, "Too many levels");
  Refused({"batch", "smoke", "--out", File(std::string(300, 'n'))}, "File name too long");
  Refused({"run", std::string(300, 'n')}, "File name too long");
  Refused({"estimate", "--left", File("left_%99999999999d.png"), "--right", right},
          "no such images");
}

TEST_F(BadInput, ANumberThatLeavesNoLawNamesItsKeys) {
  Refused({"run", "pool_active", "--set", "control.use=lqg", "--set",
           "control.known_vehicle.rigid_body.mass_kg=1e300", "--set", "trial.duration_s=0.1"},
          "control.lqg.surge: there is no controller for these values");
}

TEST_F(BadInput, AFullStandardOutputIsNoSuccess) {
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"--help"}, {"run", "--help"}, {"--version"}, {"list"}, {"list", "keys"}}) {
    std::string line = ProgramPath();
    for (const std::string& word : arguments) line += " " + word;
    const int status = std::system((line + " >/dev/full 2>/dev/null").c_str());
    EXPECT_EQ(WEXITSTATUS(status), 2) << line;
  }
}

// Starts the program, sends the signal once it is at work, and returns how it ended (of waitpid).
int Stop(const std::vector<std::string>& arguments, int signal) {
  const pid_t pid = StartProgram(arguments);
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  const auto begin = std::chrono::steady_clock::now();
  kill(pid, signal);
  const auto since_s = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  int status = 0;
  while (waitpid(pid, &status, WNOHANG) == 0) {
    if (since_s() > 60) kill(pid, SIGKILL);  // which is not the signal that was sent
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return status;
}

// What has nothing to save ends at once.
TEST_F(BadInput, TheFirstSignalStopsWhateverRuns) {
  const std::string plan = File("plan.yaml",
                                "schema_version: 1\nscenario: pool_active\nseeds: 100000\n"
                                "random: {water.milk_ml_m3: {uniform: [0, 20]}}\n");
  const std::vector<std::vector<std::string>> commands = {{"batch", plan, "--out", File("x.db")},
                                                          {"recognize", "recognition_active"},
                                                          {"step-response", "--out", File("new")}};
  for (const auto& command : commands)
    for (const int signal : {SIGINT, SIGTERM}) {
      const int status = Stop(command, signal);
      EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal)
          << command[0] << " " << command[1] << ": " << status;
    }
  EXPECT_FALSE(fs::exists(File("new")));  // no folder with nothing in it
}

TEST_F(BadInput, AStoppedStudySaysWhatIsKeptAndHowToGoOn) {
  const std::string gate = File("gate.yaml",
                                "schema_version: 1\nscenario: pool_active\nseeds: 100\n"
                                "gate: {baseline: base.yaml, margins: {success_rate: 0.5}}\n");
  const std::pair<std::vector<std::string>, std::string> studies[] = {
      {{"gate", gate, "--update"}, File("base.yaml.trials.db")},
      {{"tune", "tryout", "--out", File("tuned")}, File("tuned/evaluations.sqlite")},
      {{"recognize", "recognition_active", "--out", File("r.sqlite")}, File("r.sqlite")}};
  for (const auto& [command, file] : studies) {
    const pid_t pid = StartProgram(command, File("err"));
    int status = 0;
    while (!fs::exists(file)) {
      ASSERT_EQ(waitpid(pid, &status, WNOHANG), 0) << command[0] << ": " << TextOf(File("err"));
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    kill(pid, SIGINT);
    ASSERT_EQ(waitpid(pid, &status, 0), pid);
    EXPECT_EQ(WEXITSTATUS(status), 130) << command[0];
    EXPECT_THAT(TextOf(File("err")), HasSubstr("stopped: the trials so far are in " + file +
                                               "; the same command goes on\n"));
    fs::remove(File("err"));
  }
}

}  // namespace
}  // namespace turbidock::testing
