#include "experiments/trial/scenario.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/recorded.h"
#include "experiments/trial/scene_marker.h"
#include "sim/base/digest.h"
#include "sim/base/random.h"
#include "sim/vehicle/model_contents.h"

namespace turbidock::trial {
namespace {

namespace fs = std::filesystem;

// Without these a file would mean something else with every change of a default.
constexpr std::array kRequired = {"schema_version", "trial.seed", "trial.duration_s",
                                  "trial.scene"};

bool IsFile(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

std::string PathOfModel(const std::string& model) {
  return config::IsBundledModel(model) ? config::ModelPath(model) : model;
}

// The vehicle's data, beside its MJCF.
fs::path DataBeside(const std::string& vehicle_model) {
  return fs::path(PathOfModel(vehicle_model)).replace_extension(".yaml");
}

std::string VehicleDataFile(const std::string& vehicle_model) {
  const fs::path data = DataBeside(vehicle_model);
  if (vehicle_model.ends_with(".urdf") || vehicle_model.ends_with(".xacro"))
    throw ConfigError("vehicle.model", "'" + vehicle_model +
                                           "' is a URDF; `turbidock check-vehicle FILE --mjcf "
                                           "NAME.xml` makes a vehicle of it");
  if (!IsFile(data))
    throw ConfigError("vehicle.model", "'" + vehicle_model +
                                           "' has no data beside it: " + data.string() +
                                           "; `turbidock check-vehicle` says what it is");
  return data.string();
}

// A scene that includes a vehicle.xml of its own would fly with the bundled one's data.
void RequireNoOtherVehicle(const Scenario& scenario) {
  const InputFile standard = Scenario().vehicle_model;
  if (config::IsBundledModel(scenario.model) || scenario.vehicle_model.path != standard.path)
    return;
  const fs::path own = fs::path(scenario.model.path).parent_path() / standard.path,
                 data = fs::path(own).replace_extension(".yaml");
  if (IsFile(own) && IsFile(data) &&
      system::ReadWhole(data) != system::ReadWhole(DataBeside(standard)))
    throw ConfigError("vehicle.model",
                      scenario.model.path + " has a " + standard.path +
                          " beside it with data of its own: say vehicle.model: ./" + standard.path);
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
      CheckFields(light::LightsAt(balls, same, faults[i].begin_s).balls, "lights.marker");
    } catch (const ConfigError& error) {
      throw ConfigError(
          JoinKey(config::ElementPath(path, i), "factor"),
          fmt::format("makes '{}' too bright, with all that acts on it from {} s on: {}",
                      faults[i].light, FormatNumber(faults[i].begin_s), error.what()));
    }
  }
}

// Of a document the values of the keys that another one has.
void AddCommon(const config::YamlNode& values, const config::YamlNode& keys,
               std::vector<config::Assignment>* common) {
  for (const auto& [key, inner] : keys.Entries()) {
    const config::YamlNode value = *values.Find(key);
    if (inner.IsMap())
      AddCommon(value, inner, common);
    else
      common->push_back({value.path, value});
  }
}

vision::MarkerParams DefaultMarker() {
  vision::MarkerParams marker;
  config::ReadFields(config::LoadYaml(config::AssetPath("marker_default.yaml")), &marker, nullptr);
  return marker;
}

// What a scenario's file is read over.
Scenario Beginning(const Plugins& plugins) {
  Scenario scenario;
  scenario.plugins = plugins.WithDefaults();
  const auto begin_with = [](const std::string& data, auto* object) {
    config::ReadFields(config::LoadYaml(data), object, nullptr);
  };
  scenario.Given("vehicle.model");
  begin_with(config::AssetPath("rig_default.yaml"), &scenario.rig);
  scenario.marker = DefaultMarker();
  begin_with(config::AssetPath("gains.yaml"), &scenario);
  scenario.Given("cameras.optics");
  return scenario;
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

void Scenario::Given(const std::string& key) {
  if (key == "vehicle.model") {
    vehicle = {};
    config::ReadFields(config::LoadYaml(VehicleDataFile(vehicle_model)), &vehicle, nullptr);
    known_vehicle = vehicle;
  } else if (key == "cameras.optics") {
    const config::YamlNode published = config::LoadYaml(config::AssetPath("optics.yaml"));
    std::vector<config::Assignment> values = {{"", published}};
    if (optics == OpticsPreset::kModernDigital) {
      values.clear();
      const Scenario defaults;
      AddCommon(config::ParseYaml(SaveScenario(defaults), "defaults"), published, &values);
    }
    config::SetLayers(values, this);
  } else if (key == "procedure.approach.mode") {
    // A pilot navigates by eye, and nobody else does.
    const bool by_hand = approach.mode == control::ApproachMode::kPilot;
    if (by_hand != (navigation.preset == vehicle::NavigationPreset::kPilot))
      navigation = vehicle::NavigationParams::Of(by_hand ? vehicle::NavigationPreset::kPilot
                                                         : vehicle::NavigationParams().preset);
  } else if (key == "marker.from_scene") {
    if (!marker_from_scene) TakeDefaultBalls();
  } else if (key.starts_with("marker.balls") || key.starts_with("marker.box_m")) {
    marker_from_scene = false;
  }
}

void Scenario::TakeDefaultBalls() {
  const vision::MarkerParams known = DefaultMarker();
  marker.balls = known.balls;
  marker.box_m = known.box_m;
}

std::unique_ptr<vision::PoseEstimator> Scenario::MakeEstimator(const std::string& name,
                                                               Rng rng) const {
  return plugins.MakeEstimator(name, {marker, hue, rig.MakeRig(), rng, image_times()});
}

// Where the vehicle is to stand before it docks there is nothing in its way; nearer there may be.
void Scenario::CheckApproach(const std::string& path) const {
  const bool by_eye = navigation.preset == vehicle::NavigationPreset::kPilot;
  if (by_eye != (approach.mode == control::ApproachMode::kPilot) && approach.on())
    throw ConfigError(
        JoinKey(path, "navigation.preset"),
        fmt::format("{} and procedure.approach.mode = {} exclude each other: a pilot navigates "
                    "by eye, and nobody else does",
                    NameOf(navigation.preset), NameOf(approach.mode)));
  if (approach.on() && !(approach.closest_x_m() > procedure.servo_x_m))
    throw ConfigError(
        JoinKey(path, "procedure.approach.nearest_x_m"),
        fmt::format(
            "{} is inside the station: less closer_m each time it was not found it is {:.4g}, and "
            "must be beyond procedure.servo_x_m ({})",
            FormatNumber(approach.nearest_x_m), approach.closest_x_m(),
            FormatNumber(procedure.servo_x_m)));
  if (!(procedure.blind_max_s > 0) || plugins.Spec().predicts) return;
  std::vector<std::string> able = plugins.controllers();
  std::erase_if(able, [this](const auto& name) { return !plugins.Spec(name).predicts; });
  throw ConfigError(
      JoinKey(path, "procedure.blind_max_s"),
      fmt::format("{} needs a controller that predicts: {}, not {}",
                  FormatNumber(procedure.blind_max_s), fmt::join(able, ", "), controller_name()));
}

void Scenario::Check(const std::string& path) const {
  plugins.Check();
  CheckApproach(path);
  vision::CheckHues(marker, hue);
  if (clock.frames_per_second % camera_period_frames != 0)
    throw ConfigError(JoinKey(path, "cameras.period_frames"),
                      std::to_string(camera_period_frames) +
                          " must divide trial.clock.frames_per_second (" +
                          std::to_string(clock.frames_per_second) + ")");
  const std::vector<light::BallLight>& balls = light.ball_lights.balls;
  const std::string lights = JoinKey(path, "faults.lights"), fish = JoinKey(path, "faults.fish");
  for (size_t i = 0; i < faults.lights.size(); ++i)
    faults.lights[i].CheckLight(config::ElementPath(lights, i), balls);
  CheckBrightness(faults.lights, light.ball_lights, lights);
  for (size_t i = 0; i < faults.distractors.fish.size(); ++i)
    CheckShine(faults.distractors.fish[i].shines_as, balls, config::ElementPath(fish, i));
  if (pose_source == PoseSource::kTruePose && faults.seen())
    throw ConfigError(
        JoinKey(path, "faults"),
        "with estimator.pose_source = true_pose only thrusters can fail: nothing is seen");
}

Scenario PresetsOf(const Scenario& scenario) {
  Scenario before = Beginning(scenario.plugins);
  std::vector<std::string> presets;
  for (const std::string& key : config::PresetsOf(scenario))
    presets.push_back(key + "=" + config::ValueOf(scenario, key));
  config::SetLayers(config::ParseAssignments(presets), &before);
  return before;
}

namespace {

// A controller or an estimator that only another program has is said alone, without its keys.
void RequirePlugins(const config::YamlNode& file, const Plugins& plugins) {
  const auto require = [&file](const std::string& group, const std::vector<std::string>& known) {
    const std::string key = group + ".use";
    const auto chosen = file.FindPath(key);
    const std::string name = chosen ? chosen->Text().value_or("") : "";
    if (!name.empty() && file.FindPath(group + "." + name) && std::ranges::count(known, name) == 0)
      throw ConfigError(fmt::format(
          "{}{} = '{}', must be one of {}; the program that wrote it (turbidock-ros for nodes of "
          "ROS, Python, or one of your own) has it",
          chosen->Where(), key, name, fmt::join(known, ", ")));
  };
  require("control", plugins.controllers());
  require("estimator", plugins.estimators());
}

}  // namespace

Scenario LoadScenario(const std::string& name, const std::vector<config::Assignment>& given,
                      const Plugins& plugins) {
  const config::YamlNode file =
      config::LoadYaml(config::FindBundled("scenarios", "scenario", name));
  for (const char* key : {"scenario", "grid", "cases", "ranges"})
    if (file.Find(key))
      throw ConfigError(file.file + ": is a plan, no scenario; turbidock batch runs it");
  RequirePlugins(file, plugins);
  for (const char* key : kRequired)
    if (!file.FindPath(key)) throw ConfigError(file.file + ": " + key + ": this key is required");
  std::vector<config::Assignment> layers = {{"", file}};
  layers.insert(layers.end(), given.begin(), given.end());
  Scenario scenario = Beginning(plugins);
  Resolve(layers, &scenario);
  return scenario;
}

bool Gives(const std::string& assignment, const std::string& key) {
  return std::ranges::any_of(config::LeavesOf({config::ParseAssignment(assignment)}),
                             [&](const auto& leaf) { return leaf.key == key; });
}

std::vector<config::Assignment> GivenBy(const std::string& gains_file,
                                        const std::vector<std::string>& assignments) {
  std::vector<config::Assignment> given;
  if (!gains_file.empty()) given.push_back({"", config::LoadYaml(gains_file)});
  for (const std::string& text : assignments) given.push_back(config::ParseAssignment(text));
  return given;
}

Scenario LoadScenario(const std::string& name, const std::vector<std::string>& assignments,
                      const std::string& gains_file, const Plugins& plugins) {
  return LoadScenario(name, GivenBy(gains_file, assignments), plugins);
}

Scenario ParseScenario(const std::string& text, const std::string& name, const Plugins& plugins) {
  Scenario scenario;
  scenario.plugins = plugins.WithDefaults();
  const config::YamlNode file = config::ParseYaml(text, name);
  RequirePlugins(file, plugins);
  config::ReadResolved(file, &scenario);
  return scenario;
}

vehicle::SceneFiles SceneFilesOf(const Scenario& scenario) {
  const Scenario defaults;
  vehicle::SceneFiles files{.scene = PathOfModel(scenario.model)};
  if (!config::IsBundledModel(scenario.model)) {
    const fs::path folder = fs::path(files.scene).parent_path();
    for (const auto& bundled : fs::directory_iterator(config::ModelPath("")))
      if (bundled.path().extension() == ".xml" && !IsFile(folder / bundled.path().filename()))
        files.shared[bundled.path().filename()] = bundled.path();
  }
  RequireNoOtherVehicle(scenario);
  const auto take_for = [&](const std::string& key, const std::string& part,
                            const std::string& model) {
    if (model == part) return;
    if (system::ReadWhole(files.scene).find("\"" + part + "\"") == std::string::npos)
      throw ConfigError(key, "'" + model + "' cannot be taken for " + part + ", which " +
                                 scenario.model.path + " does not include");
    files.parts[part] = PathOfModel(model);
    files.shared.erase(part);
  };
  take_for("vehicle.model", defaults.vehicle_model, scenario.vehicle_model);
  take_for("station.model", defaults.station_model, scenario.station_model);
  return files;
}

std::vector<ModelFile> ModelFilesOf(const Scenario& scenario) {
  std::vector<ModelFile> files;
  const std::string bundled = config::ModelPath("");
  std::map<std::string, std::string> contents = vehicle::ContentsOf(SceneFilesOf(scenario));
  for (const std::string& named : config::FilesNamedIn(scenario))
    // a bundled one that is not there is not read
    if (!contents.contains(named) && !config::IsBundledModel(named))
      contents[named] = DigestOf(system::ReadWhole(named));
  // A resolved scenario has its values, and may be where it is not.
  if (const fs::path data = DataBeside(scenario.vehicle_model); IsFile(data))
    contents[data] = DigestOf(system::ReadWhole(data));
  files.reserve(contents.size());
  for (const auto& [path, digest] : contents)
    files.push_back({path.starts_with(bundled) ? path.substr(bundled.size()) : path, digest});
  return files;
}

std::string ChangedModels(const Scenario& scenario, const std::vector<ModelFile>& now) {
  std::vector<std::string> names;
  for (const ModelFile& file : now) {
    const auto before = std::ranges::find(scenario.model_files, file.file, &ModelFile::file);
    if (before != scenario.model_files.end() && before->content != file.content)
      names.push_back(file.file);
  }
  return names.empty() ? ""
                       : fmt::format("{} {} changed since the scenario was written",
                                     fmt::join(names, ", "), names.size() > 1 ? "have" : "has");
}

std::string SaveScenario(const Scenario& scenario) { return config::SaveYaml(scenario); }

std::string SaveResolved(Scenario scenario, const std::vector<ModelFile>& model_files) {
  scenario.model_files = model_files;
  return "# All that decided a trial. A preset (vehicle.model, cameras.optics, ...) has done its "
         "work: "
         "what it stands\n"
         "# for follows here. Change it by --set.\n" +
         SaveScenario(scenario);
}

std::vector<config::KeyDoc> ScenarioKeys(const Plugins& plugins) {
  Scenario defaults = Beginning(plugins);
  std::vector<config::KeyDoc> docs = config::internal::ListGroupKeys(config::GroupOf(&defaults));
  for (config::KeyDoc& doc : docs) doc.required = std::ranges::count(kRequired, doc.key) > 0;
  return docs;
}

}  // namespace turbidock::trial

template void turbidock::CheckFields(const turbidock::trial::Scenario&, const std::string&);
template turbidock::config::GroupRef turbidock::config::GroupOf(turbidock::trial::Scenario*);
