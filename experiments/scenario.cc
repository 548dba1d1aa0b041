#include "experiments/scenario.h"

#include <array>
#include <filesystem>

#include "experiments/data_files.h"
#include "experiments/yaml_fields.h"

namespace turbidock::experiments {
namespace {

// Without these a file would mean something else with every change of a default.
constexpr std::array kRequired = {"schema_version", "duration_s", "model"};

}  // namespace

void StartParams::Check(const std::string& path) const {
  if (distance_min_m > distance_max_m)
    throw ConfigError(path + ".distance_min_m", FormatNumber(distance_min_m) +
                                                    " must not exceed distance_max_m (" +
                                                    FormatNumber(distance_max_m) + ")");
}

Scenario LoadScenario(const std::string& name, const std::vector<std::string>& assignments) {
  Scenario scenario;
  Origins origins;
  ReadFields(LoadYaml(ModelPath("vehicle.yaml")), &scenario.vehicle, nullptr);
  ReadFields(LoadYaml(AssetPath("gains.yaml")), &scenario, nullptr);
  const YamlNode file = LoadYaml(FindScenario(name));
  for (const char* key : kRequired)
    if (!file.Find(key)) throw ConfigError(file.file + ": " + key + ": this key is required");
  ReadFields(file, &scenario, &origins);
  for (const std::string& assignment : assignments) ApplySet(assignment, &scenario, &origins);
  CheckSettings(scenario, origins);
  return scenario;
}

std::string SceneFile(const Scenario& scenario) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(scenario.model, ignored)) return scenario.model;
  return ModelPath(scenario.model);
}

}  // namespace turbidock::experiments
