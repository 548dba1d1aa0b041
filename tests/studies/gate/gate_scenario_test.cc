// The worked example of the gate's documentation, end to end on short trials: a change that halves
// a gain is caught, one that changes a comment is not. And how the program ends on what it cannot
// judge.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/own_folder.h"
#include "tests/support/program.h"

namespace turbidock::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class GateProgram : public OwnFolder {
 protected:
  void SetUp() override {
    // Docks in 2.6 to 2.9 s from these seeds: small images, a start right in front of the dock, a
    // fast approach. With half the shipped gain in surge it takes 4.1 s.
    File("short.yaml",
         "schema_version: 1\n"
         "trial: {scene: pool_active.xml, seed: 1, duration_s: 3.5, after_docked_s: 0}\n"
         "control: {use: pid}\nwater: {background: pure, milk_ml_m3: 10}\n"
         "lights: {lamps: {enabled: false}, marker: {enabled: true}}\n"
         "cameras: {rig: {width_px: 160, height_px: 120}}\n"
         "start: {distance_min_m: 0.45, distance_max_m: 0.5, lateral_m: 0.02, vertical_m: 0.02,\n"
         "        heading_rad: 0.02}\n"
         "procedure: {found_hold_s: 0.1, servo_x_m: 0.45, docking_rate_mps: 0.1}\n");
    gate_ = File("gate.yaml",
                 "schema_version: 1\ndescription: short trials\nscenario: short.yaml\nmaster_seed: "
                 "2\nseeds: 9\n"
                 "cases: {short: {}}\ngate: {baseline: gate.baseline.yaml, alpha: 0.1, beta: 0.1,\n"
                 "       margins: {success_rate: 0.4}}\n");
  }

  // A build of the program whose assets/gains.yaml went through a change.
  std::string ChangedBuild(const std::string& name,
                           const std::function<std::string(std::string)>& change) const {
    const fs::path from = fs::path(ProgramPath()).parent_path().parent_path(), to = folder_ / name;
    fs::create_directories(to / "bin");
    fs::copy_file(ProgramPath(), to / "bin/turbidock");
    fs::create_directories(to / "share/turbidock");
    for (const char* data : {"models", "assets"})  // links to folders
      fs::copy(fs::canonical(from / "share/turbidock" / data), to / "share/turbidock" / data,
               fs::copy_options::recursive);
    const fs::path gains = to / "share/turbidock/assets/gains.yaml";
    const std::string before = TextOf(gains), after = change(before);
    EXPECT_NE(after, before);
    std::ofstream(gains) << after;
    return (to / "bin/turbidock").string();
  }

  std::string gate_;
};

TEST_F(GateProgram, AHalvedGainIsCaughtAndAChangedCommentIsNot) {
  const ProgramEnd update = RunProgram({"gate", gate_, "--update", "--workers", "2"});
  ASSERT_EQ(update.exit_code, 0) << update.err;
  EXPECT_THAT(update.out, HasSubstr("short: 9 of 9 succeed"));

  const std::string comment = ChangedBuild(
      "comment", [](const std::string& text) { return "# gains, as they were\n" + text; });
  const std::string out = (folder_ / "comment_out").string();
  const ProgramEnd pass =
      RunProgramAt(comment, {"gate", gate_, "--workers", "2", "--out", out, "--json"});
  EXPECT_EQ(pass.exit_code, 0) << pass.err;
  const auto passed = nlohmann::json::parse(pass.out);
  EXPECT_EQ(passed["verdict"], "pass");
  EXPECT_LT(passed["conditions"][0]["trials"], 9);

  const std::string halved = ChangedBuild("halved", [](std::string text) {
    const std::string key = "surge: {kp_per_s2: ";
    const size_t begin = text.find(key) + key.size(), size = text.find(',', begin) - begin;
    return text.replace(begin, size, std::to_string(std::stod(text.substr(begin, size)) / 2));
  });
  const std::string failed_out = (folder_ / "halved_out").string();
  const ProgramEnd fail = RunProgramAt(
      halved, {"gate", gate_, "--workers", "2", "--out", failed_out, "--bundles", "1"});
  EXPECT_EQ(fail.exit_code, 1) << fail.err;
  EXPECT_THAT(TextOf(failed_out + "/summary.md"), HasSubstr("# fail: short trials"));
  EXPECT_THAT(TextOf(failed_out + "/junit.xml"), HasSubstr("<failure type=\"worse\""));
  const auto summary = nlohmann::json::parse(TextOf(failed_out + "/summary.json"));
  const auto flips = summary["conditions"][0]["flips"];
  ASSERT_FALSE(flips.empty());

  // the bundle of the first of them
  const fs::path bundle = fs::path(failed_out) / "failures" / flips[0]["link"].get<std::string>();
  for (const char* name : {"resolved.yaml", "result.json", "figure.png", "video.mp4"})
    EXPECT_GT(fs::file_size(bundle / name), 100u) << name;
  EXPECT_EQ(std::distance(fs::directory_iterator(bundle.parent_path()), {}), 1);
}

// Without cameras there is no video, but all else that shows why.
TEST_F(GateProgram, FailuresWithoutCamerasAreRunAgainWithoutVideo) {
  const std::string gate =
      File("blind.yaml",
           "schema_version: 1\ndescription: without cameras\nscenario: short.yaml\nseeds: 9\n"
           "cases: {blind: {estimator.pose_source: true_pose}}\n"
           "gate: {baseline: blind.baseline.yaml, alpha: 0.1, beta: 0.1,\n"
           "       margins: {success_rate: 0.4}}\n");
  const ProgramEnd update = RunProgram({"gate", gate, "--update", "--workers", "2"});
  ASSERT_EQ(update.exit_code, 0) << update.err;
  const std::string out = (folder_ / "blind_out").string();
  const ProgramEnd fail = RunProgram({"gate", gate, "--workers", "2", "--out", out, "--bundles",
                                      "1", "--set", "trial.duration_s=1.2"});
  EXPECT_EQ(fail.exit_code, 1) << fail.err;
  const fs::directory_iterator bundles(fs::path(out) / "failures");
  ASSERT_NE(bundles, fs::directory_iterator());
  const fs::path bundle = bundles->path();
  EXPECT_GT(fs::file_size(bundle / "figure.png"), 100u);
  EXPECT_FALSE(fs::exists(bundle / "video.mp4"));

  // A later run that gives no verdict leaves none of an earlier one; what is not its own stays.
  std::ofstream(fs::path(out) / "failures" / "notes.txt") << "what I saw";
  const ProgramEnd hung = RunProgram(
      {"gate", File("hung.yaml", "trial_time_limit_s: 0.1\n" + TextOf(gate)), "--workers", "2",
       "--out", out, "--anew", "--set", "trial.clock.ticks_per_frame=1000"});
  EXPECT_EQ(hung.exit_code, 4) << hung.err;
  for (const char* name : {"report.html", "summary.json", "summary.md", "junit.xml"})
    EXPECT_FALSE(fs::exists(fs::path(out) / name)) << name;
  EXPECT_FALSE(fs::exists(bundle));
  EXPECT_TRUE(fs::exists(fs::path(out) / "failures" / "notes.txt"));
}

// What would have no effect is refused, and nothing runs.
TEST_F(GateProgram, OptionsThatDoNotGoTogetherAreRefused) {
  const std::vector<std::vector<std::string>> refused = {{gate_, "--update", "--gains", "g.yaml"},
                                                         {gate_, "--update", "--bundles", "1"},
                                                         {gate_, "--update", "--out", "go"}};
  for (std::vector<std::string> arguments : refused) {
    arguments.insert(arguments.begin(), "gate");
    const ProgramEnd end = RunProgram(arguments);
    EXPECT_EQ(end.exit_code, 2) << end.err;
    EXPECT_EQ(end.out, "");
    EXPECT_THAT(end.err, HasSubstr(" excludes "));
  }
  const ProgramEnd other = RunProgram({"gate", gate_, "--update", "--set", "trial.duration_s=1"});
  EXPECT_EQ(other.exit_code, 2) << other.err;
  EXPECT_THAT(other.err,
              HasSubstr("--set trial.duration_s=1: with --update it must be one of control.use, "));
  EXPECT_FALSE(fs::exists(folder_ / "gate.baseline.yaml"));
}

// All that is written is looked at before any trial.
TEST_F(GateProgram, NothingIsInTheWayOfWhatItWrites) {
  const std::string notes = File("notes.txt", "what I noted\n");
  const ProgramEnd update = RunProgram({"gate", gate_, "--update", "--baseline", notes});
  EXPECT_EQ(update.exit_code, 2);
  EXPECT_EQ(update.err, "turbidock: " + notes +
                            ": is no baseline of a gate and is not replaced by one; name another "
                            "file, or move this one away\n");
  EXPECT_EQ(TextOf(notes), "what I noted\n");

  ASSERT_EQ(RunProgram({"gate", gate_, "--update", "--workers", "2"}).exit_code, 0);
  const fs::path out = folder_ / "out";
  fs::create_directories(out / "report.html");
  const ProgramEnd page = RunProgram({"gate", gate_, "--out", out.string()});
  EXPECT_EQ(page.exit_code, 2);
  EXPECT_THAT(page.err, HasSubstr("report.html: cannot be written: it is a directory"));
  fs::remove_all(out);
  fs::create_directories(out);
  File("out/failures", "no folder");
  const ProgramEnd bundles = RunProgram({"gate", gate_, "--out", out.string()});
  EXPECT_EQ(bundles.exit_code, 2);
  EXPECT_THAT(bundles.err, HasSubstr("failures: cannot be made"));
  EXPECT_FALSE(fs::exists(out / "summary.json"));
}

TEST_F(GateProgram, WhatCannotBeJudgedNeverPasses) {
  const auto expect = [&](int code, const std::vector<std::string>& arguments,
                          const std::string& said) {
    const ProgramEnd end = RunProgram(arguments);
    EXPECT_EQ(end.exit_code, code) << end.err;
    EXPECT_EQ(end.out, "");
    EXPECT_THAT(end.err, HasSubstr(said));
  };
  expect(2, {"gate"}, "gate is required");
  expect(2, {"gate", "none.yaml"}, "none.yaml");
  expect(2, {"gate", gate_}, "there is no baseline; the gate makes it with --update");

  // a baseline of two trials, so that the rest is quick
  const std::string small =
      File("small.yaml",
           "schema_version: 1\nscenario: short.yaml\nmaster_seed: 2\nseeds: 2\n"
           "cases: {short: {}}\ngate: {baseline: small.baseline.yaml}\n");
  ASSERT_EQ(RunProgram({"gate", small, "--update"}).exit_code, 0);
  const ProgramEnd unsure = RunProgram({"gate", small});
  EXPECT_EQ(unsure.exit_code, 3) << unsure.err;
  EXPECT_THAT(unsure.out, ::testing::StartsWith("inconclusive: docking gate\n"));
  expect(2, {"gate", small, "--set", "watr.milk_ml_m3=1"}, "water");
  expect(2, {"gate", small, "--set", "trial.scene=none.xml"}, "none.xml");
  // libraries of these names that are none hide the real ones
  for (const char* name : {"libOSMesa.so.8", "libOSMesa.so", "libEGL.so.1", "libEGL.so"})
    File(name, "no library");
  const ProgramEnd no_mesa = RunProgram({"gate", small}, {"LD_LIBRARY_PATH=" + folder_.string()});
  EXPECT_EQ(no_mesa.exit_code, 4) << no_mesa.err;

  std::string text = TextOf(folder_ / "small.baseline.yaml");
  text.replace(text.find("successes: 2"), 12, "successes: 1");
  File("small.baseline.yaml", text);
  expect(2, {"gate", small}, "was edited");
}

}  // namespace
}  // namespace turbidock::testing
