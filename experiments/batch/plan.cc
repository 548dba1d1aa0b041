#include "experiments/batch/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <optional>
#include <regex>
#include <set>
#include <string_view>

#include "experiments/config/yaml_fields.h"
#include "experiments/statistics/sampling.h"
#include "experiments/system/plain_text.h"
#include "experiments/trial/world.h"
#include "sim/base/random.h"

namespace turbidock::batch {
namespace {

namespace fs = std::filesystem;

constexpr const char *kScenarioKey = "scenario", *kSeedKey = "trial.seed";

const Case& CaseIn(const std::vector<Case>& cases, const std::string& name) {
  return *std::ranges::find(cases, name, &Case::name);
}

config::Assignment SeedOf(int64_t seed) {
  return {kSeedKey, config::TextNode(std::to_string(seed), {nullptr, config::kFromSet, kSeedKey})};
}

// A cell by its case and grid.
std::string CellName(const std::vector<Parameter>& parameters) {
  std::string name;
  for (const Parameter& parameter : parameters) name += parameter.Assignment() + "\n";
  return name;
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
  std::vector<config::Assignment> given = {{key, at}};
  for (const config::YamlNode& value : at.Find("choice").value_or(at).Elements())
    given.push_back({key, value});
  for (const config::Assignment& leaf : config::LeavesOf(given))
    if (leaf.key == kSeedKey) at.Fail("the plan gives each trial its seed; set master_seed");
  if (key == kCaseKey) at.Fail("is the key that `cases` makes; give those");
  if (key == kStratumKey) at.Fail("is the key that `strata` make; give those");
}

// Scenarios that name the same files have the same ones.
std::string NamesIn(trial::Scenario* scenario) {
  std::string names;
  config::ForEachFileIn(scenario, [&names](InputFile* file) { names += file->path + "\n"; });
  return names;
}

// "sea.waves[0].height_m" as the list of keys has it: "sea.waves[].height_m".
std::string AnyElement(const std::string& key) {
  static const std::regex kElement("\\[\\d+\\]|\\.\\d+(?=\\.|$)");
  return std::regex_replace(key, kElement, "[]");
}

void RefuseKeys(const config::YamlNode& plan, const std::vector<PlanKey>& keys) {
  for (const auto& [key, why] : keys)
    if (const auto given = plan.Find(key)) given->Fail(why);
}

config::YamlNode InItsFolder(config::YamlNode plan) {
  if (const auto folder = plan.Find(kFolderKey))
    plan.file = (fs::path(folder->Text().value_or("")) / fs::path(plan.file).filename()).string();
  return plan;
}

}  // namespace

bool Parameter::operator==(const Parameter& other) const {
  if (key != other.key || value == other.value) return key == other.key;
  return CanonicalValue(*this) == CanonicalValue(other);
}

std::string CanonicalValue(const Parameter& parameter) {
  try {
    return config::ParseYamlValue(parameter.value, {nullptr, config::kFromSet, parameter.key})
        .Canonical();
  } catch (const ConfigError&) {  // the name of a case
    return parameter.value;
  }
}

Plan::Plan(const std::string& text, const std::string& file, const PlanOverrides& overrides)
    : Plan(config::ParseYaml(text, file), overrides) {}

Plan::Plan(const config::YamlNode& given, const PlanOverrides& overrides)
    : plugins_(overrides.plugins) {
  const config::YamlNode plan = InItsFolder(given);
  const std::string& file = plan.file;
  folder_ = fs::absolute(file).lexically_normal().parent_path();
  if (plan.Find("trial"))
    throw ConfigError(file + ": is a scenario, no plan; turbidock run runs it");
  RefuseKeys(plan, ReplacedPlanKeys());
  if (!plan.Find("resolved_scenarios")) {
    for (const PlanKey& key : overrides.refused)
      if (!overrides.seeds || key.key != "precision") RefuseKeys(plan, {key});
    for (const char* key : {"model_files", kFolderKey})
      RefuseKeys(plan, {{key, "only a resolved plan has it; leave it out"}});
  }
  for (const auto& [key, what] : kUseGroups)
    if (key != overrides.use && plan.Find(key))
      remarks_.push_back(fmt::format("{}: is not read here; these are {}", key, what));
  std::vector<std::string> groups;
  for (const PlanKey& group : PlanGroups()) groups.push_back(group.key);
  config::Origins origins;
  config::ReadFields(plan, &settings_, &origins, groups);
  if (!plan.Find("schema_version"))
    throw ConfigError(file + ": schema_version: this key is required");
  if (overrides.master_seed) settings_.master_seed = *overrides.master_seed;
  if (overrides.seeds) settings_.seeds = *overrides.seeds, settings_.precision = 0;
  config::CheckSettings(settings_, origins);
  title_ = settings_.description.empty() ? fs::path(file).stem().string() : settings_.description;
  trial::Scenario any;
  any.plugins = plugins_;
  presets_ = config::PresetsOf(any);
  // In the order in which a trial takes their values. A case may say otherwise than `set`.
  ReadSet(plan, overrides.assignments);
  if (const auto cases = plan.Find("cases")) {
    cases_ = CasesIn(*cases, kCaseKey);
    // Cases of a batch are compared with each other: set alike they would not be what they say.
    VariedKeys last;
    if (overrides.use.empty())
      for (const config::Assignment& one : overrides.assignments) last.Add(one.key, one.value);
    for (Case& one : cases_) {
      for (const config::Assignment& own : one.values) last.RequireNew(own.key, own.value);
      std::erase_if(one.values, [&](const auto& own) {
        return std::ranges::count(overrides.assignments, own.key, &config::Assignment::key) > 0;
      });
      one.values.insert(one.values.end(), overrides.assignments.begin(),
                        overrides.assignments.end());
    }
    GridAxis& axis = grid_.emplace_back(GridAxis{kCaseKey, {}});
    for (const Case& one : cases_) axis.values.push_back(one.name);
  }
  if (const auto grid = plan.Find("grid")) ReadGrid(*grid);
  ReadRanges(plan, overrides);
  if (const auto strata = plan.Find("strata")) strata_ = CasesIn(*strata, kStratumKey);
  if (const auto random = plan.Find("random")) ReadRandom(*random);
  CountTrials(overrides.seeds ? "--seeds" : file + ": seeds");
  LoadScenarios(plan);
  CheckTrials(file, overrides.sees_images);
  if (const auto files = plan.Find("model_files")) RequireSameFiles(*files);
  trials_ = Resolve(plan);
}

Plan Plan::WithSeeds(std::optional<int64_t> master_seed, int seeds) const {
  Plan other = *this;
  other.settings_.seeds = seeds;
  other.settings_.precision = 0;
  if (master_seed) other.settings_.master_seed = *master_seed;
  other.CountTrials("seeds");
  return other;
}

void Plan::CountTrials(const std::string& key) {
  if (!strata_.empty() && settings_.seeds % std::ssize(strata_) != 0)
    throw ConfigError(key, fmt::format("{} must be a multiple of {}: each stratum is met equally "
                                       "often",
                                       settings_.seeds, strata_.size()));
  samples_ = envelope_ ? kMostOfCell : SamplesOf(settings_.seeds, settings_.precision);
  cells_ = 1;
  for (const GridAxis& axis : grid_) {
    cells_ *= std::ssize(axis.values);
    if (trials() > kMaxTrials)
      throw ConfigError(key, fmt::format("more than {} trials", kMaxTrials));
  }
}

void Plan::ReadSet(const config::YamlNode& plan,
                   const std::vector<config::Assignment>& assignments) {
  std::vector<config::Assignment> all;
  if (const auto set = plan.Find("set"))
    for (const auto& [key, value] : set->Entries()) all.push_back({key, value});
  PutPresetsFirst(&all);
  all.insert(all.end(), assignments.begin(), assignments.end());
  for (const config::Assignment& given : all) {
    RequireGivable(given.key, given.value);
    given_.Add(given.key, given.value);
    set_.push_back(given);
  }
}

// That the grid does not vary the list of which this key is an element: one of both would be lost.
void Plan::RequireNoListOf(const std::string& key, const config::YamlNode& at) const {
  VariedKeys listed;
  for (const GridAxis& axis : grid_)
    if (!axis.nodes.empty()) listed.Add(axis.key, axis.nodes.front());
  listed.RequireNoWhole(key, at);
}

void Plan::ReadGrid(const config::YamlNode& node) {
  for (const auto& [key, values] : node.Entries()) {
    RequireGivable(key, values);
    RequireNoListOf(key, values);
    GridAxis axis{.key = key, .values = {}};
    const std::vector<config::YamlNode> elements = values.Elements();
    if (elements.empty()) values.Fail("must be a list of values");
    std::set<std::string> seen;
    for (const config::YamlNode& value : elements) {
      given_.RequireNew(key, value);
      std::string text = value.OneLine();
      if (key == kScenarioKey) text = value.Text().value_or(text);
      if (!seen.insert(value.Canonical()).second) value.Fail("'" + text + "' is given twice");
      axis.values.push_back(text);
      axis.nodes.push_back(value);
    }
    for (const config::YamlNode& value : elements) given_.Add(key, value);
    grid_.push_back(axis);
    keys_.push_back(key);
  }
}

void Plan::ReadRanges(const config::YamlNode& plan, const PlanOverrides& overrides) {
  envelope_ = ReadEnvelope(plan);
  if (!envelope_) return;
  const char* why = "does not go with `ranges`: `find` says how many trials there are";
  if (overrides.seeds) throw ConfigError("--seeds", why);
  if (!plan.Find("resolved_scenarios")) RefuseKeys(plan, {{"seeds", why}});
  const search::Lattice lattice = envelope_->Search().lattice;
  const std::vector<config::KeyDoc> keys = trial::ScenarioKeys(plugins_);
  for (size_t k = 0; k < envelope_->ranges.size(); ++k) {
    const RangeKey& range = envelope_->ranges[k];
    const config::YamlNode at = *plan.Find("ranges")->Find(range.key);
    const config::YamlNode one_value = config::TextNode("", at);
    RequireGivable(range.key, at);
    const auto doc = std::ranges::find(keys, AnyElement(range.key), &config::KeyDoc::key);
    const std::string type = doc == keys.end() ? "" : doc->type;
    if (type == "text" || type == "file" || range.key == kScenarioKey)
      at.Fail("is no number; it belongs in the grid or in a case");
    if (type == "whole number")
      at.Fail("is a whole number, and a range has values between; list its values in the grid");
    given_.RequireNew(range.key, one_value);
    RequireNoListOf(range.key, one_value);
    given_.Add(range.key, one_value);
    GridAxis& axis = grid_.emplace_back(GridAxis{.key = range.key, .values = {}});
    const int last = lattice.axes[k].values - 1;
    for (int i = 0; i <= last; ++i) {
      axis.values.push_back(FormatNumber(range.At(i / static_cast<double>(last))));
      axis.nodes.push_back(config::TextNode(axis.values.back(), at));
    }
    keys_.push_back(range.key);
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
      if (parameter == kStratumKey) {
        if (key == kScenarioKey) value.Fail("belongs in the grid or in a case");
        given_.RequireNew(key, value);
      }
      if (key == kScenarioKey)
        RequireName(read.scenario = value.Text().value_or(""), value);
      else
        read.values.push_back({key, value});
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
    if (key == kScenarioKey) distribution.Fail("belongs in the grid or in a case");
    const config::YamlNode one_value = config::TextNode("", distribution);
    given_.RequireNew(key, one_value);
    given_.Add(key, one_value);
    random_.push_back(RandomKey::Read(key, distribution));
    distributions_.push_back(distribution);
    keys_.push_back(key);
  }
}

void Plan::LoadScenarios(const config::YamlNode& plan) {
  std::set<std::string> names;
  for (const GridAxis& axis : grid_)
    if (axis.key == kScenarioKey) names.insert(axis.values.begin(), axis.values.end());
  if (!names.empty() && !settings_.scenario.empty())
    plan.Find(kScenarioKey)->Fail("is given here and in the grid; leave one out");
  if (names.empty()) {
    for (const Case& one : cases_)
      names.insert(one.scenario.empty() ? settings_.scenario : one.scenario);
    if (cases_.empty()) names.insert(settings_.scenario);
    if (names.contains(""))
      throw ConfigError(plan.file + ": scenario: this key is required" +
                        (names.size() > 1 ? ", or in every case" : ""));
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
      config::ForEachFileIn(&scenarios_[name],
                            [this](InputFile* file) { file->path = FileOf(file->path); });
      trial::Resolve(set_, &scenarios_[name]);
    } else {
      // A file beside the plan, else whatever a command line would mean by it.
      const fs::path beside = folder / name;
      std::error_code ignored;
      found_[name] = fs::is_regular_file(beside, ignored) ? beside.string() : name;
      scenarios_[name] = trial::LoadScenario(found_[name], set_, plugins_);
    }
  }
}

std::vector<std::string> Plan::files() const {
  std::set<std::string> all;
  for (const auto& [name, file] : found_) all.insert(file);
  for (const config::Assignment& given : set_)  // gains
    if (given.value.file != config::kFromSet) all.insert(given.value.file);
  for (const auto& [names, files] : files_)
    for (const trial::ModelFile& file : files) all.insert(file.file);
  return {all.begin(), all.end()};
}

TrialSpec Plan::Trial(int64_t trial) const {
  TD_CHECK(0 <= trial && trial < trials(), "a trial of the plan");
  TrialSpec spec;
  spec.trial = trial;
  // With a precision or ranges sample by sample: more trials of a cell then change no trial's
  // number or seed.
  spec.cell = decides() ? trial % cells_ : trial / samples_;
  spec.sample = decides() ? trial / cells_ : trial % samples_;
  int64_t rest = spec.cell;
  spec.parameters.resize(grid_.size());
  for (size_t i = grid_.size(); i-- > 0;) {
    const int64_t n = std::ssize(grid_[i].values);
    spec.parameters[i] = {grid_[i].key, grid_[i].values[static_cast<size_t>(rest % n)]};
    rest /= n;
  }
  // Places in the ranges have seeds of their own: else few seeds would decide the whole boundary.
  const auto ranges = envelope_ ? std::ssize(envelope_->ranges) : 0;
  const std::string cell =
      CellName({settings_.common_seeds ? spec.parameters.end() - ranges : spec.parameters.begin(),
                spec.parameters.end()});
  SeedTree seeds(static_cast<uint64_t>(settings_.master_seed));
  if (!cell.empty()) seeds = SeedTree(seeds.Stream("cell:" + cell).NextU64());
  spec.seed = seeds.TrialSeed(spec.sample);
  if (!strata_.empty())
    spec.parameters.push_back(
        {kStratumKey, strata_[static_cast<size_t>(spec.sample % std::ssize(strata_))].name});
  for (const RandomKey& random : random_)
    spec.parameters.push_back({random.key, random.ValueAt(DrawOf(random, cell, spec.sample))});
  return spec;
}

// Each key has a stream of its own, and each cell if cells differ in their seeds: a new key, cell
// or sample leaves the others' draws alone.
double Plan::DrawOf(const RandomKey& random, const std::string& cell, int64_t sample) const {
  Rng rng = SeedTree(static_cast<uint64_t>(settings_.master_seed))
                .Stream(fmt::format("draw:{}:{}", random.key, cell.empty() ? "0" : cell));
  rng.SkipU64(static_cast<uint64_t>(sample));
  return statistics::OpenUniform(&rng);
}

int64_t Plan::NumberOf(int64_t cell, int64_t sample) const {
  return decides() ? sample * cells_ + cell : cell * samples_ + sample;
}

std::optional<int64_t> Plan::NumberOf(const std::vector<Parameter>& parameters,
                                      int64_t sample) const {
  if (parameters.size() < grid_.size() || sample < 0 || sample >= samples_) return std::nullopt;
  int64_t cell = 0;
  for (size_t i = 0; i < grid_.size(); ++i) {
    const auto& [key, values, nodes] = grid_[i];
    const auto found = std::ranges::find_if(values, [&, &key = key](const auto& value) {
      return Parameter{key, value} == parameters[i];
    });
    if (found == values.end()) return std::nullopt;
    cell = cell * std::ssize(values) + (found - values.begin());
  }
  return NumberOf(cell, sample);
}

void Plan::PutPresetsFirst(std::vector<config::Assignment>* values) const {
  const auto rank = [this](const config::Assignment& given) {
    const auto is_it = [&given](const std::string& preset) {
      return preset == given.key || preset.starts_with(given.key + ".");
    };
    return std::ranges::find_if(presets_, is_it) - presets_.begin();
  };
  std::ranges::stable_sort(*values, {}, rank);
}

std::vector<config::Assignment> Plan::AssignmentsOf(
    const std::vector<Parameter>& parameters) const {
  std::vector<config::Assignment> values;
  for (const Parameter& p : parameters) {
    if (p.key == kScenarioKey) continue;
    if (p.key == kCaseKey || p.key == kStratumKey) {
      std::ranges::copy(CaseIn(p.key == kCaseKey ? cases_ : strata_, p.value).values,
                        std::back_inserter(values));
      continue;
    }
    const auto axis = std::ranges::find(grid_, p.key, &GridAxis::key);
    if (axis != grid_.end()) {
      const auto at = std::ranges::find(axis->values, p.value) - axis->values.begin();
      values.push_back({p.key, axis->nodes.at(static_cast<size_t>(at))});
    } else {
      const auto drawn = std::ranges::find(random_, p.key, &RandomKey::key) - random_.begin();
      values.push_back(
          {p.key, config::ParseYamlValue(p.value, distributions_.at(static_cast<size_t>(drawn)))});
    }
  }
  PutPresetsFirst(&values);
  return values;
}

const std::string& Plan::ScenarioNameOf(const std::vector<Parameter>& parameters) const {
  for (const Parameter& parameter : parameters) {
    if (parameter.key == kScenarioKey) return parameter.value;
    if (parameter.key != kCaseKey) continue;
    if (const Case& of = CaseIn(cases_, parameter.value); !of.scenario.empty()) return of.scenario;
  }
  return settings_.scenario;
}

trial::Scenario Plan::ScenarioOf(const TrialSpec& spec) const {
  trial::Scenario scenario = scenarios_.at(ScenarioNameOf(spec.parameters));
  std::vector<config::Assignment> given = AssignmentsOf(spec.parameters);
  given.push_back(SeedOf(spec.seed));
  trial::Resolve(given, &scenario);
  const auto known = files_.find(NamesIn(&scenario));
  if (known != files_.end()) scenario.model_files = known->second;
  return scenario;
}

// Of a trial, and whatever else it may draw in their place.
void Plan::AddFiles(trial::Scenario scenario) {
  const auto [there, is_new] = files_.try_emplace(NamesIn(&scenario));
  if (!is_new) return;
  there->second = trial::ModelFilesOf(scenario);
  trial::CheckFiles(scenario);
  for (size_t i = 0; i < random_.size(); ++i) {
    for (const std::string& choice : random_[i].choices) {
      trial::Scenario other = scenario;
      trial::Resolve({{random_[i].key, config::ParseYamlValue(choice, distributions_[i])}}, &other);
      AddFiles(other);
    }
  }
}

void Plan::RequireSameFiles(const config::YamlNode& before) const {
  for (const auto& [names, files] : files_)
    for (const trial::ModelFile& file : files)
      if (const auto was = before.Find(NameFromFolder(file.file));
          !was || was->Text() != "content " + file.content)
        before.Fail(file.file + " is not what it was when the plan began");
}

}  // namespace turbidock::batch
