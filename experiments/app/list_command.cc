#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include "experiments/batch/plan.h"
#include "experiments/command/command_line.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/studies/gate/gate_plan.h"
#include "experiments/studies/tuning/study.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/scene_marker.h"

namespace turbidock::app {
namespace {

struct ListArguments {
  trial::Plugins plugins;
  std::string what = "all", show, tags;
};

// What a bundled file says of itself.
std::string Described(const std::string& folder, const std::string& name) {
  if (folder == "scenarios") return trial::LoadScenario(name, {}).description;
  if (folder == "studies") return tuning::LoadStudy(name).plan().title();
  const batch::Plan plan = folder == "gates" ? gate::LoadGate(name).plan : batch::LoadPlan(name);
  return fmt::format("{} {:>5} trials  {}", plan.decides() ? "up to" : "     ", plan.most(),
                     plan.settings().description);
}

void PrintBundled(const std::string& folder) {
  for (const std::string& name : config::BundledNames(folder))
    fmt::print("{:24} {}\n", name, Described(folder, name));
}

void PrintAll() {
  for (const char* folder : {"scenarios", "plans", "gates", "studies"}) {
    fmt::print("{}{}\n", std::string(folder) == "scenarios" ? "" : "\n", folder);
    PrintBundled(folder);
  }
}

// A text's words in lines of 100 columns, set in.
void PrintWords(const std::string& text) {
  std::istringstream words(text);
  std::string line = "   ";
  for (std::string word; words >> word; line += " " + word)
    if (line.size() + word.size() >= 100) {
      fmt::print("{}\n", line);
      line = "   ";
    }
  fmt::print("{}\n", line);
}

std::string AllowedText(const config::KeyDoc& key) {
  return key.range.empty() ? key.type : key.range;
}

std::string DefaultText(const config::KeyDoc& key) {
  return key.required ? "(required)" : key.value;
}

// A key a line, for `grep`.
void PrintLines(const std::vector<config::KeyDoc>& keys) {
  for (const config::KeyDoc& key : keys)
    fmt::print("{:46} {:20} {:20} {}\n", key.key, DefaultText(key), AllowedText(key), key.doc);
}

// For a terminal: a line for each group; for each key one with its value and what is allowed, the
// latter on its own where both do not fit 100 columns, and its meaning. Values are whole.
void PrintKeys(const std::vector<config::KeyDoc>& keys) {
  if (isatty(STDOUT_FILENO) == 0) return PrintLines(keys);
  fmt::print("{:46} {:20} ALLOWED\n    MEANING\n", "KEY", "DEFAULT");
  for (const config::KeyDoc& key : keys) {
    if (key.type == "group of keys" || key.type == "list of groups") {
      fmt::print("\n{} ({})\n", key.key, key.type);
    } else {
      const std::string allowed = AllowedText(key);
      const std::string value = fmt::format("{:46} {:20}", key.key, DefaultText(key));
      const bool fits = value.size() + 1 + allowed.size() <= 100;
      fmt::print("{}{}\n", value, fits ? " " + allowed : "");
      if (!fits) PrintWords(allowed);
    }
    PrintWords(key.doc);
  }
}

// A bundled plan, gate or study as it is written, a beginning for one's own; else a scenario with
// all its values. No two bundled files have one name.
void PrintNamed(const std::string& name, const trial::Plugins& plugins) {
  for (const char* folder : {"plans", "gates", "studies"})
    if (std::ranges::count(config::BundledNames(folder), name) > 0) {
      const std::string file = config::FindBundled(folder, "file", name);
      std::fputs(system::ReadWhole(file).c_str(), stdout);
      return;
    }
  std::fputs(trial::SaveResolved(trial::LoadScenario(name, {}, "", plugins), {}).c_str(), stdout);
}

void PrintTags(const std::string& file) {
  const auto fiducial = config::LoadLayers<vision::FiducialParams>({file}, {});
  if (fiducial.tags.empty()) throw ConfigError(file + ": tags: must name at least one tag");
  std::fputs(trial::TagsMjcf(fiducial).c_str(), stdout);
}

int List(const ListArguments& arguments) {
  const auto& [plugins, what, show, tags] = arguments;
  if (!show.empty())
    PrintNamed(show, plugins);
  else if (!tags.empty())
    PrintTags(tags);
  else if (what == "all")
    PrintAll();
  else if (what == "keys")
    PrintKeys(trial::ScenarioKeys(plugins));
  else if (what == "plan-keys")
    PrintKeys(batch::PlanKeys());
  else if (what == "gate-keys")
    PrintKeys(gate::GateKeys());
  else if (what == "study-keys")
    PrintKeys(tuning::StudyKeys());
  else if (what == "result-keys")
    std::fputs(trial::ResultKeyTable().c_str(), stdout);
  else
    PrintBundled(what);
  return command::kExitDone;
}

}  // namespace

void AddList(command::CommandLine& line) {
  auto [list, arguments] =
      line.Add("list", "List the bundled scenarios, plans, gates and studies, or the keys", &List);
  arguments.plugins = line.plugins();
  const command::Option what =
      list.Add("what", arguments.what,
               "scenarios, plans, gates, studies; keys: every key of a scenario with default, "
               "range\n"
               "and meaning; plan-keys: of a plan; gate-keys, study-keys: of its groups `gate` and "
               "`tuning`;\n"
               "result-keys: every key of a result with its column in a batch's file")
          .OneOf({"all", "scenarios", "plans", "gates", "studies", "keys", "plan-keys", "gate-keys",
                  "study-keys", "result-keys"});
  list.Add("--show NAME", arguments.show,
           "Instead: a scenario, bundled or a file, with every default spelt out; a bundled plan, "
           "gate or\nstudy as it is written")
      .Excludes(what);
  list.Add("--tags FILE", arguments.tags,
           "Instead: MJCF that draws fiducial tags; FILE has the keys of estimator.fiducial: "
           "family, tags")
      .Excludes(what);
}

}  // namespace turbidock::app
