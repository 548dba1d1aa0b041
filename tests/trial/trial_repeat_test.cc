// The same scenario and seed give the same digest, whoever watches and wherever it runs.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "experiments/config/yaml_fields.h"
#include "experiments/system/subprocess.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "tests/support/program.h"

namespace turbidock::trial {
namespace {

const std::vector<std::string> kShort = {"trial.duration_s=1.5", "trial.seed=11"};

std::string DigestOf(const Scenario& scenario, const TrialOptions& options = {}) {
  return RunTrial(scenario, options).digest;
}

TEST(TrialRepeat, SameSeedSameDigestAndObserversDoNotDisturb) {
  const Scenario scenario = LoadScenario("sea_night_active", kShort);
  const std::string digest = DigestOf(scenario);
  EXPECT_EQ(DigestOf(scenario), digest);
  int frames = 0;
  TrialOptions watched;
  watched.spectator = true;
  watched.observe = [&](const TrialFrame& frame) { frames += frame.spectator != nullptr; };
  EXPECT_EQ(DigestOf(scenario, watched), digest);
  EXPECT_EQ(frames, 45);
}

TEST(TrialRepeat, TheDigestSeesTheSeedAndEveryStageOfTheLoop) {
  const std::string digest = DigestOf(LoadScenario("sea_night_active", kShort));
  for (const std::string change : {"trial.seed=12",
                                   "vehicle.rigid_body.mass_kg=15.001",
                                   "sea.current.gust_std_mps=0.011",
                                   "water.milk_ml_m3=5",
                                   "cameras.sensor.read_noise_electrons=5.5",
                                   "estimator.hue.window_rad=0.05",
                                   "estimator.rm_ga.population=61",
                                   "cameras.delay_frames=2",
                                   "cameras.drop_probability=0.2",
                                   "cameras.optics=modern_digital",
                                   "cameras.sensor.auto_level=0.0001",
                                   "cameras.sensor.chroma_blur_px=2",
                                   "cameras.sensor.white_balance=[1, 1, 0.5]",
                                   "cameras.sensor.auto_white_balance_limit=2",
                                   "cameras.lens.k1=-0.05",
                                   "water.snow.particles_per_m3=20000",
                                   "control.lqg.sway.effort_share=0.5",
                                   "control.known_vehicle.thrusters.dead_band_volts=0.2",
                                   "procedure.found_hold_s=0.6",
                                   "vehicle.thrusters.max_thrust_newton=6"}) {
    std::vector<std::string> assignments = kShort;
    assignments.push_back(change);
    EXPECT_NE(DigestOf(LoadScenario("sea_night_active", assignments)), digest) << change;
  }
}

TEST(TrialRepeat, TheDigestSeesEstimatesThatDoNotMoveTheVehicle) {
  // Without thrusters the vehicle moves the same whatever the estimator says.
  std::vector<std::string> drifting = kShort;
  drifting.push_back("vehicle.thrusters.effectiveness=[0, 0, 0, 0]");
  const TrialResult one = RunTrial(LoadScenario("sea_night_active", drifting));
  drifting.push_back("estimator.rm_ga.population=61");
  const TrialResult other = RunTrial(LoadScenario("sea_night_active", drifting));
  EXPECT_EQ(one.log.frames.back().true_X_WB.p, other.log.frames.back().true_X_WB.p);
  EXPECT_NE(one.digest, other.digest);
}

TEST(TrialRepeat, ResolvedYamlRunsToTheSameDigest) {
  const Scenario scenario = LoadScenario("pool_passive", kShort);
  const auto file = std::filesystem::temp_directory_path() / "turbidock_resolved_test.yaml";
  std::ofstream(file) << config::SaveYaml(scenario);
  EXPECT_EQ(DigestOf(LoadScenario(file.string(), {})), DigestOf(scenario));
  std::filesystem::remove(file);
}

TEST(TrialRepeat, TwoProcessesAtOnceAgree) {
  const std::vector<std::string> command = {testing::ProgramPath(),
                                            "run",
                                            "sea_night_active",
                                            "--set",
                                            kShort[0],
                                            "--set",
                                            kShort[1],
                                            "--json",
                                            "--quiet"};
  system::Subprocess first(command, "turbidock"), second(command, "turbidock");
  const auto a = nlohmann::json::parse(first.Finish());
  const auto b = nlohmann::json::parse(second.Finish());
  EXPECT_EQ(a["digest"], b["digest"]);
  EXPECT_EQ(a["digest"], DigestOf(LoadScenario("sea_night_active", kShort)));
}

}  // namespace
}  // namespace turbidock::trial
