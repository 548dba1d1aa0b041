// Every bundled model and scenario loads, survives a round trip and takes a step.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "sim/vehicle/scene.h"

namespace turbidock::trial {
namespace {

// Whether a dotted key is in a file.
bool Holds(const config::YamlNode& node, const std::string& key) {
  const size_t dot = key.find('.');
  const auto child = node.Find(key.substr(0, dot));
  return child && (dot == std::string::npos || Holds(*child, key.substr(dot + 1)));
}

class EveryScenario : public ::testing::TestWithParam<std::string> {};

TEST_P(EveryScenario, LoadsAndTakesAFewFrames) {
  const Scenario scenario = LoadScenario(GetParam(), {"duration_s=0.2"});
  EXPECT_FALSE(scenario.description.empty());
  const TrialResult result = RunTrial(scenario);
  EXPECT_EQ(result.outcome, Outcome::kTimeout) << result.reason;
  EXPECT_EQ(std::ssize(result.log.frames), 6);
}

TEST_P(EveryScenario, SavedAndLoadedItIsTheSame) {
  const Scenario scenario = LoadScenario(GetParam(), {});
  const std::string saved = config::SaveYaml(scenario);
  const auto file = std::filesystem::temp_directory_path() / ("turbidock_" + GetParam() + ".yaml");
  std::ofstream(file) << saved;
  EXPECT_EQ(config::SaveYaml(LoadScenario(file.string(), {})), saved);
  std::filesystem::remove(file);
}

TEST_P(EveryScenario, TheEstimatorKnowsTheSceneSMarker) {
  const Scenario scenario = LoadScenario(GetParam(), {});
  const vehicle::Scene scene = vehicle::LoadScene(SceneFile(scenario), scenario.rig);
  ASSERT_EQ(scene.balls.size(), scenario.marker.balls.size());
  for (const vision::BallParams& known : scenario.marker.balls) {
    int found = 0;
    for (const vehicle::BallInScene& ball : scene.balls) {
      if (ball.name != known.name) continue;
      ++found;
      EXPECT_LT((ball.p_MQ - known.p_MQ_m).norm(), 1e-9) << ball.name;
      EXPECT_NEAR(ball.radius_m, known.radius_m, 1e-9) << ball.name;
    }
    EXPECT_EQ(found, 1) << known.name;
  }
}

TEST(EstimatorPreset, IsWhatTheOtherKeysBeginWith) {
  const auto estimator = [](const std::vector<std::string>& assignments) {
    return config::SaveYaml(LoadScenario("pool_active", assignments).estimator);
  };
  EXPECT_EQ(estimator({}), config::SaveYaml(vision::RmGaOptions{}));
  EXPECT_EQ(estimator({"estimator.preset=published"}),
            config::SaveYaml(vision::RmGaOptions::Published()));
  // Whatever the order.
  vision::RmGaOptions changed = vision::RmGaOptions::Published();
  changed.population = 80;
  EXPECT_EQ(estimator({"estimator.population=80", "estimator.preset=published"}),
            config::SaveYaml(changed));
  EXPECT_EQ(estimator({"estimator.preset=published", "estimator.population=80"}),
            config::SaveYaml(changed));
}

TEST(OpticsPreset, IsWhatTheOtherKeysBeginWith) {
  const auto sensor = [](const std::vector<std::string>& assignments) {
    return LoadScenario("pool_passive", assignments).sensor;
  };
  EXPECT_EQ(config::SaveYaml(sensor({"optics=plain"})), config::SaveYaml(camera::SensorParams{}));
  EXPECT_EQ(config::SaveYaml(LoadScenario("pool_passive", {"optics=plain"}).hue),
            config::SaveYaml(vision::HueParams{}));
  EXPECT_EQ(config::SaveYaml(sensor({})), config::SaveYaml(sensor({"optics=plain"})));
  camera::SensorParams changed = sensor({"optics=calibrated"});
  EXPECT_GT(changed.chroma_blur_px, 0);
  EXPECT_EQ(changed.transfer, camera::TransferCurve::kNtsc);
  changed.gain = 3;
  EXPECT_EQ(config::SaveYaml(sensor({"sensor.gain=3", "optics=calibrated"})),
            config::SaveYaml(changed));
  EXPECT_EQ(config::SaveYaml(sensor({"optics=calibrated", "sensor.gain=3"})),
            config::SaveYaml(changed));
}

TEST(OpticsPreset, IsFoundInWhicheverLayerNamesIt) {
  const auto folder = std::filesystem::temp_directory_path();
  const auto file = (folder / "turbidock_optics.yaml").string();
  const auto gains = (folder / "turbidock_optics_gains.yaml").string();
  std::ofstream(file) << "schema_version: 1\nseed: 1\nduration_s: 1\nmodel: pool_passive.xml\n"
                         "sensor: {gain: 3}\noptics: calibrated\n";
  std::ofstream(gains) << "optics: plain\n";
  const auto blur_px = [&](const std::string& gains_file, const char* assignment) {
    const Scenario scenario = LoadScenario(file, {assignment}, gains_file);
    EXPECT_EQ(scenario.sensor.gain, 3);
    return scenario.sensor.chroma_blur_px;
  };
  EXPECT_GT(blur_px("", "seed=2"), 0);
  EXPECT_EQ(blur_px(gains, "seed=2"), 0);
  EXPECT_GT(blur_px(gains, "optics=calibrated"), 0);
  std::filesystem::remove(file);
  std::filesystem::remove(gains);
}

INSTANTIATE_TEST_SUITE_P(Bundled, EveryScenario,
                         ::testing::ValuesIn(config::BundledNames("scenarios")),
                         [](const auto& scenario) { return scenario.param; });

// The file holds the sources, the structs what a program without it gets.
TEST(VehicleData, IsWhatTheStructsDefaultTo) {
  vehicle::VehicleParams read;
  config::ReadFields(config::LoadYaml(config::ModelPath("vehicle.yaml")), &read, nullptr);
  EXPECT_EQ(config::SaveYaml(read), config::SaveYaml(vehicle::VehicleParams()));
  // A key that the file left out would agree by default.
  const config::YamlNode file = config::LoadYaml(config::ModelPath("vehicle.yaml"));
  int found = 0;
  for (const config::KeyDoc& doc : config::ListKeys<vehicle::VehicleParams>()) {
    if (doc.key.find("[]") != std::string::npos) continue;
    EXPECT_TRUE(Holds(file, doc.key)) << doc.key;
    ++found;
  }
  EXPECT_GT(found, 20);
}

// The autopilot inverts the thrusters' curve: it must be this vehicle's.
TEST(Gains, InvertTheVehiclesThrusters) {
  const Scenario scenario = LoadScenario("sea_night_active", {});
  for (const control::AllocationParams& allocation :
       {scenario.control.pid.allocation, scenario.control.lqg.allocation}) {
    EXPECT_EQ(allocation.dead_band_v, scenario.vehicle.thrusters.dead_band_volts);
    EXPECT_EQ(allocation.curve_exponent, scenario.vehicle.thrusters.curve_exponent);
  }
  // The published law compensates nothing.
  EXPECT_EQ(scenario.control.p_voltage.allocation.dead_band_v, 0);
}

TEST(BundledScenarios, AreTheFourOfTheDocumentation) {
  EXPECT_EQ(config::BundledNames("scenarios"),
            (std::vector<std::string>{"pool_active", "pool_passive", "sea_night_active",
                                      "sea_night_passive"}));
}

TEST(StartPose, IsWithinItsBoundsForEverySeed) {
  for (int seed = 0; seed < 200; ++seed) {
    const Scenario scenario = LoadScenario("sea_night_active", {"seed=" + std::to_string(seed)});
    const Pose X_MH = DrawStart(scenario);
    EXPECT_GE(-X_MH.p.x(), scenario.start.distance_min_m);
    EXPECT_LE(-X_MH.p.x(), scenario.start.distance_max_m);
    EXPECT_LE(X_MH.p.norm(), 1.5);  // paper: within 1.5 m
    EXPECT_LE(std::abs(X_MH.p.y()), scenario.start.lateral_m);
    EXPECT_LE(std::abs(YawOf(X_MH.q)), scenario.start.heading_rad);
  }
}

}  // namespace
}  // namespace turbidock::trial
