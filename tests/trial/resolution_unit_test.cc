// Other sizes of images, and half the rate of them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
  const Scenario quarter =
      LoadScenario("sea_night_active", {"cameras.rig.width_px=320", "cameras.rig.height_px=240"});
  const StereoRig before = full.rig.MakeRig(), after = quarter.rig.MakeRig();
  EXPECT_EQ(after.left.width_px, 320);
  EXPECT_EQ(after.right.height_px, 240);
  EXPECT_DOUBLE_EQ(after.left.fx_px, before.left.fx_px / 2);
  EXPECT_DOUBLE_EQ(after.left.fy_px, before.left.fy_px / 2);
  EXPECT_DOUBLE_EQ(after.left.cx_px, 159.5);
  EXPECT_DOUBLE_EQ(after.left.vertical_fov_rad(), before.left.vertical_fov_rad());
}

TEST(Resolution, BadInput) {
  for (const char* size :
       {"cameras.rig.width_px=0", "cameras.rig.height_px=15", "cameras.rig.width_px=9000"})
    EXPECT_THROW(LoadScenario("pool_active", {size}), ConfigError) << size;
}

// Six frames at half the rate: three images, and the command holds in between.
TEST(CameraPeriod, HoldsTheCommandBetweenImages) {
  const Scenario scenario =
      LoadScenario("pool_active", {"cameras.rig.width_px=160", "cameras.rig.height_px=120",
                                   "trial.duration_s=0.2", "cameras.period_frames=2"});
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
  EXPECT_THROW(LoadScenario("pool_active", {"cameras.period_frames=4"}), ConfigError);
  const ProgramEnd end = RunProgram({"run", "pool_active", "--set", "cameras.period_frames=4"});
  EXPECT_EQ(end.exit_code, 2);
  EXPECT_THAT(end.err, HasSubstr("must divide trial.clock.frames_per_second (30)"));
}

}  // namespace
}  // namespace turbidock::trial
