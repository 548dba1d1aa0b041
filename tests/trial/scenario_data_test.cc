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
  EXPECT_EQ(config::SaveYaml(sensor({"optics=modern_digital"})),
            config::SaveYaml(camera::SensorParams{}));
  EXPECT_EQ(config::SaveYaml(LoadScenario("pool_passive", {"optics=modern_digital"}).hue),
            config::SaveYaml(vision::HueParams{}));
  EXPECT_EQ(config::SaveYaml(sensor({})), config::SaveYaml(sensor({"optics=published"})));
  camera::SensorParams changed = sensor({"optics=published"});
  EXPECT_GT(changed.chroma_blur_px, 0);
  EXPECT_EQ(changed.transfer, camera::TransferCurve::kLinear);
  changed.gain = 3;
  EXPECT_EQ(config::SaveYaml(sensor({"sensor.gain=3", "optics=published"})),
            config::SaveYaml(changed));
  EXPECT_EQ(config::SaveYaml(sensor({"optics=published", "sensor.gain=3"})),
            config::SaveYaml(changed));
}

TEST(OpticsPreset, IsFoundInWhicheverLayerNamesIt) {
  const auto folder = std::filesystem::temp_directory_path();
  const auto file = (folder / "turbidock_optics.yaml").string();
  const auto gains = (folder / "turbidock_optics_gains.yaml").string();
  std::ofstream(file) << "schema_version: 1\nseed: 1\nduration_s: 1\nmodel: pool_passive.xml\n"
                         "sensor: {gain: 3}\noptics: published\n";
  std::ofstream(gains) << "optics: modern_digital\n";
  const auto blur_px = [&](const std::string& gains_file, const char* assignment) {
    const Scenario scenario = LoadScenario(file, {assignment}, gains_file);
    EXPECT_EQ(scenario.sensor.gain, 3);
    return scenario.sensor.chroma_blur_px;
  };
  EXPECT_GT(blur_px("", "seed=2"), 0);
  EXPECT_EQ(blur_px(gains, "seed=2"), 0);
  EXPECT_GT(blur_px(gains, "optics=published"), 0);
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

// To the three digits that the file has.
TEST(Gains, ModelTheVehicle) {
  const Scenario scenario = LoadScenario("sea_night_active", {});
  const vehicle::VehicleParams& vehicle = scenario.vehicle;
  const vehicle::HydrodynamicsParams& hydro = vehicle.hydrodynamics;
  const vehicle::ThrusterParams& thrusters = vehicle.thrusters;
  // drag linearised about these speeds through the water
  const auto damping = [&](int axis, double speed) {
    return hydro.linear_damping_diagonal[axis] + 2 * speed * hydro.quadratic_damping_diagonal[axis];
  };
  const double newton_per_v =
      thrusters.max_thrust_newton / (kNeutralVolts - thrusters.dead_band_volts);
  const auto expect = [](double got, double want, const char* what) {
    EXPECT_NEAR(got, want, 0.005 * want) << what;
  };
  const auto expect_axis = [&](const control::LqgParams::Translation& model, int axis, double speed,
                               int thruster_count, const char* what) {
    expect(model.mass_kg, vehicle.rigid_body.mass_kg + hydro.added_mass_diagonal[axis], what);
    expect(model.damping_newton_s_per_m, damping(axis, speed), what);
    expect(model.thrust_newton_per_v, thruster_count * newton_per_v, what);
  };
  const control::LqgParams& lqg = scenario.control.lqg;
  expect_axis(lqg.surge, 0, 0.05, 2, "surge");
  expect_axis(lqg.sway, 1, 0.1, 1, "sway");
  expect_axis(lqg.heave, 2, 0.05, 1, "heave");
  expect(lqg.yaw.inertia_kg_m2, vehicle.rigid_body.inertia_kg_m2.z() + hydro.added_mass_diagonal[5],
         "yaw");
  expect(lqg.yaw.damping_newton_m_s, damping(5, 0.1), "yaw");
  expect(lqg.yaw.moment_newton_m_per_v, 2 * 0.1 * newton_per_v,
         "yaw");  // arms of models/vehicle.xml
  EXPECT_EQ(lqg.thruster_lag_s, thrusters.lag_s);
}

TEST(BundledScenarios, AreTheSixOfTheDocumentation) {
  EXPECT_EQ(
      config::BundledNames("scenarios"),
      (std::vector<std::string>{"paper_sea_night_active", "paper_sea_night_passive", "pool_active",
                                "pool_passive", "sea_night_active", "sea_night_passive"}));
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
    EXPECT_EQ(scenario.control.controller, control::Law::kPVoltage);
    EXPECT_EQ(config::SaveYaml(scenario.control.p_voltage),
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

TEST(StartPose, IsWithinItsBoundsForEverySeed) {
  for (int seed = 0; seed < 200; ++seed) {
    const char* name = seed % 2 ? "sea_night_active" : "paper_sea_night_active";
    const Scenario scenario = LoadScenario(name, {"seed=" + std::to_string(seed)});
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
