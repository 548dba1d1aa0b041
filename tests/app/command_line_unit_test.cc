// The program as a user meets it: exit codes, where output goes, and what is said of bad input.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "experiments/config/yaml_fields.h"
#include "experiments/trial/scenario.h"
#include "tests/support/own_folder.h"
#include "tests/support/program.h"

namespace turbidock::testing {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

class CommandLine : public OwnFolder {
 protected:
  // A scenario that runs, with `more` after its required keys; line 3 is the first of `more`.
  std::string ScenarioFile(const std::string& more) {
    return File(
        "scenario.yaml",
        "schema_version: 1\ntrial: {seed: 3, duration_s: 0.2, scene: pool_active.xml}\n" + more);
  }
};

// Bad input: exit 2, nothing on stdout, one message that says where and what.
void ExpectBadInput(const std::vector<std::string>& arguments,
                    const std::vector<std::string>& said) {
  const ProgramEnd end = RunProgram(arguments);
  EXPECT_EQ(end.exit_code, 2) << end.err;
  EXPECT_EQ(end.out, "");
  for (const std::string& words : said) EXPECT_THAT(end.err, HasSubstr(words));
}

TEST_F(CommandLine, RunPrintsOneJsonDocumentWithTheDocumentedKeys) {
  const ProgramEnd end = RunProgram({"run", ScenarioFile(""), "--seed", "7", "--json"});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  const auto json = nlohmann::json::parse(end.out);
  for (const char* key :
       {"outcome", "docked", "inserted", "time_s", "final_error_true", "final_error_estimated",
        "fitness_mean", "returns_to_servoing", "stage_time_s", "seed", "digest", "real_time_factor",
        "jammed", "insertion_time_s"})
    EXPECT_TRUE(json.contains(key)) << key;
  for (const char* key : {"x_m", "y_m", "z_m", "yaw_rad"})
    EXPECT_TRUE(json["final_error_true"].contains(key)) << key;
  for (const char* key :
       {"thruster_work_joule", "drag_loss_joule", "water_work_joule", "contact_work_joule",
        "kinetic_change_joule", "potential_change_joule", "residual_joule"})
    EXPECT_TRUE(json["energy"].contains(key)) << key;
  EXPECT_EQ(json["jammed"], false);
  EXPECT_EQ(json["seed"], 7);
  EXPECT_EQ(json["outcome"], "timeout");
}

TEST_F(CommandLine, RunLeavesItsFiles) {
  const std::string out = (folder_ / "deep/er").string();
  const ProgramEnd end = RunProgram({"run", ScenarioFile(""), "--out", out, "--video"});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  EXPECT_THAT(end.out, ::testing::StartsWith("timeout: "));
  for (const char* name :
       {"result.json", "resolved.yaml", "trajectory.csv", "figure.png", "video.mp4"})
    EXPECT_GT(std::filesystem::file_size(std::filesystem::path(out) / name), 100u) << name;
}

TEST_F(CommandLine, LinesOfBothOutputsInOneFileStandInTheirOrder) {
  const std::string both = (folder_ / "both").string(), out = (folder_ / "out").string();
  const std::string run = " run " + ScenarioFile("") + " --json --out " + out;
  ASSERT_EQ(std::system((ProgramPath() + run + " > " + both + " 2>&1").c_str()), 0);
  std::ifstream file(both);
  const std::string said{std::istreambuf_iterator<char>(file), {}};
  EXPECT_LT(said.find("timeout"), said.find("\"outcome\"")) << said;
  EXPECT_LT(said.find("\"outcome\""), said.find("all of it in")) << said;
}

// As `turbidock ... | head -1` does.
TEST_F(CommandLine, AReaderThatLeavesTakesNoFileAlong) {
  const std::string out = (folder_ / "read").string(), code = (folder_ / "code").string();
  const std::string run = fmt::format(
      "({} run pool_active --set estimator.pose_source=true_pose --set trial.duration_s=0.5 --json "
      "--out {}; echo $? >{}) 2>/dev/null | :",
      testing::ProgramPath(), out, code);
  ASSERT_EQ(std::system(run.c_str()), 0);
  EXPECT_EQ(TextOf(code), "141\n");
  EXPECT_TRUE(std::filesystem::exists(out + "/result.json"));
  EXPECT_TRUE(std::filesystem::exists(out + "/figure.png"));
}

TEST_F(CommandLine, AFolderHoldsTheFilesOfOneTrial) {
  const std::filesystem::path out = folder_ / "out";
  const std::vector<std::string> run = {"run", ScenarioFile(""), "--out", out.string()};
  std::vector<std::string> with_all = run;
  with_all.insert(with_all.end(), {"--video", "--report"});
  ASSERT_EQ(RunProgram(with_all).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(out / "video.mp4"));
  for (const char* name : {"999999_left.jpg", "mine_left.jpg"})
    std::ofstream(out / "cameras" / name) << name;
  ASSERT_EQ(RunProgram(run).exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(out / "cameras/999999_left.jpg")) << "of another trial";
  EXPECT_TRUE(std::filesystem::exists(out / "cameras/mine_left.jpg"));
  for (const char* name : {"video.mp4", "report.html"})
    EXPECT_FALSE(std::filesystem::exists(out / name)) << name;
  EXPECT_TRUE(std::filesystem::exists(out / "figure.png"));
  // what is nobody's page stays
  std::ofstream(out / "report.html") << "mine";
  ExpectBadInput(run, {"report.html", "is no page of this program"});
}

TEST_F(CommandLine, ExpectDecidesTheExitCode) {
  EXPECT_EQ(RunProgram({"run", ScenarioFile(""), "--expect", "timeout"}).exit_code, 0);
  EXPECT_EQ(RunProgram({"run", ScenarioFile(""), "--expect", "success"}).exit_code, 1);
}

TEST_F(CommandLine, VersionNamesWhatItRunsOn) {
  const ProgramEnd end = RunProgram({"--version"});
  EXPECT_EQ(end.exit_code, 0);
  for (const char* name : {"turbidock", "git", "compiler", "MuJoCo", "Mesa", "OpenCV", "\ndata /"})
    EXPECT_THAT(end.out, HasSubstr(name));
}

TEST_F(CommandLine, ListHasALineForEveryBundledFile) {
  const std::pair<const char*, const char*> kinds[] = {{"scenarios", "sea_night_active"},
                                                       {"plans", "turbidity_sweep"},
                                                       {"gates", "docking"},
                                                       {"studies", "tryout"}};
  std::string all;
  std::set<std::string> names;  // each of one file, for `--show`
  for (const auto& [kind, known] : kinds) {
    const ProgramEnd end = RunProgram({"list", kind});
    EXPECT_EQ(end.exit_code, 0) << end.err;
    EXPECT_THAT(end.out, HasSubstr(known));
    // Beside gates stand what they begin with and their baselines.
    int files = 0;
    for (const auto& file : std::filesystem::directory_iterator(
             std::filesystem::path(TURBIDOCK_TEST_DATA "/../../assets") / kind))
      if (std::string(kind) != "gates" ||
          TextOf(file.path().string()).find("\ngate:") != std::string::npos) {
        ++files;
        EXPECT_TRUE(names.insert(file.path().stem().string()).second) << file.path();
      }
    EXPECT_EQ(std::count(end.out.begin(), end.out.end(), '\n'), files);
    all += (all.empty() ? "" : "\n") + std::string(kind) + "\n" + end.out;
  }
  EXPECT_EQ(RunProgram({"list"}).out, all);
  EXPECT_THAT(RunProgram({"list", "--show", "pool_active"}).out, HasSubstr("milk_ml_m3: "));
  for (const auto& [kind, known] : kinds)
    if (std::string(kind) != "scenarios") {
      EXPECT_EQ(
          RunProgram({"list", "--show", known}).out,
          TextOf(fmt::format("{}/../../assets/{}/{}.yaml", TURBIDOCK_TEST_DATA, kind, known)));
    }
  EXPECT_THAT(RunProgram({"list", "result-keys"}).out, HasSubstr("| `outcome`"));
}

TEST_F(CommandLine, BadUsage) {
  EXPECT_EQ(RunProgram({}).exit_code, 2);
  EXPECT_EQ(RunProgram({"run"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"run", "pool_active", "--video"}).exit_code, 2);  // needs --out
  EXPECT_EQ(RunProgram({"run", "pool_active", "--expect", "luck"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"--help"}).exit_code, 0);
  EXPECT_EQ(RunProgram({"run", "--help"}).exit_code, 0);
}

TEST_F(CommandLine, WhatWasMeantIsSuggested) {
  ExpectBadInput({"rnu"}, {"did you mean run?"});
  ExpectBadInput({"runn", "pool_active"}, {"not expected here: runn", "did you mean run?"});
  ExpectBadInput({"run", "pool_active", "--sede", "3"}, {"did you mean --seed?"});
  ExpectBadInput({"run", "pool_active", "--set", "water.milk=3"}, {"did you mean milk_ml_m3?"});
  ExpectBadInput({"run", "turbidity_sweep"}, {"bundled plans", "turbidock batch turbidity_sweep"});
  ExpectBadInput({"batch", "pool_active", "--out", (folder_ / "x.db").string()},
                 {"bundled scenarios", "turbidock run pool_active"});
  ExpectBadInput({"run", File("plan.yaml", "schema_version: 1\nscenario: pool_active\n")},
                 {"plan.yaml: is a plan", "turbidock batch"});
}

// What the user typed is named, and no file or option that the program made of it.
TEST_F(CommandLine, WhatIsBlamedIsWhatWasTyped) {
  const std::string out = (folder_ / "x.db").string();
  ExpectBadInput({"batch", "turbidity_sweep", "--seeds", "0", "--out", out},
                 {"turbidock: --seeds: 0 must be a number from 1"});
  ExpectBadInput({"batch", "turbidity_sweep", "--seed", "-1", "--out", out}, {"--seed: "});
  const std::string plan = File("strata.yaml",
                                "schema_version: 1\nscenario: pool_active\nseeds: 4\nstrata:\n"
                                "  near: {start.distance_max_m: 1}\n"
                                "  far: {start.distance_max_m: 1.2}\n");
  ExpectBadInput({"batch", plan, "--seeds", "7", "--out", out}, {"turbidock: --seeds: 7 must be"});
  ExpectBadInput({"check-vehicle", "nothere"},
                 {"turbidock: nothere: no such file", "bluerov2_heavy.xml, vehicle.xml"});
  ExpectBadInput({"check-vehicle"}, {"bluerov2_heavy.xml, vehicle.xml"});
  ExpectBadInput({"run", "pool_active", "--seed", "-3"}, {"--seed: -3 must be at least 0"});
}

TEST_F(CommandLine, SeveralMistakesInAFileAreSaidAtOnce) {
  const ProgramEnd end =
      RunProgram({"run", ScenarioFile("water:\n  milk_ml_m4: 3\nsea:\n  state: wild\n")});
  EXPECT_EQ(end.exit_code, 2);
  EXPECT_THAT(end.err, HasSubstr("scenario.yaml:4: water.milk_ml_m4: unknown key"));
  EXPECT_THAT(end.err, HasSubstr("scenario.yaml:6: sea.state = 'wild', must be one of"));
  EXPECT_EQ(std::count(end.err.begin(), end.err.end(), '\n'), 2);
}

TEST_F(CommandLine, NumbersOfOptionsAreFiniteAndWithinTheirRange) {
  for (const std::string number : {"nan", "inf"})
    ExpectBadInput({"recognize", "recognition_active", "--seconds", number},
                   {"--seconds", number + " is not a finite number"});
  ExpectBadInput({"dataset", "smoke", "--workers", "0"},
                 {"--workers", "0 must be a number from 1 to 1024"});
}

TEST_F(CommandLine, HelpShowsValuesRangesAndDefaults) {
  const std::string help = RunProgram({"bench", "--help"}).out;
  // CLI11 writes a default one way or the other, by its version
  EXPECT_THAT(help, AnyOf(HasSubstr("--frames INT:2 to 1000000=600"),
                          HasSubstr("--frames INT:2 to 1000000 [600]")));
  EXPECT_THAT(help, HasSubstr("--set KEY=VALUE"));
  EXPECT_THAT(help, Not(HasSubstr("=0")));
}

TEST_F(CommandLine, EachHelpEndsWithTwoExamplesThatCouldBeRun) {
  const std::string all = RunProgram({"--help"}).out;
  std::istringstream lines(all.substr(all.find("Subcommands:")));
  std::string line;
  int commands = 0;
  for (std::getline(lines, line); std::getline(lines, line) && line.starts_with("  ");) {
    const std::string name = line.substr(2, line.find(' ', 2) - 2);
    if (name.empty()) continue;  // a description goes on
    ++commands;
    const std::string help = RunProgram({name, "--help"}).out;
    EXPECT_THAT(help, Not(HasSubstr("Excludes:"))) << name;
    EXPECT_THAT(help, Not(HasSubstr("--seed TEXT"))) << name;
    EXPECT_THAT(help, Not(HasSubstr("--seed UINT"))) << name;
    const size_t examples = help.find("Examples:\n");
    ASSERT_NE(examples, std::string::npos) << name;
    std::istringstream words(help.substr(examples));
    int count = 0;
    for (std::string word; words >> word;) {
      if (word == "turbidock") {
        ++count;
        words >> word;
        EXPECT_EQ(word, name);
      }
      if (word.starts_with("--")) {
        EXPECT_THAT(help.substr(0, examples), HasSubstr(word)) << name;
      }
    }
    EXPECT_EQ(count, 2) << name;
  }
  EXPECT_GE(commands, 15);
}

TEST_F(CommandLine, TheListOfKeysHasAKeyALineWhereItIsSearched) {
  std::istringstream lines(RunProgram({"list", "keys"}).out);
  const std::regex milk("water\\.milk_ml_m3 +0 +in \\[0, 2000\\] +milk in the water, .*");
  int keys = 0, found = 0;
  for (std::string line; std::getline(lines, line); ++keys) found += std::regex_match(line, milk);
  EXPECT_EQ(keys, std::ssize(trial::ScenarioKeys()));
  EXPECT_EQ(found, 1);
}

TEST_F(CommandLine, TheListOfKeysOnATerminalHasAHeadingGroupsAndFits100Columns) {
  // `script` gives it one
  std::string text =
      RunProgramAt("/usr/bin/script", {"-qec", ProgramPath() + " list keys", "/dev/null"}).out;
  std::erase(text, '\r');
  std::istringstream lines(text);
  std::string line, all;
  for (bool first = true; std::getline(lines, line); first = false) {
    if (first) {
      EXPECT_THAT(line, ::testing::StartsWith("KEY"));
    }
    EXPECT_LE(line.size(), 100u) << line;
    all += line + "\n";
  }
  EXPECT_THAT(all, HasSubstr("\n\nwater (group of keys)\n"));
  EXPECT_THAT(all, HasSubstr("\nwater.milk_ml_m3  "));
}

TEST_F(CommandLine, BadScenarioFiles) {
  ExpectBadInput({"run", "no_such_file.yaml"}, {"no_such_file.yaml", "no such file"});
  ExpectBadInput({"run", "sea_nigth_active"}, {"did you mean sea_night_active?"});
  ExpectBadInput({"run", File("empty.yaml", "")}, {"empty.yaml", "is empty"});
  ExpectBadInput({"run", File("list.yaml", "- 1\n- 2\n")}, {"list.yaml"});
  ExpectBadInput({"run", File("broken.yaml", "a: [1\nb: 2\n")}, {"broken.yaml:"});
  ExpectBadInput({"run", File("bare.yaml", "description: nothing else\n")},
                 {"bare.yaml", "schema_version", "required"});
  ExpectBadInput({"run", ScenarioFile("water:\n  milk_ml_m4: 3\n")},
                 {"scenario.yaml:4", "milk_ml_m4", "milk_ml_m3"});
  ExpectBadInput({"run", ScenarioFile("cameras:\n  rig:\n    baseline_m: 120 mm\n")},
                 {"scenario.yaml:5", "cameras.rig.baseline_m", "120 mm"});
  ExpectBadInput({"run", ScenarioFile("cameras:\n  rig:\n    baseline_m: wide\n")},
                 {"scenario.yaml:5", "cameras.rig.baseline_m", "must be a number"});
  ExpectBadInput({"run", ScenarioFile("water:\n  milk_ml_m3: .nan\n")},
                 {"scenario.yaml:4", "water.milk_ml_m3"});
  ExpectBadInput({"run", ScenarioFile("vehicle:\n  rigid_body:\n    mass_kg: -15\n")},
                 {"scenario.yaml:5", "vehicle.rigid_body.mass_kg", "must be > 0"});
  ExpectBadInput({"run", ScenarioFile("marker:\n  balls: []\n")},
                 {"scenario.yaml:4", "marker.balls", "ball"});
}

TEST_F(CommandLine, APlanAndAScenarioAreNotTakenForEachOther) {
  const std::string plans = TURBIDOCK_TEST_DATA "/../../assets/plans/";
  for (const char* plan : {"smoke.yaml", "robustness.yaml", "current_envelope.yaml"})
    ExpectBadInput({"run", plans + plan},
                   {plan, "is a plan, no scenario; turbidock batch runs it"});
  ExpectBadInput({"batch", ScenarioFile(""), "--out", File("a.db")},
                 {"scenario.yaml: is a scenario, no plan; turbidock run runs it"});
}

TEST_F(CommandLine, BadAssignments) {
  ExpectBadInput({"run", "pool_active", "--set", "water.milk_ml_m3=-1"},
                 {"--set", "water.milk_ml_m3", "-1"});
  ExpectBadInput({"run", "pool_active", "--set", "watre.milk_ml_m3=1"}, {"did you mean water"});
  ExpectBadInput({"run", "pool_active", "--set", "trial.duration_s"}, {"--set"});
  ExpectBadInput({"run", "pool_active", "--seed", "-3"}, {"seed"});
}

TEST_F(CommandLine, BadModels) {
  ExpectBadInput({"run", "pool_active", "--set", "trial.scene=no_such.xml"},
                 {"--set trial.scene = 'no_such.xml'", "neither a file nor"});
  const std::string broken = File("broken.xml", "<mujoco>\n  <worldbody>\n    <goem/>\n");
  ExpectBadInput({"run", "pool_active", "--set", "trial.scene=" + broken}, {"broken.xml"});
  const std::string wrong =
      File("wrong.xml", "<mujoco>\n  <worldbody>\n    <goem/>\n  </worldbody>\n</mujoco>\n");
  ExpectBadInput({"run", "pool_active", "--set", "trial.scene=" + wrong}, {"wrong.xml", "line 3"});
  const std::string bare = File("bare.xml", "<mujoco/>");
  ExpectBadInput({"run", "pool_active", "--set", "trial.scene=" + bare}, {"bare.xml", "vehicle"});
}

TEST_F(CommandLine, ARelativeModelIsFoundBesideItsScenarioAndResolvedYamlRunsAnywhere) {
  std::filesystem::create_directories(folder_ / "models");
  for (const auto& entry : std::filesystem::directory_iterator(
           std::filesystem::path(ProgramPath()).parent_path() / "../share/turbidock/models"))
    if (entry.path().extension() == ".xml")
      std::filesystem::copy_file(entry.path(), folder_ / "models" / entry.path().filename());
  const std::string scenario =
      File("own.yaml",
           "schema_version: 1\ntrial: {seed: 3, duration_s: 0.2, scene: models/pool_active.xml}\n");
  const std::string out = (folder_ / "elsewhere/out").string();
  const ProgramEnd first = RunProgram({"run", scenario, "--out", out, "--json"});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const ProgramEnd again = RunProgram({"run", out + "/resolved.yaml", "--json"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(nlohmann::json::parse(again.out)["digest"], nlohmann::json::parse(first.out)["digest"]);
}

TEST_F(CommandLine, SeedsAreNotBent) {
  for (const char* given : {"trial.seed=5", "trial={seed: 5}"})
    ExpectBadInput({"run", "pool_active", "--seed", "3", "--set", given}, {"give one of them"});
  ExpectBadInput({"run", "pool_active", "--seed", "99999999999999999999"}, {"seed"});
  ExpectBadInput({"run", "pool_active", "--seed", "1.5"}, {"seed"});
}

TEST_F(CommandLine, TooLongATrialIsRefused) {
  ExpectBadInput({"run", "pool_active", "--set", "trial.duration_s=1e18"}, {"duration_s"});
}

TEST_F(CommandLine, ADelayLongerThanTheTrialStillGivesAResult) {
  const ProgramEnd end = RunProgram(
      {"run", ScenarioFile("cameras: {delay_frames: 30}\nsea:\n  state: calm\n"), "--json"});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  const auto json = nlohmann::json::parse(end.out);
  EXPECT_EQ(json["time_s"], 0.2);
  EXPECT_NE(json["final_error_true"]["x_m"], 0.0);
}

// A folder that holds some of the programs on PATH, to hide the others.
TEST_F(CommandLine, WhatTheMachineLacksIsNamedBeforeTheTrial) {
  const std::vector<std::string> empty_path = {"PATH=" + folder_.string()};
  const std::string out = (folder_ / "out").string();
  const ProgramEnd no_gnuplot = RunProgram({"run", ScenarioFile(""), "--out", out}, empty_path);
  EXPECT_EQ(no_gnuplot.exit_code, 4);
  EXPECT_THAT(no_gnuplot.err, HasSubstr("gnuplot-nox"));
  std::filesystem::create_symlink("/usr/bin/gnuplot", folder_ / "gnuplot");
  const ProgramEnd no_ffmpeg =
      RunProgram({"run", ScenarioFile(""), "--out", out, "--video"}, empty_path);
  EXPECT_EQ(no_ffmpeg.exit_code, 4);
  EXPECT_THAT(no_ffmpeg.err, HasSubstr("ffmpeg"));
  // A library of that name that is none hides the real one. EGL would stand in for OSMesa.
  for (const char* library : {"libOSMesa.so.8", "libOSMesa.so", "libEGL.so.1", "libEGL.so"})
    File(library, "no library");
  const ProgramEnd no_mesa =
      RunProgram({"run", ScenarioFile("")}, {"LD_LIBRARY_PATH=" + folder_.string()});
  EXPECT_EQ(no_mesa.exit_code, 4);
  EXPECT_THAT(no_mesa.err, ::testing::AllOf(HasSubstr("libosmesa6"), HasSubstr("libegl1")));
}

TEST_F(CommandLine, AnOutputThatCannotBeMadeIsSaidBeforeTheTrial) {
  const std::string file = File("file", "not a folder");
  ExpectBadInput({"run", ScenarioFile(""), "--out", file + "/out"}, {file});
}

}  // namespace
}  // namespace turbidock::testing
