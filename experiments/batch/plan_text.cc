// A plan as texts: resolved, to be kept with its results, and a cell's for people.

#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <span>

#include "experiments/batch/plan.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/statistics/intervals.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"

namespace turbidock::batch {

namespace fs = std::filesystem;

std::string ModelFilesText(const std::map<std::string, trial::ModelFile>& files) {
  std::string text = "model_files:\n";
  for (const auto& [name, file] : files)
    text += fmt::format("  {}: content {}\n", YamlText(file.file), file.content);
  return text;
}

std::string YamlText(const std::string& text) { return config::TextNode(text, {}).OneLine(); }

std::string Plan::code() const { return fmt::format("{}", fmt::join(code_, "")); }

std::string Plan::resolved() const { return config::SaveYaml(settings_) + trials_; }

CellText Plan::TextOf(int64_t cell) const {
  const std::vector<Parameter> parameters = FirstOf(cell).parameters;
  CellText text;
  const size_t named = grid_.size() - (envelope_ ? envelope_->ranges.size() : 0);
  for (size_t i = 0; i < named; ++i)
    text.name += (i > 0 ? " " : "") +
                 (grid_[i].key == kCaseKey ? parameters[i].value : parameters[i].Assignment());
  if (text.name.empty()) text.name = "all";
  const std::string& scenario = ScenarioNameOf(parameters);
  text.scenario_file = config::FindBundled("scenarios", "scenario", found_.at(scenario));
  text.given = scenario;
  const auto add = [&text](const std::vector<config::Assignment>& given) {
    for (const config::Assignment& each : given)
      text.given += " " + each.key + "=" + each.value.Canonical();
  };
  std::vector<config::Assignment> all = config::LeavesOf(set_);
  for (const config::Assignment& own : config::LeavesOf(
           AssignmentsOf({parameters.begin(), parameters.begin() + static_cast<int>(named)}))) {
    std::erase_if(all, [&own](const auto& other) { return other.key == own.key; });
    all.push_back(own);
  }
  add(all);
  for (const GridAxis& range : std::span(grid_).subspan(named))
    text.given += fmt::format(" {}={} to {} in {}", range.key, range.values.front(),
                              range.values.back(), range.values.size());
  for (const Case& stratum : strata_) {
    text.given += " " + stratum.name + ":";
    add(config::LeavesOf(stratum.values));
  }
  for (size_t i = 0; i < random_.size(); ++i)
    text.given += " " + random_[i].key + "=" + distributions_[i].Canonical();
  return text;
}

// What is beside it, or in a folder beside its own.
std::string Plan::NameFromFolder(const std::string& file) const {
  const fs::path path = file;
  if (!path.is_absolute()) return file;
  const std::string name = path.lexically_relative(folder_);
  if (name.starts_with("../../")) return file;
  return name.starts_with("../") ? name : "./" + name;
}

std::string Plan::FileOf(const std::string& name) const {
  return name.starts_with("./") || name.starts_with("../")
             ? (fs::path(folder_) / name).lexically_normal().string()
             : name;
}

std::string Plan::Resolve(const config::YamlNode& plan) const {
  std::string text;
  const bool names_files = std::ranges::any_of(
      trial::ScenarioKeys(plugins_),
      [varied = Varied()](const auto& doc) { return doc.type == "file" && varied.Find(doc.key); });
  std::map<std::string, trial::ModelFile> files;  // by name
  for (const auto& [names, of] : files_)
    for (const trial::ModelFile& file : of)
      files[NameFromFolder(file.file)] = {NameFromFolder(file.file), file.content};
  const bool has_own =
      std::ranges::any_of(files, [](const auto& file) { return file.first.starts_with('.'); });
  if (names_files || has_own) text += fmt::format("{}: {}\n", kFolderKey, YamlText(folder_));
  if (!cases_.empty()) text += "cases:\n";
  for (const Case& one : cases_) {
    text += fmt::format("  {}: {{", YamlText(one.name));
    if (!one.scenario.empty()) text += fmt::format("scenario: {}, ", YamlText(one.scenario));
    for (const config::Assignment& given : one.values)
      text += fmt::format("{}: {}, ", YamlText(given.key), given.value.OneLine());
    text += "}\n";
  }
  for (const std::string part : {"strata", "grid", "ranges", "find", "random"})
    if (const auto given = plan.Find(part)) {
      text += part + (given->Entries().empty() ? ": {}\n" : ":\n");
      for (const auto& [name, value] : given->Entries())
        text += fmt::format("  {}: {}\n", YamlText(name), value.OneLine());
    }
  text += "resolved_scenarios:\n";
  for (auto [name, scenario] : scenarios_) {
    config::ForEachFileIn(&scenario,
                          [this](InputFile* file) { file->path = NameFromFolder(file->path); });
    text +=
        "  " + YamlText(name) + ": |\n" + system::Indented(trial::SaveScenario(scenario), "    ");
  }
  return text + ModelFilesText(files);
}

VariedKeys Plan::Varied() const {
  VariedKeys varied;
  for (const auto* cases : {&cases_, &strata_})
    for (const Case& one : *cases)
      for (const config::Assignment& given : one.values) varied.Add(given.key, given.value);
  for (const GridAxis& axis : grid_)
    for (const config::YamlNode& value : axis.nodes) varied.Add(axis.key, value);
  for (size_t i = 0; i < random_.size(); ++i) {
    varied.Add(random_[i].key, config::TextNode("", distributions_[i]));
    if (const auto choices = distributions_[i].Find("choice"))
      for (const config::YamlNode& value : choices->Elements()) varied.Add(random_[i].key, value);
  }
  return varied;
}

std::vector<config::KeyDoc> PlanKeys() {
  std::vector<config::KeyDoc> docs = config::ListKeys<PlanSettings>();
  for (config::KeyDoc& doc : docs) doc.required = doc.key == "schema_version";
  for (const auto& [key, what] : PlanGroups())
    docs.push_back({.key = key,
                    .type = key == kFolderKey ? "text" : "group of keys",
                    .value = "",
                    .range = "",
                    .doc = what});
  return docs;
}

int64_t SamplesOf(int64_t seeds, double precision) {
  if (!(precision > 0)) return seeds;
  constexpr double kFinest = 0.001;  // a million trials
  const int64_t needed = statistics::TrialsForHalfWidth(std::clamp(precision, kFinest, 0.5));
  return (std::max(needed, seeds) + seeds - 1) / seeds * seeds;
}

Plan LoadPlan(const std::string& name, const PlanOverrides& overrides) {
  const std::string file = config::FindBundled("plans", "plan", name);
  return Plan(system::ReadWhole(file), file, overrides);
}

Shard ParseShard(const std::string& text) {
  Shard shard;
  int read = 0;
  std::sscanf(text.c_str(), "%d/%d%n", &shard.index, &shard.count, &read);
  if (read == 0 || static_cast<size_t>(read) != text.size() || shard.index < 1 ||
      shard.index > shard.count)
    throw ConfigError("--shard " + text + ": must be I/N with I from 1 to N");
  return shard;
}

}  // namespace turbidock::batch
