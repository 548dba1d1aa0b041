#include <fmt/format.h>

#include <cstdio>

#include "experiments/app/commands.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/report/json.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/scenario.h"

namespace turbidock::app {
namespace {

struct ScenariosArguments {
  trial::Plugins plugins;
  bool json = false, keys = false, result_keys = false;
  std::string show;
};

int ListScenarios(bool json) {
  auto list = report::Json::array();
  for (const std::string& name : config::BundledNames("scenarios")) {
    const trial::Scenario scenario = trial::LoadScenario(name, {});
    if (json)
      list.push_back({{"name", name}, {"description", scenario.description}});
    else
      fmt::print("{:20} {}\n", name, scenario.description);
  }
  if (json) fmt::print("{}", report::JsonText(list));
  return kExitDone;
}

int PrintKeys(bool json, const trial::Plugins& plugins) {
  auto list = report::Json::array();
  for (const config::KeyDoc& key : trial::ScenarioKeys(plugins)) {
    if (json)
      list.push_back({{"key", key.key},
                      {"type", key.type},
                      {"default", key.value},
                      {"range", key.range},
                      {"doc", key.doc}});
    else
      fmt::print("{:45} {:22} {:24} {}\n", key.key, key.value, key.range, key.doc);
  }
  if (json) fmt::print("{}", report::JsonText(list));
  return kExitDone;
}

int Scenarios(const ScenariosArguments& arguments) {
  if (arguments.result_keys) {
    std::fputs(trial::ResultKeyTable().c_str(), stdout);
    return kExitDone;
  }
  if (!arguments.show.empty()) {
    std::fputs(
        trial::SaveScenario(trial::LoadScenario(arguments.show, {}, "", arguments.plugins)).c_str(),
        stdout);
    return kExitDone;
  }
  return arguments.keys ? PrintKeys(arguments.json, arguments.plugins)
                        : ListScenarios(arguments.json);
}

}  // namespace

void AddScenarios(CommandLine& line) {
  auto [scenarios, arguments] = line.Add("scenarios", "List the bundled scenarios", &Scenarios);
  arguments.plugins = line.plugins();
  const Option keys = scenarios.Flag(
      "--keys", arguments.keys, "List every key of a scenario with default, range and meaning");
  Option result_keys =
      scenarios.Flag("--result-keys", arguments.result_keys,
                     "List every key of a result with its column in a batch's file and meaning");
  Option show = scenarios.Add("--show", arguments.show,
                              "Print a scenario, bundled or a file, with every default spelt out");
  const Option json = scenarios.Flag("--json", arguments.json, "As JSON, names or --keys");
  result_keys.Excludes(keys).Excludes(show).Excludes(json);
  show.Excludes(keys).Excludes(json);
}

}  // namespace turbidock::app
