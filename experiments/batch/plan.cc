#include "experiments/batch/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <optional>
#include <set>
#include <string_view>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/statistics/intervals.h"
#include "experiments/statistics/sampling.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "sim/base/random.h"

namespace turbidock::batch {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScenarioKey = "scenario";
constexpr const char* kCaseKey = "case";
constexpr std::string_view kBySet = "--set ";  // begins a message about an assignment

const std::vector<Parameter>& ValuesOf(const std::vector<Case>& cases, const std::string& name) {
  return std::ranges::find(cases, name, &Case::name)->values;
}

// What names a case, stratum or scenario becomes a key of the resolved plan and a cell of tables.
void RequireName(const std::string& name, const config::YamlNode& at) {
  constexpr size_t kLongest = 1000;
  if (name.empty() || name.size() > kLongest || name.find('\n') != std::string::npos)
    at.Fail(fmt::format("'{}': must be a name of one line and at most {} bytes",
                        system::Shortened(name), kLongest));
}

// That a plan may give trials values of this key.
void RequireGivable(const std::string& key, const config::YamlNode& at) {
  if (key == "seed") at.Fail("the plan gives each trial its seed; set master_seed");
  if (key == "model") at.Fail("vary `scenario` instead of its model");
  if (key == "vehicle_model")
    at.Fail(
        "its data are read with a scenario: give each vehicle one of its own and vary `scenario`");
  if (key == kCaseKey) at.Fail("is the key that `cases` makes; give those");
  if (key == kStratumKey) at.Fail("is the key that `strata` make; give those");
}

std::map<std::string, std::string> ModelFilesOf(
    const std::map<std::string, trial::Scenario>& scenarios) {
  std::map<std::string, std::string> files;
  for (const auto& [name, scenario] : scenarios)
    for (const trial::ModelFile& file : trial::ModelFilesOf(scenario))
      files[file.file] = file.content;
  return files;
}

}  // namespace

std::string ModelFilesText(const std::map<std::string, trial::Scenario>& scenarios) {
  std::string text = "model_files:\n";
  for (const auto& [path, digest] : ModelFilesOf(scenarios))
    text += fmt::format("  {}: content {}\n", YamlText(path), digest);
  return text;
}

std::string YamlText(const std::string& text) { return config::TextNode(text, {}).OneLine(); }

Plan::Plan(const std::string& text, const std::string& file, const PlanOverrides& overrides)
    : Plan(config::ParseYaml(text, file), overrides) {}

Plan::Plan(const config::YamlNode& plan, const PlanOverrides& overrides)
    : plugins_(overrides.plugins) {
  const std::string& file = plan.file;
  config::Origins origins;
  config::ReadFields(
      plan, &settings_, &origins,
      {"set", "grid", "cases", "strata", "random", "resolved_scenarios", "model_files"});
  if (!plan.Find("schema_version"))
    throw ConfigError(file + ": schema_version: this key is required");
  if (overrides.master_seed) settings_.master_seed = *overrides.master_seed;
  if (overrides.seeds) settings_.seeds = *overrides.seeds, settings_.precision = 0;
  config::CheckSettings(settings_, origins);
  samples_ = SamplesOf(settings_.seeds, settings_.precision);
  // In the order in which a trial takes their values. A case may say otherwise than `set`.
  ReadSet(plan, overrides.assignments);
  if (const auto cases = plan.Find("cases")) {
    cases_ = CasesIn(*cases, kCaseKey);
    GridAxis& axis = grid_.emplace_back(GridAxis{kCaseKey, {}});
    for (const Case& one : cases_) axis.values.push_back(one.name);
  }
  if (const auto grid = plan.Find("grid")) ReadGrid(*grid);
  if (const auto strata = plan.Find("strata")) strata_ = CasesIn(*strata, kStratumKey);
  if (!strata_.empty() && settings_.seeds % std::ssize(strata_) != 0)
    throw ConfigError(overrides.seeds ? "--seeds" : file + ": seeds",
                      fmt::format("{} must be a multiple of {}: each stratum is met equally often",
                                  settings_.seeds, strata_.size()));
  if (const auto random = plan.Find("random")) ReadRandom(*random);
  for (const GridAxis& axis : grid_) {
    cells_ *= std::ssize(axis.values);
    if (trials() > kMaxTrials)
      throw ConfigError(file + ": grid: more than " + std::to_string(kMaxTrials) + " trials");
  }
  LoadScenarios(plan);
  CheckTrials(file);
  if (const auto files = plan.Find("model_files"))
    for (const auto& [path, digest] : ModelFilesOf(models_)) {
      const auto before = files->Find(path);
      if (!before || before->Text() != "content " + digest)
        files->Fail(path + " is not what it was when the plan began");
    }
  resolved_ = Resolve(plan);
}

void Plan::ReadSet(const config::YamlNode& plan, const std::vector<std::string>& assignments) {
  const auto add = [this](const std::string& key, const config::YamlNode& value) {
    if (key == "seed") RequireGivable(key, value);
    given_.Add(key, value);
    set_.push_back({key, PlanValue(key, value)});
  };
  if (const auto set = plan.Find("set"))
    for (const auto& [key, value] : set->Entries()) {
      add(key, value);
      places_.try_emplace(set_.back().Assignment(), value.Where());
    }
  for (const std::string& assignment : assignments) {
    const size_t at = assignment.find('=');
    const config::YamlNode place{nullptr, config::kFromSet, assignment.substr(0, at)};
    if (at == std::string::npos) place.Fail("must be KEY=VALUE");
    add(place.path, config::ParseYamlValue(assignment.substr(at + 1), place));
  }
}

void Plan::ReadGrid(const config::YamlNode& node) {
  for (const auto& [key, values] : node.Entries()) {
    RequireGivable(key, values);
    GridAxis axis{key, {}};
    const std::vector<config::YamlNode> elements = values.Elements();
    if (elements.empty()) values.Fail("must be a list of values");
    std::set<std::string> seen;
    for (const config::YamlNode& value : elements) {
      given_.RequireNew(key, value);
      std::string text = PlanValue(key, value);
      if (key == kScenarioKey) text = value.Text().value_or(text);
      if (!seen.insert(text).second) value.Fail("'" + text + "' is given twice");
      axis.values.push_back(text);
      places_.try_emplace(Parameter{key, text}.Assignment(), value.Where());
    }
    for (const config::YamlNode& value : elements) given_.Add(key, value);
    grid_.push_back(axis);
    keys_.push_back(key);
  }
}

std::vector<Case> Plan::CasesIn(const config::YamlNode& node, const std::string& parameter) {
  std::vector<Case> cases;
  std::vector<std::pair<std::string, config::YamlNode>> given;
  for (const auto& [name, values] : node.Entries()) {
    RequireName(name, values);
    Case& read = cases.emplace_back(Case{.name = name, .values = {}});
    for (const auto& [key, value] : values.Entries()) {
      RequireGivable(key, value);
      if (key == kScenarioKey) value.Fail("belongs in the grid");
      if (parameter == kStratumKey) given_.RequireNew(key, value);
      read.values.push_back({key, PlanValue(key, value)});
      places_.try_emplace(read.values.back().Assignment(), value.Where());
      given.emplace_back(key, value);
    }
  }
  if (cases.empty()) node.Fail("must be a map of names, each with keys of the scenario");
  for (const auto& [key, value] : given) given_.Add(key, value);
  keys_.emplace_back(parameter);
  return cases;
}

void Plan::ReadRandom(const config::YamlNode& node) {
  for (const auto& [key, distribution] : node.Entries()) {
    RequireGivable(key, distribution);
    if (key == kScenarioKey) distribution.Fail("belongs in the grid");
    const config::YamlNode one_value = config::TextNode("", distribution);
    given_.RequireNew(key, one_value);
    given_.Add(key, one_value);
    places_.try_emplace(key, distribution.Where());
    random_.push_back(RandomKey::Read(key, distribution));
    keys_.push_back(key);
  }
}

void Plan::LoadScenarios(const config::YamlNode& plan) {
  std::vector<std::string> names;
  for (const GridAxis& axis : grid_)
    if (axis.key == kScenarioKey) names = axis.values;
  if (names.empty()) {
    if (settings_.scenario.empty())
      throw ConfigError(plan.file + ": scenario: this key is required");
    names.push_back(settings_.scenario);
  } else if (!settings_.scenario.empty()) {
    plan.Find("scenario")->Fail("is given here and in the grid; leave one out");
  }
  std::vector<std::string> sets;
  for (const Parameter& given : set_) sets.push_back(given.Assignment());
  const auto resolved = plan.Find("resolved_scenarios");
  const fs::path folder = fs::path(plan.file).parent_path();
  for (const std::string& name : names) {
    RequireName(name, plan);
    if (resolved) {
      const auto text = resolved->Find(name);
      if (!text || !text->Text()) resolved->Fail("has no scenario " + name);
      scenarios_[name] =
          trial::ParseScenario(*text->Text(), plan.file + " (" + name + ")", plugins_);
      config::ReadLayers({.assignments = sets}, &scenarios_[name]);
    } else {
      // A file beside the plan, else whatever a command line would mean by it.
      const fs::path beside = folder / name;
      std::error_code ignored;
      found_[name] = fs::is_regular_file(beside, ignored) ? beside.string() : name;
      try {
        scenarios_[name] = trial::LoadScenario(found_[name], sets, "", plugins_);
      } catch (const ConfigError& error) {
        const std::string what = error.what();
        if (!what.starts_with(kBySet)) throw;
        const auto place = PlaceOf(set_, what.substr(kBySet.size()));
        throw place ? ConfigError(*place + "set." + what.substr(kBySet.size())) : error;
      }
    }
  }
}

std::vector<std::string> Plan::files() const {
  std::vector<std::string> files;
  for (const auto& [name, file] : found_) files.push_back(file);
  for (const auto& [name, scenario] : scenarios_)
    files.insert(files.end(), {scenario.model, scenario.vehicle_model, scenario.station_model});
  return files;
}

TrialSpec Plan::Trial(int64_t trial) const {
  TD_CHECK(0 <= trial && trial < trials(), "a trial of the plan");
  TrialSpec spec;
  spec.trial = trial;
  // With a precision sample by sample: more trials of a cell then change no trial's number or seed.
  const bool by_sample = settings_.precision > 0;
  spec.cell = by_sample ? trial % cells_ : trial / samples_;
  spec.sample = by_sample ? trial / cells_ : trial % samples_;
  const int64_t number = settings_.common_seeds ? spec.sample : trial;
  spec.seed = SeedTree(static_cast<uint64_t>(settings_.master_seed)).TrialSeed(number);
  int64_t rest = spec.cell;
  spec.parameters.resize(grid_.size());
  for (size_t i = grid_.size(); i-- > 0;) {
    const int64_t n = std::ssize(grid_[i].values);
    spec.parameters[i] = {grid_[i].key, grid_[i].values[static_cast<size_t>(rest % n)]};
    rest /= n;
  }
  if (!strata_.empty())
    spec.parameters.push_back(
        {kStratumKey, strata_[static_cast<size_t>(spec.sample % std::ssize(strata_))].name});
  for (const RandomKey& random : random_)
    spec.parameters.push_back({random.key, random.ValueAt(DrawOf(random, spec))});
  return spec;
}

// Each key has a stream of its own, and each cell if cells differ in their seeds: a new key or cell
// leaves the others' draws alone.
double Plan::DrawOf(const RandomKey& random, const TrialSpec& spec) const {
  const int64_t group = settings_.common_seeds ? 0 : spec.cell;
  Rng rng = SeedTree(static_cast<uint64_t>(settings_.master_seed))
                .Stream(fmt::format("draw:{}:{}", random.key, group));
  rng.SkipU64(static_cast<uint64_t>(spec.sample));
  return statistics::OpenUniform(&rng);
}

int64_t Plan::NumberOf(int64_t cell, int64_t sample) const {
  return settings_.precision > 0 ? sample * cells_ + cell : cell * samples_ + sample;
}

TrialSpec Plan::FirstOf(int64_t cell) const { return Trial(NumberOf(cell, 0)); }

Plan::Cell Plan::CellOf(int64_t cell) const {
  std::vector<Parameter> axes = FirstOf(cell).parameters;
  axes.resize(grid_.size());
  Cell found{.name = "", .scenario = settings_.scenario, .values = set_};
  for (const Parameter& parameter : axes) {
    if (!found.name.empty()) found.name += ", ";
    found.name += parameter.key == kCaseKey ? parameter.value : parameter.Assignment();
    if (parameter.key == kScenarioKey) found.scenario = parameter.value;
  }
  std::ranges::copy(AssignmentsOf(axes), std::back_inserter(found.values));
  if (const auto at = found_.find(found.scenario); at != found_.end()) found.scenario = at->second;
  return found;
}

std::vector<Parameter> Plan::AssignmentsOf(const std::vector<Parameter>& parameters) const {
  std::vector<Parameter> values;
  for (const Parameter& p : parameters) {
    if (p.key == kScenarioKey) continue;
    if (p.key == kCaseKey || p.key == kStratumKey)
      std::ranges::copy(ValuesOf(p.key == kCaseKey ? cases_ : strata_, p.value),
                        std::back_inserter(values));
    else
      values.push_back(p);
  }
  return values;
}

trial::Scenario Plan::ScenarioOf(const TrialSpec& spec) const {
  const auto name = std::ranges::find(spec.parameters, kScenarioKey, &Parameter::key);
  trial::Scenario scenario =
      scenarios_.at(name == spec.parameters.end() ? settings_.scenario : name->value);
  scenario.seed = spec.seed;
  config::Layers layers;
  for (const Parameter& value : AssignmentsOf(spec.parameters))
    layers.assignments.push_back(value.Assignment());
  config::ReadLayers(layers, &scenario);
  return scenario;
}

// Of a trial, and whatever else it may draw in their place.
void Plan::AddModels(const trial::Scenario& scenario) {
  const std::string models =
      fmt::format("{}\n{}\n{}", scenario.model, scenario.vehicle_model, scenario.station_model);
  if (!models_.try_emplace(models, scenario).second) return;
  for (const RandomKey& random : random_) {
    if (random.key != "station_model") continue;
    for (const std::string& choice : random.choices) {
      trial::Scenario other = scenario;
      config::ApplySet(random.key + "=" + choice, &other, nullptr);
      AddModels(other);
    }
  }
}

void Plan::CheckTrials(const std::string& file) {
  // Without draws the trials of a cell's stratum differ in nothing but the seed.
  constexpr int64_t kMostDrawn = 10'000;  // a second's work
  const int64_t strata = std::max<int64_t>(1, std::ssize(strata_));
  const int64_t drawn = random_.empty() ? 0 : std::min(kMostDrawn / cells_, samples_);
  for (int64_t cell = 0; cell < cells_; ++cell)
    for (int64_t sample = 0; sample < std::max(strata, drawn); ++sample) {
      const TrialSpec spec = Trial(NumberOf(cell, sample));
      try {
        AddModels(ScenarioOf(spec));
      } catch (const ConfigError& error) {
        std::string what = error.what();
        if (what.starts_with(kBySet)) what.erase(0, kBySet.size());
        throw ConfigError(fmt::format(
            "{}trial {}: {}", PlaceOf(AssignmentsOf(spec.parameters), what).value_or(file + ": "),
            spec.trial, what));
      }
    }
}

std::optional<std::string> Plan::PlaceOf(const std::vector<Parameter>& given,
                                         const std::string& problem) const {
  for (auto p = given.rbegin(); p != given.rend(); ++p) {  // the last one counts
    constexpr std::string_view kBehindKeys = " :.[";
    if (!problem.starts_with(p->key) ||
        kBehindKeys.find(problem[p->key.size()]) == std::string_view::npos)
      continue;
    auto place = places_.find(p->Assignment());
    if (place == places_.end()) place = places_.find(p->key);  // drawn
    return place == places_.end() ? std::nullopt : std::optional(place->second);
  }
  return std::nullopt;
}

std::string Plan::Resolve(const config::YamlNode& plan) const {
  std::string text = config::SaveYaml(settings_);
  for (const std::string part : {"cases", "strata", "grid", "random"})
    if (const auto given = plan.Find(part); given && !given->Entries().empty()) {
      text += part + ":\n";
      for (const auto& [name, value] : given->Entries())
        text += fmt::format("  {}: {}\n", YamlText(name), value.OneLine());
    }
  text += "resolved_scenarios:\n";
  for (const auto& [name, scenario] : scenarios_)
    text +=
        "  " + YamlText(name) + ": |\n" + system::Indented(trial::SaveScenario(scenario), "    ");
  return text + ModelFilesText(models_);
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
