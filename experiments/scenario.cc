#include "experiments/scenario.h"

#include <array>
#include <filesystem>

#include "experiments/data_files.h"
#include "experiments/yaml_fields.h"

namespace turbidock::experiments {
namespace {

namespace fs = std::filesystem;

// Without these a file would mean something else with every change of a default.
constexpr std::array kRequired = {"schema_version", "seed", "duration_s", "model"};

bool IsFile(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

bool IsBundledModel(const std::string& model) {
  return model.find('/') == std::string::npos && IsFile(ModelPath(model));
}

// A bundled model keeps its name. Any other is a file, beside the scenario or, from the command
// line, in the working directory; it becomes an absolute path, so that the resolved scenario runs
// anywhere.
void ResolveModel(const std::string& scenario_file, const Origins& origins, Scenario* scenario) {
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
    throw ConfigError(path + ".distance_min_m", FormatNumber(distance_min_m) +
                                                    " must not exceed distance_max_m (" +
                                                    FormatNumber(distance_max_m) + ")");
}

namespace {

// All layers over a scenario that holds nothing but the estimator's preset.
Scenario ReadLayers(const YamlNode& file, const std::vector<std::string>& assignments,
                    vision::Preset preset, Origins* origins) {
  Scenario scenario;
  scenario.estimator = vision::RmGaOptions::Of(preset);
  ReadFields(LoadYaml(ModelPath("vehicle.yaml")), &scenario.vehicle, nullptr);
  ReadFields(LoadYaml(AssetPath("rig_default.yaml")), &scenario.rig, nullptr);
  ReadFields(LoadYaml(AssetPath("marker_default.yaml")), &scenario.marker, nullptr);
  ReadFields(LoadYaml(AssetPath("gains.yaml")), &scenario, nullptr);
  ReadFields(file, &scenario, origins);
  for (const std::string& assignment : assignments) ApplySet(assignment, &scenario, origins);
  return scenario;
}

}  // namespace

Scenario LoadScenario(const std::string& name, const std::vector<std::string>& assignments) {
  const YamlNode file = LoadYaml(FindScenario(name));
  for (const char* key : kRequired)
    if (!file.Find(key)) throw ConfigError(file.file + ": " + key + ": this key is required");
  Origins origins;
  Scenario scenario = ReadLayers(file, assignments, vision::Preset::kDefault, &origins);
  // A preset is what the estimator's other keys begin with, wherever it is named.
  if (scenario.estimator.preset != vision::Preset::kDefault)
    scenario = ReadLayers(file, assignments, scenario.estimator.preset, &origins);
  CheckSettings(scenario, origins);
  ResolveModel(file.file, origins, &scenario);
  return scenario;
}

Scenario ParseScenario(const std::string& text, const std::string& name) {
  Scenario scenario;
  Origins origins;
  ReadFields(ParseYaml(text, name), &scenario, &origins);
  CheckSettings(scenario, origins);
  return scenario;
}

std::string SceneFile(const Scenario& scenario) {
  return IsBundledModel(scenario.model) ? ModelPath(scenario.model) : scenario.model;
}

}  // namespace turbidock::experiments
