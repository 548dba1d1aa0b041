#include "experiments/farm/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iterator>
#include <optional>
#include <set>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/report/table.h"
#include "experiments/statistics/intervals.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "sim/base/random.h"

namespace turbidock::farm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScenarioKey = "scenario";
constexpr const char* kCaseKey = "case";

// A value as what it says: 10, 1e1 and 10.0 are one number.
std::string Compared(const config::YamlNode& value) {
  std::string text;
  for (const config::YamlNode& element : value.Elements()) text += Compared(element) + ", ";
  if (value.IsList()) return "[" + text + "]";
  if (value.IsMap()) {
    for (const auto& [key, part] : value.Entries()) text += key + ": " + Compared(part) + ", ";
    return "{" + text + "}";
  }
  const std::string scalar = value.Text().value_or("");
  const std::optional<double> number = report::NumberIn(scalar);
  return number ? FormatNumber(*number) : scalar;
}

// An error about an assignment that stands in a plan's `set` names its line there; others stay as
// they are.
ConfigError ErrorInSet(const ConfigError& error, const std::optional<config::YamlNode>& set,
                       const std::vector<std::string>& assignments) {
  const std::string what = error.what();
  const auto is_about = [&](const std::string& key) {
    const std::string start = std::string(config::kFromSet) + " " + key;
    return what.starts_with(start) &&
           std::string(" :.[").find(what[start.size()]) != std::string::npos;
  };
  for (const std::string& assignment : assignments)
    if (is_about(assignment.substr(0, assignment.find('=')))) return error;
  if (set)
    for (const auto& [key, value] : set->Entries())
      if (is_about(key))
        return ConfigError(value.Where() + set->path + "." +
                           what.substr(std::string(config::kFromSet).size() + 1));
  return error;
}

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

// As YAML under a key; nothing where there are none.
std::string TextOf(const char* key, const std::vector<Case>& cases) {
  std::string text = cases.empty() ? "" : std::string(key) + ":\n";
  for (const Case& one : cases) {
    std::vector<std::string> values;
    for (const Parameter& p : one.values) values.push_back(p.key + ": " + p.value);
    text += fmt::format("  {}: {{{}}}\n", YamlText(one.name), fmt::join(values, ", "));
  }
  return text;
}

}  // namespace

std::string ModelsDigest(const std::map<std::string, trial::Scenario>& scenarios) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(config::ModelPath(""))))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const auto& [name, scenario] : scenarios)
    if (scenario.model.find('/') != std::string::npos) files.emplace_back(scenario.model);
  Digest digest;
  for (const fs::path& file : files) {
    digest.Add(file.filename().string());
    digest.Add(system::ReadWhole(file));
  }
  return digest.Hex();
}

std::string YamlText(const std::string& text) { return config::TextNode(text, {}).OneLine(); }

Plan::Plan(const std::string& text, const std::string& file, const PlanOverrides& overrides)
    : Plan(config::ParseYaml(text, file), overrides) {}

Plan::Plan(const config::YamlNode& plan, const PlanOverrides& overrides)
    : plugins_(overrides.plugins) {
  const std::string& file = plan.file;
  config::Origins origins;
  config::ReadFields(plan, &settings_, &origins,
                     {"precision", "max_trials", "set", "grid", "cases", "strata", "random",
                      "resolved_scenarios", "models_digest"});
  if (!plan.Find("schema_version"))
    throw ConfigError(file + ": schema_version: this key is required");
  if (overrides.master_seed) settings_.master_seed = *overrides.master_seed;
  if (overrides.seeds) settings_.seeds = *overrides.seeds;
  config::CheckSettings(settings_, origins);
  if (!overrides.seeds) ReadPrecision(plan);
  if (const auto grid = plan.Find("grid")) ReadGrid(*grid);
  if (const auto strata = plan.Find("strata")) ReadStrata(*strata);
  if (const auto random = plan.Find("random")) ReadRandom(*random);
  if (const auto cases = plan.Find("cases")) ReadCases(*cases);
  try {
    LoadScenarios(plan, overrides.assignments);
  } catch (const ConfigError& error) {
    throw ErrorInSet(error, plan.Find("set"), overrides.assignments);
  }

  for (const GridAxis& axis : grid_) {
    cells_ *= std::ssize(axis.values);
    if (trials() > kMaxTrials)
      throw ConfigError(file + ": grid: more than " + std::to_string(kMaxTrials) + " trials");
  }
  const int64_t groups = settings_.common_seeds ? 1 : cells_;
  constexpr int64_t kMostDraws = 100'000'000;
  if (const int64_t keys = std::ssize(random_);
      keys > 0 && groups * trials_of_cell() > kMostDraws / keys)
    throw ConfigError(file + fmt::format(": random: {} keys for {} trials, more than {} draws",
                                         keys, groups * trials_of_cell(), kMostDraws));
  design_ = DrawDesign(settings_.design, random_, groups, trials_of_cell(),
                       SeedTree(static_cast<uint64_t>(settings_.master_seed)));
  resolved_ = Resolve();
  if (const auto digest = plan.Find("models_digest");
      digest && digest->Text() != ModelsDigest(scenarios_))
    digest->Fail("the models' files are not those that the plan began with");
  CheckTrials(file, overrides);
}

void Plan::RequireNewKey(const config::YamlNode& at, const std::string& key) const {
  if (key == "seed") at.Fail("the plan gives each trial its seed; set master_seed");
  if (key == "model") at.Fail("vary `scenario` instead of its model");
  if (key == kCaseKey) at.Fail("is the key that `cases` makes; give those");
  if (key == kStratumKey) at.Fail("is the key that `strata` make; give those");
}

void Plan::ReadPrecision(const config::YamlNode& plan) {
  const auto precision = plan.Find("precision"), max_trials = plan.Find("max_trials");
  if (!precision) {
    if (max_trials) max_trials->Fail("goes with a precision; without one, give seeds alone");
    return;
  }
  Precision& read = settings_.precision.emplace();
  config::Origins origins = {{"precision", precision->Where()}};
  if (max_trials) origins["max_trials"] = max_trials->Where();
  const config::Layers layers{.files = {plan}};
  read.precision = config::Peek(layers, "precision", read.precision);
  read.max_trials = config::Peek(layers, "max_trials", settings_.seeds);
  config::CheckSettings(read, origins);
  if (settings_.design == Design::kLatinHypercube)
    precision->Fail(
        "does not go with latin_hypercube, which needs to know how many trials there "
        "will be; use sobol or independent");
  if (max_trials) {
    if (read.max_trials < settings_.seeds)
      max_trials->Fail(fmt::format("must be at least seeds = {}", settings_.seeds));
    const int64_t least = statistics::TrialsForHalfWidth(1, read.precision);
    if (read.max_trials < least)
      max_trials->Fail(fmt::format("a precision of {} takes {} trials even where all succeed",
                                   FormatNumber(read.precision), least));
    return;
  }
  // In whole batches, as many as the widest interval asks for: it is always reached.
  const int64_t seeds = settings_.seeds,
                needed = statistics::TrialsForHalfWidth(0.5, read.precision);
  constexpr int64_t kMost = 1'000'000;  // the key's own limit
  read.max_trials =
      static_cast<int>(std::clamp((needed + seeds - 1) / seeds * seeds, seeds, kMost));
}

void Plan::ReadGrid(const config::YamlNode& node) {
  for (const auto& [key, values] : node.Entries()) {
    RequireNewKey(values, key);
    GridAxis axis{key, {}};
    const std::vector<config::YamlNode> elements = values.Elements();
    if (elements.empty()) values.Fail("must be a list of values");
    std::set<std::string> seen;
    for (const config::YamlNode& value : elements) {
      varied_.RequireNew(key, value);
      std::string text = value.OneLine();
      if (key == kScenarioKey) text = value.Text().value_or(text);
      if (!seen.insert(Compared(value)).second) value.Fail("'" + text + "' is given twice");
      axis.values.push_back(text);
      places_.try_emplace(Parameter{key, axis.values.back()}.Assignment(), value.Where());
    }
    for (const config::YamlNode& value : elements) varied_.Add(key, value);
    grid_.push_back(axis);
    keys_.push_back(key);
  }
}

std::vector<Case> Plan::CasesIn(const config::YamlNode& node, Require require) {
  std::vector<Case> cases;
  for (const auto& [name, values] : node.Entries()) {
    RequireName(name, values);
    Case& read = cases.emplace_back(Case{.name = name, .values = {}});
    for (const auto& [key, value] : values.Entries()) {
      RequireNewKey(value, key);
      if (key == kScenarioKey) value.Fail("belongs in the grid");
      (varied_.*require)(key, value);
      read.values.push_back({key, value.OneLine()});
      places_.try_emplace(read.values.back().Assignment(), value.Where());
    }
  }
  if (cases.empty()) node.Fail("must be a map of names, each with keys of the scenario");
  return cases;
}

void Plan::ReadStrata(const config::YamlNode& node) {
  strata_ = CasesIn(node, &VariedKeys::RequireNew);
  const int64_t strata = std::ssize(strata_);
  if (settings_.seeds % strata != 0 || trials_of_cell() % strata != 0)
    node.Fail(fmt::format("of {} strata each is met equally often, so {} = {} must be a multiple",
                          strata, settings_.seeds % strata != 0 ? "seeds" : "max_trials",
                          settings_.seeds % strata != 0 ? settings_.seeds : trials_of_cell()));
  if (settings_.design == Design::kSobol)
    node.Fail("do not go with sobol, of whose points every second is in the same half");
  for (const auto& [name, values] : node.Entries())
    for (const auto& [key, value] : values.Entries()) varied_.Add(key, value);
  keys_.emplace_back(kStratumKey);
}

void Plan::ReadCases(const config::YamlNode& node) {
  cases_ = CasesIn(node, &VariedKeys::RequireKept);
  GridAxis axis{kCaseKey, {}};
  for (const Case& one : cases_) axis.values.push_back(one.name);
  grid_.insert(grid_.begin(), axis);
  keys_.insert(keys_.begin(), kCaseKey);
}

void Plan::ReadRandom(const config::YamlNode& node) {
  for (const auto& [key, distribution] : node.Entries()) {
    RequireNewKey(distribution, key);
    const config::YamlNode one_value = config::TextNode("", distribution);
    varied_.RequireNew(key, one_value);
    varied_.Add(key, one_value);
    places_.try_emplace(key, distribution.Where());
    if (key == kScenarioKey) distribution.Fail("belongs in the grid");
    random_.push_back(RandomKey::Read(key, distribution));
    keys_.push_back(key);
  }
}

void Plan::LoadScenarios(const config::YamlNode& plan,
                         const std::vector<std::string>& assignments) {
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
  if (const auto set = plan.Find("set")) {
    for (const auto& [key, value] : set->Entries()) {
      if (key == "seed") RequireNewKey(value, key);
      varied_.RequireKept(key, value);
      sets.push_back(key + "=" + value.OneLine());
    }
  }
  sets.insert(sets.end(), assignments.begin(), assignments.end());
  for (const std::string& assignment : sets)
    if (const size_t at = assignment.find('='); at != std::string::npos)
      set_.push_back({assignment.substr(0, at), assignment.substr(at + 1)});
  for (const Parameter& p : set_) {
    const config::YamlNode at = {nullptr, config::kFromSet, p.key};
    if (p.key == "seed") RequireNewKey(at, p.key);
    varied_.RequireKept(p.key, config::ParseYamlValue(p.value, at));
  }

  const auto resolved = plan.Find("resolved_scenarios");
  const fs::path folder = fs::path(plan.file).parent_path();
  for (const std::string& name : names) {
    RequireName(name, plan);
    if (resolved) {
      const auto text = resolved->Find(name);
      if (!text || !text->Text()) resolved->Fail("has no scenario " + name);
      scenarios_[name] =
          trial::ParseScenario(*text->Text(), plan.file + " (" + name + ")", plugins_);
      config::ReadLayers({.assignments = assignments}, &scenarios_[name]);
    } else {
      // A file beside the plan, else whatever a command line would mean by it.
      const fs::path beside = folder / name;
      std::error_code ignored;
      found_[name] = fs::is_regular_file(beside, ignored) ? beside.string() : name;
      scenarios_[name] = trial::LoadScenario(found_[name], sets, "", plugins_);
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
  const int64_t samples = trials_of_cell();
  spec.cell = settings_.precision ? trial % cells_ : trial / samples;
  spec.sample = settings_.precision ? trial / cells_ : trial % samples;
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
  const int64_t row = (settings_.common_seeds ? 0 : spec.cell * samples) + spec.sample;
  for (size_t i = 0; i < random_.size(); ++i)
    spec.parameters.push_back(
        {random_[i].key,
         random_[i].ValueAt(design_[static_cast<size_t>(row) * random_.size() + i])});
  return spec;
}

TrialSpec Plan::FirstOf(int64_t cell) const {
  return Trial(settings_.precision ? cell : cell * trials_of_cell());
}

Plan::Cell Plan::CellOf(int64_t cell) const {
  const TrialSpec spec = FirstOf(cell);
  Cell found{.name = "", .scenario = settings_.scenario, .values = set_};
  for (size_t i = 0; i < grid_.size(); ++i) {
    const Parameter& parameter = spec.parameters[i];
    if (!found.name.empty()) found.name += ", ";
    found.name += parameter.key == kCaseKey ? parameter.value : parameter.Assignment();
    if (parameter.key == kScenarioKey)
      found.scenario = parameter.value;
    else if (parameter.key == kCaseKey)
      std::ranges::copy(ValuesOf(cases_, parameter.value), std::back_inserter(found.values));
    else
      found.values.push_back(parameter);
  }
  if (const auto at = found_.find(found.scenario); at != found_.end()) found.scenario = at->second;
  return found;
}

trial::Scenario Plan::ScenarioOf(const TrialSpec& spec) const {
  std::string name = settings_.scenario;
  config::Layers layers;
  const auto assign = [&layers](const Parameter& parameter) {
    layers.assignments.push_back(parameter.Assignment());
  };
  for (const Parameter& parameter : spec.parameters) {
    if (parameter.key == kScenarioKey)
      name = parameter.value;
    else if (parameter.key == kCaseKey)
      std::ranges::for_each(ValuesOf(cases_, parameter.value), assign);
    else if (parameter.key == kStratumKey)
      std::ranges::for_each(ValuesOf(strata_, parameter.value), assign);
    else
      assign(parameter);
  }
  trial::Scenario scenario = scenarios_.at(name);
  scenario.seed = spec.seed;
  config::ReadLayers(layers, &scenario);
  return scenario;
}

void Plan::CheckTrials(const std::string& file, const PlanOverrides& overrides) const {
  for (int64_t trial = 0; trial < trials(); ++trial) {
    if (overrides.on_look && trial > 0) overrides.on_look(trial, trials());
    // Without draws the trials of a cell's stratum differ in nothing but the seed.
    const TrialSpec spec = Trial(trial);
    if (random_.empty() && spec.sample >= std::max<int64_t>(1, std::ssize(strata_))) continue;
    try {
      ScenarioOf(spec);
    } catch (const ConfigError& error) {
      std::string what = error.what();  // "--set KEY = ..."
      if (what.starts_with("--set ")) what.erase(0, 6);
      throw ConfigError(
          fmt::format("{}trial {}: {}", PlaceOf(spec, what).value_or(file + ": "), trial, what));
    }
  }
}

std::optional<std::string> Plan::PlaceOf(const TrialSpec& spec, const std::string& problem) const {
  std::vector<Parameter> given = spec.parameters;
  for (const Parameter& parameter : spec.parameters)
    if (parameter.key == kCaseKey || parameter.key == kStratumKey)
      std::ranges::copy(ValuesOf(parameter.key == kCaseKey ? cases_ : strata_, parameter.value),
                        std::back_inserter(given));
  for (const Parameter& parameter : given) {
    auto place = places_.find(parameter.Assignment());
    if (place == places_.end()) place = places_.find(parameter.key);  // drawn
    if (place != places_.end() && problem.starts_with(parameter.key)) return place->second;
  }
  return std::nullopt;
}

std::string Plan::Resolve() const {
  std::string text = config::SaveYaml(settings_);
  if (settings_.precision) text += config::SaveYaml(*settings_.precision);
  text += TextOf("cases", cases_) + TextOf("strata", strata_);
  if (grid_.size() > (cases_.empty() ? 0 : 1)) text += "grid:\n";
  for (const GridAxis& axis : grid_) {
    std::vector<std::string> values = axis.values;
    if (axis.key == kScenarioKey) std::ranges::transform(values, values.begin(), YamlText);
    if (axis.key != kCaseKey)
      text += fmt::format("  {}: [{}]\n", axis.key, fmt::join(values, ", "));
  }
  if (!random_.empty()) text += "random:\n";
  for (const RandomKey& random : random_)
    text += fmt::format("  {}: {}\n", random.key, random.Text());
  text += "resolved_scenarios:\n";
  for (const auto& [name, scenario] : scenarios_)
    text +=
        "  " + YamlText(name) + ": |\n" + system::Indented(trial::SaveScenario(scenario), "    ");
  return text + "models_digest: \"" + ModelsDigest(scenarios_) + "\"\n";
}

Plan LoadPlan(const std::string& name, const PlanOverrides& overrides) {
  const std::string file = config::FindBundled("plans", "plan", name);
  return Plan(system::ReadWhole(file), file, overrides);
}

Shard ParseShard(const std::string& text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, shard.index);
  bool is_good = first.ec == std::errc{} && first.ptr != end && *first.ptr == '/';
  if (is_good) {
    const auto second = std::from_chars(first.ptr + 1, end, shard.count);
    is_good = second.ec == std::errc{} && second.ptr == end;
  }
  if (!is_good || shard.count < 1 || shard.index < 1 || shard.index > shard.count)
    throw ConfigError("--shard " + text + ": must be I/N with I from 1 to N");
  return shard;
}

}  // namespace turbidock::farm
