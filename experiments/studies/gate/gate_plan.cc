#include "experiments/studies/gate/gate_plan.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "experiments/batch/plan_keys.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "sim/base/check.h"
#include "sim/base/digest.h"
#include "sim/base/random.h"

namespace turbidock::gate {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSetKey = "set";

GateCondition ReadCondition(const config::YamlNode& node, const GatePlan& plan,
                            const trial::Plugins& plugins,
                            const std::vector<config::Assignment>& given_to_all,
                            config::Origins* origins) {
  if (!node.IsMap()) node.Fail("must be a group of keys");
  GateCondition condition;
  static_cast<JudgeOptions&>(condition) = plan;
  config::ReadFields(node, &condition, origins, {kSetKey});
  if (condition.name.empty()) node.Fail("a condition needs a name");
  if (condition.scenario.empty()) node.Fail("a condition needs a scenario");
  std::vector<config::Assignment> given;
  std::vector<std::string> settings;
  if (const auto set = node.Find(kSetKey)) {
    batch::VariedKeys keys;
    for (const auto& [key, value] : set->Entries()) {
      keys.RequireNew(key, value);
      keys.Add(key, value);
      given.push_back({key, value});
      condition.keys.push_back(key);
      settings.push_back(key + "=" + value.OneLine());
    }
    condition.settings = fmt::format("{}", fmt::join(settings, " "));
  }
  const auto require_no_seed = [](const config::Assignment& each) {
    if (each.key == "seed")
      each.value.Fail("the gate gives each trial its seed; set the gate's own `seed`");
  };
  std::ranges::for_each(given, require_no_seed);
  std::ranges::for_each(given_to_all, require_no_seed);

  std::error_code ignored;
  const fs::path beside = fs::path(node.file).parent_path() / condition.scenario;
  try {
    condition.scenario_file =
        fs::is_regular_file(beside, ignored)
            ? beside.string()
            : config::FindBundled("scenarios", "scenario", condition.scenario);
    Digest digest;
    digest.Add(config::LoadYaml(condition.scenario_file).OneLine());
    for (const std::string& setting : settings) digest.Add(setting);
    condition.resolved = trial::LoadScenario(condition.scenario_file, given, plugins);
    // What the program itself brings along may change: that is what the gate is for.
    for (const trial::ModelFile& file : trial::ModelFilesOf(condition.resolved))
      if (fs::path(file.file).is_absolute()) digest.Add(file.content);
    condition.digest = digest.Hex();
    if (!given_to_all.empty()) trial::Resolve(given_to_all, &condition.resolved);
    condition.resolved.model_files = trial::ModelFilesOf(condition.resolved);
  } catch (const ConfigError& error) {
    if (std::string(error.what()).starts_with(node.file + ":")) throw;
    node.Fail(error.what());
  }
  return condition;
}

}  // namespace

void GatePlan::Check(const std::string&) const {
  if (conditions.empty()) throw ConfigError("conditions", "a gate needs a condition");
  std::set<std::string> names;
  for (const GateCondition& condition : conditions)
    if (!names.insert(condition.name).second)
      throw ConfigError("conditions", "two conditions are named '" + condition.name + "'");
}

JudgeOptions GatePlan::OptionsFor(const GateCondition& condition) const {
  int tests = alpha_covers == AlphaCovers::kCondition ? condition.margins.tests() : 1;
  if (alpha_covers == AlphaCovers::kGate) {
    tests = 0;
    for (const GateCondition& each : conditions) tests += each.margins.tests();
  }
  JudgeOptions options = condition;
  options.alpha /= tests;
  return options;
}

int64_t GatePlan::SeedOf(int trial) const {
  return SeedTree(static_cast<uint64_t>(seed)).TrialSeed(trial);
}

trial::Scenario ScenarioOf(const GateCondition& condition, int64_t trial_seed) {
  trial::Scenario scenario = condition.resolved;
  trial::Resolve({config::ParseAssignment(fmt::format("seed={}", trial_seed))}, &scenario);
  return scenario;
}

GatePlan LoadGatePlan(const std::string& file, const trial::Plugins& plugins,
                      const std::vector<config::Assignment>& given) {
  GatePlan plan;
  plan.assignments = config::TextsOf(given);
  config::Origins origins;
  const config::YamlNode node = config::LoadYaml(file);
  config::ReadFields(node, &plan, &origins, {"conditions"});
  for (const char* key : {"schema_version", "baseline", "conditions"})
    if (!node.Find(key)) throw ConfigError(file + ": " + key + ": this key is required");
  const config::YamlNode list = *node.Find("conditions");
  if (!list.IsList()) list.Fail("must be a list of groups");
  for (const config::YamlNode& element : list.Elements())
    plan.conditions.push_back(ReadCondition(element, plan, plugins, given, &origins));
  config::CheckSettings(plan, origins);
  plan.baseline = (fs::path(file).parent_path() / plan.baseline).lexically_normal().string();
  return plan;
}

}  // namespace turbidock::gate
