#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/batch/plan.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/report/json.h"
#include "experiments/studies/tuning/study.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/scenario.h"

namespace turbidock::app {
namespace {

struct ListArguments {
  trial::Plugins plugins;
  std::string what = "all", show;
  bool json = false;
};

// What a bundled file says of itself.
report::Json Described(const std::string& folder, const std::string& name) {
  if (folder == "scenarios")
    return {{"name", name}, {"description", trial::LoadScenario(name, {}).description}};
  if (folder == "studies")
    return {{"name", name}, {"description", tuning::LoadStudy(name).settings().description}};
  const batch::Plan plan = batch::LoadPlan(name);
  return {{"name", name},
          {"description", plan.settings().description},
          {"trials", plan.trials()},
          {"is_most", plan.settings().precision > 0}};
}

report::Json Bundled(const std::string& folder) {
  auto list = report::Json::array();
  for (const std::string& name : config::BundledNames(folder))
    list.push_back(Described(folder, name));
  return list;
}

void PrintBundled(const report::Json& list) {
  for (const report::Json& entry : list) {
    std::string trials;
    if (entry.contains("trials"))
      trials = fmt::format("{} {:>5} trials  ", entry.at("is_most").get<bool>() ? "up to" : "     ",
                           entry.at("trials").get<int64_t>());
    fmt::print("{:24} {}{}\n", entry.at("name").get<std::string>(), trials,
               entry.at("description").get<std::string>());
  }
}

void ListAll(bool json) {
  report::Json all;
  for (const char* folder : {"scenarios", "plans", "studies"}) {
    all[folder] = Bundled(folder);
    if (json) continue;
    fmt::print("{}{}\n", all.size() > 1 ? "\n" : "", folder);
    PrintBundled(all[folder]);
  }
  if (json) fmt::print("{}", report::JsonText(all));
}

// "[1, 0, ..." of a text that is longer than that.
std::string Short(const std::string& text, size_t most) {
  return text.size() <= most ? text : text.substr(0, most - 3) + "...";
}

// A line for each group and two for each key, none wider than 100 columns.
void PrintKeys(const std::vector<config::KeyDoc>& keys) {
  fmt::print("{:46} {:20} ALLOWED\n    MEANING\n", "KEY", "DEFAULT");
  for (const config::KeyDoc& key : keys) {
    const bool is_group = key.type == "group of keys" || key.type == "list of groups";
    if (is_group) fmt::print("\n{} ({})\n", key.key, key.type);
    const std::string name = fmt::format("{:46} {}", key.key, Short(key.value, 20));
    const std::string allowed = key.range.empty() ? key.type : key.range;
    if (!is_group)
      fmt::print("{:67} {}\n", name, Short(allowed, 99 - std::max<size_t>(67, name.size())));
    std::istringstream words(key.doc);
    std::string line = "   ";
    for (std::string word; words >> word; line += " " + word)
      if (line.size() + word.size() >= 100) {
        fmt::print("{}\n", line);
        line = "   ";
      }
    fmt::print("{}\n", line);
  }
}

void ListKeys(bool json, const trial::Plugins& plugins) {
  const std::vector<config::KeyDoc> keys = trial::ScenarioKeys(plugins);
  if (!json) return PrintKeys(keys);
  auto list = report::Json::array();
  for (const config::KeyDoc& key : keys)
    list.push_back({{"key", key.key},
                    {"type", key.type},
                    {"default", key.value},
                    {"range", key.range},
                    {"doc", key.doc}});
  fmt::print("{}", report::JsonText(list));
}

int List(const ListArguments& arguments) {
  const auto& [plugins, what, show, json] = arguments;
  if (!show.empty())
    std::fputs(trial::SaveScenario(trial::LoadScenario(show, {}, "", plugins)).c_str(), stdout);
  else if (what == "all")
    ListAll(json);
  else if (what == "keys")
    ListKeys(json, plugins);
  else if (what == "result-keys")
    std::fputs(trial::ResultKeyTable().c_str(), stdout);
  else if (json)
    fmt::print("{}", report::JsonText(Bundled(what)));
  else
    PrintBundled(Bundled(what));
  return kExitDone;
}

}  // namespace

void AddList(CommandLine& line) {
  auto [list, arguments] =
      line.Add("list", "List the bundled scenarios, plans and studies, or the keys", &List);
  arguments.plugins = line.plugins();
  const Option what =
      list.Add("what", arguments.what,
               "scenarios, plans, studies; keys: every key of a scenario with default, range and\n"
               "meaning; result-keys: every key of a result with its column in a batch's file")
          .OneOf({"all", "scenarios", "plans", "studies", "keys", "result-keys"});
  Option show = list.Add("--show SCENARIO", arguments.show,
                         "Instead: a scenario, bundled or a file, with every default spelt out");
  const Option json = list.Flag("--json", arguments.json, "As JSON; result-keys are Markdown");
  show.Excludes(what).Excludes(json);
}

}  // namespace turbidock::app
