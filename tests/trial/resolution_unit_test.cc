// Other sizes of images, and half the rate of them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "tests/support/program.h"

namespace turbidock::trial {
namespace {

using ::testing::HasSubstr;
using testing::ProgramEnd;
using testing::RunProgram;

TEST(Resolution, KeepsWhatIsSeen) {
  const Scenario full = LoadScenario("sea_night_active", {});
  const Scenario quarter = LoadScenario("sea_night_active", ResolutionAssignments("320x240"));
  const StereoRig before = full.rig.MakeRig(), after = quarter.rig.MakeRig();
  EXPECT_EQ(after.left.width_px, 320);
  EXPECT_EQ(after.right.height_px, 240);
  EXPECT_DOUBLE_EQ(after.left.fx_px, before.left.fx_px / 2);
  EXPECT_DOUBLE_EQ(after.left.fy_px, before.left.fy_px / 2);
  EXPECT_DOUBLE_EQ(after.left.cx_px, 159.5);
  EXPECT_DOUBLE_EQ(after.left.vertical_fov_rad(), before.left.vertical_fov_rad());
}

TEST(Resolution, IsWhatTheKeysOfTheRigSay) {
  EXPECT_EQ(ResolutionAssignments("320x240"),
            (std::vector<std::string>{"rig.width_px=320", "rig.height_px=240"}));
  const std::vector<std::string> run = {"run",    "pool_active", "--set", "duration_s=0.1",
                                        "--json", "--quiet"};
  const auto digest = [&run](const std::vector<std::string>& size) {
    std::vector<std::string> command = run;
    command.insert(command.end(), size.begin(), size.end());
    const ProgramEnd end = RunProgram(command);
    EXPECT_EQ(end.exit_code, 0) << end.err;
    return nlohmann::json::parse(end.out)["digest"].get<std::string>();
  };
  EXPECT_EQ(digest({"--resolution", "160x120"}),
            digest({"--set", "rig.width_px=160", "--set", "rig.height_px=120"}));
}

TEST(Resolution, BadInput) {
  for (const char* text :
       {"", "x", "320", "320x", "x240", "320*240", "320x240x1", "3e2x240", "a", "320x-1"})
    EXPECT_THROW(ResolutionAssignments(text), ConfigError) << text;
  for (const char* size : {"0x240", "9000x240"})
    EXPECT_THROW(LoadScenario("pool_active", ResolutionAssignments(size)), ConfigError) << size;
  const ProgramEnd end = RunProgram({"run", "pool_active", "--resolution", "12x"});
  EXPECT_EQ(end.exit_code, 2);
  EXPECT_THAT(end.err, HasSubstr("320x240"));
  EXPECT_EQ(RunProgram({"bench", "pool_active", "--resolution", "4x4"}).exit_code, 2);
}

// Six frames at half the rate: three images, and the command holds in between.
TEST(CameraPeriod, HoldsTheCommandBetweenImages) {
  const Scenario scenario = LoadScenario(
      "pool_active",
      {"rig.width_px=160", "rig.height_px=120", "duration_s=0.2", "camera_period_frames=2"});
  EXPECT_EQ(scenario.image_clock().frames_per_second, 15);
  EXPECT_DOUBLE_EQ(scenario.image_clock().dt_s(), scenario.clock.dt_s());
  std::vector<int64_t> evaluations, images;
  TrialOptions options;
  options.observe = [&](const TrialFrame& frame) {
    evaluations.push_back(frame.evaluations);
    images.push_back(frame.seen.frame);
  };
  const TrialResult result = RunTrial(scenario, options);
  ASSERT_EQ(result.log.frames.size(), 6u);
  for (size_t k = 0; k < 6; ++k) EXPECT_EQ(evaluations[k] > 0, k % 2 == 0) << k;
  EXPECT_EQ(images, (std::vector<int64_t>{-1, -1, 0, 0, 1, 1}));
  for (size_t k = 0; k < 6; k += 2) {
    EXPECT_EQ(result.log.frames[k + 1].command.volts, result.log.frames[k].command.volts);
    EXPECT_EQ(result.log.frames[k + 1].fitness, result.log.frames[k].fitness);
  }
  EXPECT_NE(result.log.frames[2].est_X_HM.p, result.log.frames[0].est_X_HM.p);
}

TEST(CameraPeriod, DividesTheFrameRate) {
  EXPECT_THROW(LoadScenario("pool_active", {"camera_period_frames=4"}), ConfigError);
  const ProgramEnd end = RunProgram({"run", "pool_active", "--set", "camera_period_frames=4"});
  EXPECT_EQ(end.exit_code, 2);
  EXPECT_THAT(end.err, HasSubstr("must divide clock.frames_per_second (30)"));
}

}  // namespace
}  // namespace turbidock::trial
