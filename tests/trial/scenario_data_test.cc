// Every bundled model and scenario loads, survives a round trip and takes a step.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "control/p_voltage.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "experiments/trial/world.h"
#include "sim/light/scattering.h"
#include "sim/vehicle/scene.h"
#include "tests/control/published_vehicle.h"
#include "tests/support/message_of.h"

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
  const Scenario scenario = LoadScenario(GetParam(), {"trial.duration_s=0.2"});
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
  const vehicle::Scene scene = vehicle::LoadScene(SceneFilesOf(scenario), scenario.rig);
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

TEST(EstimatorPreset, SetsTheOtherKeysWhereItIsGiven) {
  const auto estimator = [](const std::vector<std::string>& assignments) {
    return config::SaveYaml(
        LoadScenario("pool_active", assignments).plugins.ParamsOf<vision::RmGaOptions>());
  };
  EXPECT_EQ(estimator({}), config::SaveYaml(vision::RmGaOptions{}));
  EXPECT_EQ(estimator({"estimator.rm_ga.preset=published"}),
            config::SaveYaml(vision::RmGaOptions::Published()));
  EXPECT_EQ(estimator({"estimator.rm_ga.population=80", "estimator.rm_ga.preset=published"}),
            config::SaveYaml(vision::RmGaOptions::Published()));
  vision::RmGaOptions changed = vision::RmGaOptions::Published();
  changed.population = 80;
  EXPECT_EQ(estimator({"estimator.rm_ga.preset=published", "estimator.rm_ga.population=80"}),
            config::SaveYaml(changed));
}

TEST(OpticsPreset, SetsTheOtherKeysWhereItIsGiven) {
  const auto sensor = [](const std::vector<std::string>& assignments) {
    return LoadScenario("pool_passive", assignments).sensor;
  };
  EXPECT_EQ(config::SaveYaml(sensor({"cameras.optics=modern_digital"})),
            config::SaveYaml(camera::SensorParams{}));
  EXPECT_EQ(config::SaveYaml(LoadScenario("pool_passive", {"cameras.optics=modern_digital"}).hue),
            config::SaveYaml(vision::HueParams{}));
  EXPECT_EQ(config::SaveYaml(sensor({})), config::SaveYaml(sensor({"cameras.optics=published"})));
  camera::SensorParams changed = sensor({"cameras.optics=published"});
  EXPECT_GT(changed.chroma_blur_px, 0);
  EXPECT_EQ(changed.transfer, camera::TransferCurve::kLinear);
  EXPECT_EQ(config::SaveYaml(sensor({"cameras.sensor.gain=3", "cameras.optics=published"})),
            config::SaveYaml(changed));
  changed.gain = 3;
  EXPECT_EQ(config::SaveYaml(sensor({"cameras.optics=published", "cameras.sensor.gain=3"})),
            config::SaveYaml(changed));
}

TEST(OpticsPreset, IsFoundInWhicheverLayerNamesIt) {
  const auto folder = std::filesystem::temp_directory_path();
  const auto file = (folder / "turbidock_optics.yaml").string();
  const auto gains = (folder / "turbidock_optics_gains.yaml").string();
  std::ofstream(file) << "schema_version: 1\n"
                         "trial: {seed: 1, duration_s: 1, scene: pool_passive.xml}\n"
                         "cameras: {sensor: {gain: 3}, optics: published}\n";
  std::ofstream(gains) << "cameras: {optics: modern_digital}\n";
  const auto sensor = [&](const std::string& gains_file, const char* assignment) {
    return LoadScenario(file, {assignment}, gains_file).sensor;
  };
  EXPECT_GT(sensor("", "trial.seed=2").chroma_blur_px, 0);
  EXPECT_EQ(sensor("", "trial.seed=2").gain,
            3);  // a preset comes before the other keys of its file
  EXPECT_EQ(sensor(gains, "trial.seed=2").chroma_blur_px, 0);
  EXPECT_EQ(sensor(gains, "trial.seed=2").gain, camera::SensorParams().gain);
  EXPECT_GT(sensor(gains, "cameras.optics=published").chroma_blur_px, 0);
  EXPECT_EQ(sensor(gains, "cameras.optics=published").gain, 27);
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

// What the controller is told of the bundled vehicle, against the same typed by hand.
TEST(KnownVehicle, IsThePublishedOne) {
  const control::VehicleModel known = ModelOf(LoadScenario("sea_night_active", {}));
  const control::VehicleModel typed = control::PublishedVehicle();
  ASSERT_EQ(known.thrusters.size(), typed.thrusters.size());
  for (size_t i = 0; i < typed.thrusters.size(); ++i) {
    EXPECT_EQ(known.thrusters[i].name, typed.thrusters[i].name);
    EXPECT_NEAR((known.thrusters[i].p_BT - typed.thrusters[i].p_BT).norm(), 0, 1e-12);
    EXPECT_NEAR((known.thrusters[i].axis_B - typed.thrusters[i].axis_B).norm(), 0, 1e-12);
    EXPECT_EQ(known.thrusters[i].curve.FullForward(), 4.9);
    EXPECT_EQ(known.thrusters[i].curve.dead_band_volts, 0.19);
    EXPECT_EQ(known.thrusters[i].effectiveness, 1);
  }
  EXPECT_NEAR((known.inertia - typed.inertia).norm(), 0, 1e-12);
  EXPECT_EQ(known.linear_damping, typed.linear_damping);
  EXPECT_EQ(known.quadratic_damping, typed.quadratic_damping);
  EXPECT_EQ(known.thruster_lag_s, typed.thruster_lag_s);
  EXPECT_NEAR(known.head_ahead_m, typed.head_ahead_m, 1e-12);
}

// The controller does not hear of what is different in the water.
TEST(KnownVehicle, IsNotTheOneInTheWater) {
  const control::VehicleModel nominal = ModelOf(LoadScenario("sea_night_active", {}));
  const control::VehicleModel known = ModelOf(LoadScenario(
      "sea_night_active", {"vehicle.rigid_body.mass_kg=20", "vehicle.thrusters.max_thrust_newton=3",
                           "vehicle.thrusters.effectiveness=[1, 0, 1, 1]"}));
  EXPECT_EQ(known.inertia, nominal.inertia);
  EXPECT_EQ(known.thrusters[1].effectiveness, 1);
  EXPECT_EQ(known.thrusters[0].curve.FullForward(), 4.9);
  const control::VehicleModel told = ModelOf(LoadScenario(
      "sea_night_active", {"control.known_vehicle.rigid_body.mass_kg=20",
                           "control.known_vehicle.thrusters.effectiveness=[1, 0, 1, 1]"}));
  EXPECT_NEAR(told.inertia[control::kSurge], nominal.inertia[control::kSurge] + 5, 1e-12);
  EXPECT_EQ(told.thrusters[1].effectiveness, 0);
}

TEST(BundledScenarios, AreThoseOfTheDocumentation) {
  EXPECT_EQ(
      config::BundledNames("scenarios"),
      (std::vector<std::string>{"approach_5m", "bluerov2_sea_night", "docking_cycles",
                                "paper_sea_night_active", "paper_sea_night_passive", "pool_active",
                                "pool_fiducial", "pool_passive", "sea_moored_active",
                                "sea_night_active", "sea_night_fiducial", "sea_night_passive"}));
}

// What one marker reaches and the other does not is then the marker's doing.
TEST(PaperScenarios, DifferInTheMarkerOnly) {
  const Scenario active = LoadScenario("paper_sea_night_active", {});
  Scenario passive = LoadScenario("paper_sea_night_passive", {});
  EXPECT_NE(config::SaveYaml(passive), config::SaveYaml(active));
  EXPECT_EQ(active.model, "sea_active.xml");
  EXPECT_EQ(passive.model, "sea_passive.xml");
  EXPECT_TRUE(active.light.ball_lights.enabled && passive.light.lamps.enabled);
  EXPECT_FALSE(active.light.lamps.enabled || passive.light.ball_lights.enabled);
  passive.model = active.model;
  passive.description = active.description;
  passive.light.ball_lights.enabled = active.light.ball_lights.enabled;
  passive.light.lamps.enabled = active.light.lamps.enabled;
  EXPECT_EQ(config::SaveYaml(passive), config::SaveYaml(active));
}

// No filter, no lead and no compensation; from less than 1.5 m to 600 and 350 mm.
TEST(PaperScenarios, FlyThePublishedLawAndProcedure) {
  for (const char* name : {"paper_sea_night_active", "paper_sea_night_passive"}) {
    const Scenario scenario = LoadScenario(name, {});
    EXPECT_EQ(scenario.controller_name(), "p_voltage");
    EXPECT_EQ(config::SaveYaml(scenario.plugins.ParamsOf<control::PVoltageParams>()),
              config::SaveYaml(control::PVoltageParams{}));
    EXPECT_EQ(scenario.procedure.servo_x_m, 0.6);
    EXPECT_EQ(scenario.procedure.docking_x_m, 0.35);
    EXPECT_EQ(scenario.procedure.docked_x_m, 0.35);
    EXPECT_EQ(scenario.procedure.allowance_y_m, 0.04);
    EXPECT_EQ(scenario.procedure.allowance_z_m, 0.04);
    const vehicle::SeaParams sea = LoadScenario("sea_night_active", {}).sea;
    EXPECT_EQ(config::SaveYaml(scenario.sea), config::SaveYaml(sea));
  }
}

// The glossary's table.
TEST(Milk, IsAsClearAsTheGlossarySays) {
  std::ifstream table(TURBIDOCK_TEST_DATA "/../../assets/measured/milk_visibility.csv");
  int rows = 0;
  for (std::string line; std::getline(table, line);) {
    double milk_ml_m3 = 0, sight_m = 0, extinction_per_m = 0;
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf", &milk_ml_m3, &sight_m, &extinction_per_m) != 3)
      continue;
    ++rows;
    const Scenario scenario =
        LoadScenario("pool_active", {fmt::format("water.milk_ml_m3={}", milk_ml_m3)});
    const double green_per_m = light::MakeMedium(scenario.light.water).extinction_per_m()[1];
    // as far as they are rounded
    EXPECT_NEAR(green_per_m, extinction_per_m, 0.005 + 1e-9) << line;
    EXPECT_NEAR(std::log(50) / green_per_m, sight_m, (sight_m < 10 ? 0.05 : 0.5) + 1e-9) << line;
  }
  EXPECT_EQ(rows, 7);
}

TEST(StartPose, IsWithinItsBoundsForEverySeed) {
  for (int seed = 0; seed < 200; ++seed) {
    const char* name = seed % 2 ? "sea_night_active" : "paper_sea_night_active";
    const Scenario scenario = LoadScenario(name, {"trial.seed=" + std::to_string(seed)});
    const Pose X_MH = StartPose(scenario);
    EXPECT_GE(-X_MH.p.x(), scenario.start.distance_min_m);
    EXPECT_LE(-X_MH.p.x(), scenario.start.distance_max_m);
    EXPECT_LE(X_MH.p.norm(), 1.5);  // paper: within 1.5 m
    EXPECT_LE(std::abs(X_MH.p.y()), scenario.start.lateral_m);
    EXPECT_LE(std::abs(YawOf(X_MH.q)), scenario.start.heading_rad);
  }
}

}  // namespace
}  // namespace turbidock::trial
