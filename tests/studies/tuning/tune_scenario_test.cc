// The program `tune`, where it must not begin.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/program.h"

namespace turbidock::testing {
namespace {

namespace fs = std::filesystem;

// All that is written is looked at before any trial.
TEST(TuneProgram, NothingIsInTheWayOfWhatItWrites) {
  for (const char* name : {"report.html", "report.md", "gains.yaml"}) {
    const fs::path out = fs::temp_directory_path() / ("turbidock_tune_" + std::to_string(getpid()));
    fs::create_directories(out / name);
    const ProgramEnd end = RunProgram({"tune", "tryout", "--out", out.string()});
    EXPECT_EQ(end.exit_code, 2);
    EXPECT_EQ(end.err,
              "turbidock: " + (out / name).string() + ": cannot be written: it is a directory\n");
    EXPECT_FALSE(fs::exists(out / "evaluations.sqlite"));
    fs::remove_all(out);
  }
}

// A run that does not come to its end leaves nothing of an earlier one but its trials.
TEST(TuneProgram, WhatAnEarlierRunSaidGoes) {
  const fs::path out = fs::temp_directory_path() / ("turbidock_tune_" + std::to_string(getpid()));
  fs::create_directories(out);
  std::ofstream(out / "gains.yaml") << "# Found by `turbidock tune`\n";
  std::ofstream(out / "report.md") << "# 12 % cheaper\n";
  std::ofstream(out / "notes.txt") << "mine\n";
  std::ofstream(out / "study.yaml")
      << "schema_version: 1\ndescription: too short to dock\nscenario: sea_night_active\nseeds: 2\n"
         "set: {estimator.pose_source: true_pose, control.use: lqg, trial.duration_s: 0.5}\n"
         "tuning:\n"
         "  gains: [{key: control.lqg.yaw.error_rad, low: 0.02, high: 0.3, scale: log}]\n"
         "  objective: [{metric: time_s, weight: 1, failed: 60}]\n"
         "  optimiser: {population: 5, generations: 1}\n";
  const ProgramEnd end = RunProgram({"tune", (out / "study.yaml").string(), "--out", out.string()});
  EXPECT_EQ(end.exit_code, 2);
  EXPECT_THAT(end.err, ::testing::HasSubstr("the starting gains fail in every one of"));
  for (const char* name : {"gains.yaml", "report.md"}) EXPECT_FALSE(fs::exists(out / name)) << name;
  EXPECT_TRUE(fs::exists(out / "notes.txt"));
  fs::remove_all(out);
}

}  // namespace
}  // namespace turbidock::testing
