#include "experiments/trial/scenario.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <utility>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/scene_marker.h"
#include "sim/base/digest.h"
#include "sim/base/random.h"
#include "sim/vehicle/model_contents.h"
#include "vision/blob_estimator.h"
#include "vision/fiducial_estimator.h"
#include "vision/rm_ga.h"

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
std::string ResolvedFile(const std::string& key, const std::string& file,
                         const std::string& scenario_file, const std::string& origin,
                         const std::string& problem = "is no file") {
  const fs::path folder =
      origin.starts_with("--set") ? fs::current_path() : fs::path(scenario_file).parent_path();
  const fs::path path = fs::absolute(folder / file).lexically_normal();
  if (!IsFile(path)) throw ConfigError(origin + key + " = '" + file + "', " + problem);
  return path.string();
}

std::string ResolvedModel(const std::string& key, const std::string& model,
                          const std::string& scenario_file, const std::string& origin) {
  if (IsBundledModel(model)) return model;
  return ResolvedFile(key, model, scenario_file, origin,
                      "is neither a file nor one of the bundled models");
}

std::string PathOfModel(const std::string& model) {
  return IsBundledModel(model) ? config::ModelPath(model) : model;
}

// The vehicle's file in the layers, which decides what they are read over.
std::string VehicleModelIn(const config::Layers& layers, const std::string& scenario_file) {
  const std::string key = "vehicle_model";
  const std::string model = config::Peek(layers, key, Scenario().vehicle_model);
  const bool is_set = std::any_of(layers.assignments.begin(), layers.assignments.end(),
                                  [&](const auto& text) { return text.starts_with(key + "="); });
  return ResolvedModel(key, model, scenario_file, is_set ? "--set " : scenario_file + ": ");
}

// A pilot navigates by eye unless the layers say otherwise.
ScenarioPresets PresetsIn(const config::Layers& layers, const std::string& scenario_file) {
  const Scenario defaults;
  const bool by_hand = config::Peek(layers, "approach.mode", defaults.approach.mode) ==
                       control::ApproachMode::kPilot;
  return {.estimator = config::Peek(layers, "estimator.preset", defaults.estimator.preset),
          .optics = config::Peek(layers, "optics", defaults.optics),
          .navigation = config::Peek(
              layers, "navigation.preset",
              by_hand ? vehicle::NavigationPreset::kPilot : defaults.navigation.preset),
          .vehicle_model = VehicleModelIn(layers, scenario_file)};
}

// The vehicle's data, beside its MJCF.
std::string VehicleDataFile(const std::string& vehicle_model) {
  const fs::path data = fs::path(PathOfModel(vehicle_model)).replace_extension(".yaml");
  if (vehicle_model.ends_with(".urdf") || vehicle_model.ends_with(".xacro"))
    throw ConfigError("vehicle_model", "'" + vehicle_model +
                                           "' is a URDF; `turbidock check-vehicle FILE --mjcf "
                                           "NAME.xml` makes a vehicle of it");
  if (!IsFile(data))
    throw ConfigError("vehicle_model", "'" + vehicle_model +
                                           "' has no data beside it: " + data.string() +
                                           "; `turbidock check-vehicle` says what it is");
  return data.string();
}

// Faults of the same light multiply: however they flicker, it stays as bright as its keys allow.
void CheckBrightness(const std::vector<light::LightFault>& faults,
                     const light::BallLightParams& balls, const std::string& path) {
  for (size_t i = 0; i < faults.size(); ++i) {
    std::vector<light::LightFault> same;
    for (light::LightFault fault : faults) {
      if (fault.light != faults[i].light) continue;
      if (std::exchange(fault.flicker_hz, 0) > 0) fault.factor = std::max(1.0, fault.factor);
      same.push_back(fault);
    }
    try {
      CheckFields(light::LightsAt(balls, same, faults[i].begin_s).balls, "optics.ball_lights");
    } catch (const ConfigError& error) {
      throw ConfigError(
          JoinKey(config::ElementPath(path, i), "factor"),
          fmt::format("makes '{}' too bright, with all that acts on it from {} s on: {}",
                      faults[i].light, FormatNumber(faults[i].begin_s), error.what()));
    }
  }
}

void CheckShine(const std::string& ball, const std::vector<light::BallLight>& balls,
                const std::string& path) {
  if (ball.empty() || std::ranges::find(balls, ball, &light::BallLight::name) != balls.end())
    return;
  std::vector<std::string> known;
  known.reserve(balls.size());
  for (const light::BallLight& light : balls) known.push_back(light.name);
  throw ConfigError(JoinKey(path, "shines_as"),
                    fmt::format("'{}' must be empty or one of {}", ball, fmt::join(known, ", ")));
}

}  // namespace

void StartParams::Check(const std::string& path) const {
  if (distance_min_m > distance_max_m)
    throw ConfigError(JoinKey(path, "distance_min_m"), FormatNumber(distance_min_m) +
                                                           " must not exceed distance_max_m (" +
                                                           FormatNumber(distance_max_m) + ")");
  const auto require = [&path](const std::vector<double>& values, size_t count, const char* key) {
    if (!values.empty() && values.size() != count)
      throw ConfigError(JoinKey(path, key),
                        fmt::format("has {} numbers, must have {} or none", values.size(), count));
  };
  require(position_m, 3, "position_m");
  require(quaternion_wxyz, 4, "quaternion_wxyz");
  require(velocity_mps, 3, "velocity_mps");
  require(turn_rate_rad_s, 3, "turn_rate_rad_s");
  if (quaternion_wxyz.empty()) return;
  if (!placed())
    throw ConfigError(JoinKey(path, "quaternion_wxyz"),
                      "needs position_m: it is the attitude there");
  constexpr double kTol = 1e-3;
  const double norm = placed_X_WB().q.norm();
  if (!(std::abs(norm - 1) <= kTol))
    throw ConfigError(JoinKey(path, "quaternion_wxyz"),
                      fmt::format("has length {:.4g}, must be 1", norm));
}

Pose StartParams::placed_X_WB() const {
  Pose X_WB{Eigen::Quaterniond::Identity(), Eigen::Vector3d::Map(position_m.data())};
  if (const auto& q = quaternion_wxyz; !q.empty()) X_WB.q = {q[0], q[1], q[2], q[3]};
  return X_WB;
}

Twist StartParams::V_WB_B() const {
  Twist V_WB_B;
  if (!velocity_mps.empty()) V_WB_B.v = Eigen::Vector3d::Map(velocity_mps.data());
  if (!turn_rate_rad_s.empty()) V_WB_B.w = Eigen::Vector3d::Map(turn_rate_rad_s.data());
  return V_WB_B;
}

void Scenario::MoreFields(config::GroupRef* group) { plugins.AddTo(group); }

std::string Scenario::controller_name() const {
  return plugins.controller().empty() ? NameOf(control.controller) : plugins.controller();
}

std::string Scenario::estimator_name() const {
  return plugins.estimator().empty() ? NameOf(pose_estimator) : plugins.estimator();
}

control::ControlParams Scenario::ControlInUse() const {
  control::ControlParams params = control;
  if (!plugins.controller().empty()) params.own = plugins.Spec();
  return params;
}

std::unique_ptr<vision::PoseEstimator> Scenario::MakeEstimator(const std::string& name,
                                                               Rng rng) const {
  const StereoRig stereo = rig.MakeRig();
  if (name == NameOf(EstimatorKind::kRmGa))
    return std::make_unique<vision::RmGa>(estimator, marker, hue, stereo, rng);
  if (name == NameOf(EstimatorKind::kBlobs))
    return std::make_unique<vision::BlobEstimator>(vision::BlobParams{}, marker, hue, stereo);
  if (name == NameOf(EstimatorKind::kFiducial))
    return std::make_unique<vision::FiducialEstimator>(fiducial, stereo);
  return plugins.MakeEstimator(name, {marker, hue, stereo, rng});
}

// Where the vehicle is to stand before it docks there is nothing in its way; nearer there may be.
void Scenario::CheckApproach(const std::string& path) const {
  if (approach.on() && !(approach.closest_x_m() > procedure.servo_x_m))
    throw ConfigError(
        JoinKey(path, "approach.nearest_x_m"),
        fmt::format(
            "{} is inside the station: less closer_m each time it was not found it is {:.4g}, and "
            "must be beyond procedure.servo_x_m ({})",
            FormatNumber(approach.nearest_x_m), approach.closest_x_m(),
            FormatNumber(procedure.servo_x_m)));
  const bool predicts =
      !plugins.controller().empty() || control.controller == control::ControllerType::kLqg;
  if (procedure.blind_max_s > 0 && !predicts)
    throw ConfigError(JoinKey(path, "procedure.blind_max_s"),
                      FormatNumber(procedure.blind_max_s) + " needs a controller that predicts: " +
                          "lqg, not " + NameOf(control.controller));
}

void Scenario::CheckPlayback(const std::string& path) const {
  if (plays_back() && control.playback.file.empty())
    throw ConfigError(JoinKey(path, "playback.file"),
                      "is empty: controller = playback needs the commands");
}

void Scenario::Check(const std::string& path) const {
  plugins.Check();
  CheckApproach(path);
  CheckPlayback(path);
  vision::CheckHues(marker, hue);
  if (clock.frames_per_second % camera_period_frames != 0)
    throw ConfigError(JoinKey(path, "camera_period_frames"),
                      std::to_string(camera_period_frames) +
                          " must divide clock.frames_per_second (" +
                          std::to_string(clock.frames_per_second) + ")");
  const std::vector<light::BallLight>& balls = light.ball_lights.balls;
  const std::string lights = JoinKey(path, "faults.lights"), fish = JoinKey(path, "faults.fish");
  for (size_t i = 0; i < faults.lights.size(); ++i)
    faults.lights[i].CheckLight(config::ElementPath(lights, i), balls);
  CheckBrightness(faults.lights, light.ball_lights, lights);
  for (size_t i = 0; i < faults.distractors.fish.size(); ++i)
    CheckShine(faults.distractors.fish[i].shines_as, balls, config::ElementPath(fish, i));
  if (pose_source == PoseSource::kTruePose && faults.seen())
    throw ConfigError(JoinKey(path, "faults"),
                      "with pose_source = true_pose only thrusters can fail: nothing is seen");
}

Scenario ScenarioBefore(const ScenarioPresets& presets, const Plugins& plugins) {
  Scenario scenario;
  scenario.plugins = plugins.WithDefaults();
  const auto begin_with = [](const std::string& data, auto* object) {
    config::ReadFields(config::LoadYaml(data), object, nullptr);
  };
  scenario.estimator = vision::RmGaOptions::Of(presets.estimator);
  scenario.navigation = vehicle::NavigationParams::Of(presets.navigation);
  const std::string data = VehicleDataFile(presets.vehicle_model);
  begin_with(data, &scenario.vehicle);
  scenario.known_vehicle = scenario.vehicle;
  begin_with(config::AssetPath("rig_default.yaml"), &scenario.rig);
  begin_with(config::AssetPath("marker_default.yaml"), &scenario.marker);
  begin_with(config::AssetPath("gains.yaml"), &scenario);
  if (presets.optics == OpticsPreset::kPublished)
    begin_with(config::AssetPath("optics.yaml"), &scenario);
  return scenario;
}

Scenario LoadScenario(const std::string& name, const std::vector<std::string>& assignments,
                      const std::string& gains_file, const Plugins& plugins) {
  config::Layers layers{
      .files = {config::LoadYaml(config::FindBundled("scenarios", "scenario", name))},
      .assignments = assignments};
  const config::YamlNode file = layers.files[0];
  if (file.Find("scenario"))
    throw ConfigError(file.file + ": is a plan, no scenario; turbidock batch runs it");
  for (const char* key : kRequired)
    if (!file.Find(key)) throw ConfigError(file.file + ": " + key + ": this key is required");
  if (!gains_file.empty()) layers.files.push_back(config::LoadYaml(gains_file));

  Scenario scenario = ScenarioBefore(PresetsIn(layers, file.file), plugins);
  const config::Origins origins = config::ReadLayers(layers, &scenario);
  for (const auto& [key, model] : {std::pair{"model", &scenario.model},
                                   {"vehicle_model", &scenario.vehicle_model},
                                   {"station_model", &scenario.station_model}})
    if (const auto origin = origins.find(key); origin != origins.end())
      *model = ResolvedModel(key, *model, file.file, origin->second);
  for (const auto& [key, recorded] : {std::pair{"playback.file", &scenario.control.playback.file},
                                      {"sea.current.series", &scenario.sea.current.series}})
    if (const auto origin = origins.find(key); origin != origins.end() && !recorded->empty())
      *recorded = ResolvedFile(key, *recorded, file.file, origin->second);
  // The bundled scenes have the default marker: there is no need to look.
  const bool takes_balls =
      !IsBundledModel(scenario.model) && std::ranges::none_of(origins, [](const auto& origin) {
        return origin.first.starts_with("marker.balls");
      });
  const bool takes_tags =
      scenario.pose_estimator == EstimatorKind::kFiducial && scenario.fiducial.tags.empty();
  if (takes_balls || takes_tags) {
    const vehicle::Scene scene = vehicle::LoadScene(SceneFilesOf(scenario), scenario.rig);
    if (takes_balls) TakeBalls(scene, &scenario);
    if (takes_tags) TakeTags(scene, &scenario);
    CheckFields(scenario, "");
  }
  return scenario;
}

std::vector<std::string> GainAssignments(const std::string& gains_file, const Plugins& plugins) {
  std::vector<std::string> assignments;
  if (gains_file.empty()) return assignments;
  const config::YamlNode file = config::LoadYaml(gains_file);
  Scenario any;
  any.plugins = plugins.WithDefaults();
  config::ReadFields(file, &any, nullptr);  // what is wrong is said with its line
  const std::function<void(const config::YamlNode&)> add = [&](const config::YamlNode& node) {
    if (!node.IsMap()) return assignments.push_back(node.path + "=" + node.OneLine());
    for (const auto& [key, value] : node.Entries()) add(value);
  };
  add(file);
  return assignments;
}

Scenario ParseScenario(const std::string& text, const std::string& name, const Plugins& plugins) {
  Scenario scenario;
  scenario.plugins = plugins.WithDefaults();
  config::ReadLayers({.files = {config::ParseYaml(text, name)}}, &scenario);
  return scenario;
}

vehicle::SceneFiles SceneFilesOf(const Scenario& scenario) {
  const Scenario defaults;
  vehicle::SceneFiles files{.scene = PathOfModel(scenario.model)};
  if (!IsBundledModel(scenario.model)) {
    const fs::path folder = fs::path(files.scene).parent_path();
    for (const auto& bundled : fs::directory_iterator(config::ModelPath("")))
      if (bundled.path().extension() == ".xml" && !IsFile(folder / bundled.path().filename()))
        files.shared[bundled.path().filename()] = bundled.path();
  }
  const auto take_for = [&](const std::string& key, const std::string& part,
                            const std::string& model) {
    if (model == part) return;
    if (system::ReadWhole(files.scene).find("\"" + part + "\"") == std::string::npos)
      throw ConfigError(key, "'" + model + "' cannot be taken for " + part + ", which " +
                                 scenario.model + " does not include");
    files.parts[part] = PathOfModel(model);
    files.shared.erase(part);
  };
  take_for("vehicle_model", defaults.vehicle_model, scenario.vehicle_model);
  take_for("station_model", defaults.station_model, scenario.station_model);
  return files;
}

std::vector<ModelFile> ModelFilesOf(const Scenario& scenario) {
  std::vector<ModelFile> files;
  const std::string bundled = config::ModelPath("");
  for (const auto& [path, digest] : vehicle::ContentsOf(SceneFilesOf(scenario)))
    files.push_back({path.starts_with(bundled) ? path.substr(bundled.size()) : path, digest});
  const std::string& commands = scenario.plays_back() ? scenario.control.playback.file : "";
  for (const std::string& recorded : {commands, scenario.sea.current.series})
    if (!recorded.empty()) files.push_back({recorded, DigestOf(system::ReadWhole(recorded))});
  return files;
}

std::string ChangedModels(const Scenario& scenario) {
  if (scenario.model_files.empty()) return "";
  std::vector<std::string> names;
  for (const ModelFile& now : ModelFilesOf(scenario)) {
    const auto before = std::ranges::find(scenario.model_files, now.file, &ModelFile::file);
    if (before != scenario.model_files.end() && before->content != now.content)
      names.push_back(now.file);
  }
  return names.empty() ? ""
                       : fmt::format("{} {} changed since the scenario was written",
                                     fmt::join(names, ", "), names.size() > 1 ? "have" : "has");
}

std::string SaveScenario(const Scenario& scenario) { return config::SaveYaml(scenario); }

std::string SaveResolved(const Scenario& scenario) {
  Scenario resolved = scenario;
  resolved.model_files = ModelFilesOf(scenario);
  return SaveScenario(resolved);
}

std::vector<config::KeyDoc> ScenarioKeys(const Plugins& plugins) {
  Scenario defaults;
  defaults.plugins = plugins.WithDefaults();
  return config::internal::ListGroupKeys(config::GroupOf(&defaults));
}

}  // namespace turbidock::trial

template void turbidock::CheckFields(const turbidock::trial::Scenario&, const std::string&);
template turbidock::config::GroupRef turbidock::config::GroupOf(turbidock::trial::Scenario*);
