// The program `tune`, where it must not begin.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
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

}  // namespace
}  // namespace turbidock::testing
