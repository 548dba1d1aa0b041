#include "experiments/trial/scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "sim/base/random.h"

namespace turbidock::trial {
namespace {

namespace fs = std::filesystem;

// Without these a file would mean something else with every change of a default.
constexpr std::array kRequired = {"schema_version", "seed", "duration_s", "model"};

bool IsFile(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

bool IsBundledModel(const std::string& model) {
  return model.find('/') == std::string::npos && IsFile(config::ModelPath(model));
}

// A bundled model keeps its name. Any other is a file, beside the scenario or, from the command
// line, in the working directory; it becomes an absolute path, so that the resolved scenario runs
// anywhere.
void ResolveModel(const std::string& scenario_file, const config::Origins& origins,
                  Scenario* scenario) {
  if (IsBundledModel(scenario->model)) return;
  const std::string& origin = origins.at("model");
  const fs::path folder =
      origin.starts_with("--set") ? fs::current_path() : fs::path(scenario_file).parent_path();
  const fs::path path = fs::absolute(folder / scenario->model).lexically_normal();
  if (!IsFile(path))
    throw ConfigError(origin + "model = '" + scenario->model +
                      "', is neither a file nor one of the bundled models");
  scenario->model = path.string();
}

}  // namespace

void StartParams::Check(const std::string& path) const {
  if (distance_min_m > distance_max_m)
    throw ConfigError(JoinKey(path, "distance_min_m"), FormatNumber(distance_min_m) +
                                                           " must not exceed distance_max_m (" +
                                                           FormatNumber(distance_max_m) + ")");
}

void Scenario::Check(const std::string& path) const {
  if (clock.frames_per_second % camera_period_frames != 0)
    throw ConfigError(JoinKey(path, "camera_period_frames"),
                      std::to_string(camera_period_frames) +
                          " must divide clock.frames_per_second (" +
                          std::to_string(clock.frames_per_second) + ")");
  for (size_t i = 0; i < faults.lights.size(); ++i)
    faults.lights[i].CheckLight(JoinKey(path, "faults.lights[" + std::to_string(i) + "]"),
                                light.ball_lights.balls);
  if (pose_source == PoseSource::kTruePose && faults.seen())
    throw ConfigError(JoinKey(path, "faults"),
                      "with pose_source = true_pose only thrusters can fail: nothing is seen");
}

void CheckMarker(const Scenario& scenario, const vehicle::Scene& scene) {
  if (scenario.marker_may_differ) return;
  constexpr double kTol_m = 1e-3;
  const auto fail = [&](const std::string& ball, const std::string& problem) {
    throw ConfigError("marker.balls", "ball " + ball + " " + problem + " (" + scenario.model +
                                          "); set marker_may_differ to run all the same");
  };
  const auto text = [](const Eigen::Vector3d& p, double radius_m) {
    return fmt::format("[{:.4g}, {:.4g}, {:.4g}] m with a radius of {:.4g} m", p.x(), p.y(), p.z(),
                       radius_m);
  };
  for (const vision::BallParams& known : scenario.marker.balls) {
    const auto real = std::find_if(scene.balls.begin(), scene.balls.end(),
                                   [&](const auto& ball) { return ball.name == known.name; });
    if (real == scene.balls.end()) fail(known.name, "is not in the scene");
    if ((real->p_MQ - known.p_MQ_m).norm() > kTol_m ||
        std::abs(real->radius_m - known.radius_m) > kTol_m)
      fail(known.name, "is known at " + text(known.p_MQ_m, known.radius_m) +
                           ", but in the scene it is at " + text(real->p_MQ, real->radius_m));
  }
  for (const vehicle::BallInScene& real : scene.balls) {
    const auto& known = scenario.marker.balls;
    if (std::none_of(known.begin(), known.end(),
                     [&](const auto& ball) { return ball.name == real.name; }))
      fail(real.name, "of the scene is not known");
  }
}

Scenario ScenarioBefore(vision::Preset estimator, OpticsPreset optics) {
  Scenario scenario;
  const auto begin_with = [](const std::string& data, auto* object) {
    config::ReadFields(config::LoadYaml(data), object, nullptr);
  };
  scenario.estimator = vision::RmGaOptions::Of(estimator);
  begin_with(config::ModelPath("vehicle.yaml"), &scenario.vehicle);
  begin_with(config::AssetPath("rig_default.yaml"), &scenario.rig);
  begin_with(config::AssetPath("marker_default.yaml"), &scenario.marker);
  begin_with(config::AssetPath("gains.yaml"), &scenario);
  if (optics == OpticsPreset::kPublished) begin_with(config::AssetPath("optics.yaml"), &scenario);
  return scenario;
}

Scenario LoadScenario(const std::string& name, const std::vector<std::string>& assignments,
                      const std::string& gains_file) {
  config::Layers layers{
      .files = {config::LoadYaml(config::FindBundled("scenarios", "scenario", name))},
      .assignments = assignments};
  const config::YamlNode file = layers.files[0];
  for (const char* key : kRequired)
    if (!file.Find(key)) throw ConfigError(file.file + ": " + key + ": this key is required");
  if (!gains_file.empty()) layers.files.push_back(config::LoadYaml(gains_file));

  Scenario scenario =
      ScenarioBefore(config::Peek(layers, "estimator.preset", Scenario().estimator.preset),
                     config::Peek(layers, "optics", Scenario().optics));
  const config::Origins origins = config::ReadLayers(layers, &scenario);
  ResolveModel(file.file, origins, &scenario);
  return scenario;
}

Scenario ParseScenario(const std::string& text, const std::string& name) {
  Scenario scenario;
  config::ReadLayers({.files = {config::ParseYaml(text, name)}}, &scenario);
  return scenario;
}

std::vector<std::string> ResolutionAssignments(const std::string& text) {
  const size_t times = std::min(text.find('x'), text.size());
  const std::string width = text.substr(0, times);
  const std::string height = times < text.size() ? text.substr(times + 1) : "";
  for (const std::string& number : {width, height})
    if (number.empty() || number.find_first_not_of("0123456789") != std::string::npos)
      throw ConfigError("--resolution " + text, "must be WIDTHxHEIGHT in pixels, such as 320x240");
  RigParams rig;
  try {
    config::ApplySet("width_px=" + width, &rig, nullptr);
    config::ApplySet("height_px=" + height, &rig, nullptr);
  } catch (const ConfigError&) {
    throw ConfigError("--resolution " + text, "each side must be in [16, 8192] pixels");
  }
  return {"rig.width_px=" + width, "rig.height_px=" + height};
}

std::string SceneFile(const Scenario& scenario) {
  return IsBundledModel(scenario.model) ? config::ModelPath(scenario.model) : scenario.model;
}

std::string SaveScenario(const Scenario& scenario) { return config::SaveYaml(scenario); }

std::vector<config::KeyDoc> ScenarioKeys() { return config::ListKeys<Scenario>(); }

Pose DrawStart(const Scenario& scenario) {
  Rng rng = SeedTree(static_cast<uint64_t>(scenario.seed)).Stream("start");
  const StartParams& s = scenario.start;
  const double distance_m = rng.Uniform(s.distance_min_m, s.distance_max_m);
  const double y_m = rng.Uniform(-s.lateral_m, s.lateral_m);
  const double z_m = rng.Uniform(-s.vertical_m, s.vertical_m);
  const double yaw_rad = rng.Uniform(-s.heading_rad, s.heading_rad);
  return {FromYawPitchRoll(yaw_rad, 0, 0), {-distance_m, y_m, z_m}};
}

}  // namespace turbidock::trial

template void turbidock::CheckFields(const turbidock::trial::Scenario&, const std::string&);
template turbidock::config::GroupRef turbidock::config::GroupOf(turbidock::trial::Scenario*);
