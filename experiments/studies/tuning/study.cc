#include "experiments/studies/tuning/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "experiments/batch/plan_keys.h"
#include "experiments/config/data_files.h"
#include "experiments/config/nearest_name.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"
#include "sim/base/random.h"

namespace turbidock::tuning {
namespace {

// Keys of a plan that mean nothing in a study's `trials`, and what is said of them.
constexpr auto kNotInTrials = std::to_array<std::pair<const char*, const char*>>({
    {"schema_version", "belongs to the study, not here"},
    {"description", "belongs to the study, not here"},
    {"strata", "a study takes trials one by one; spread them by `random` and `design`"},
    {"precision", "a study runs exactly `seeds` trials in each cell"},
    {"series_every_frames", "a study stores no series"},
});

// A study's `trials` as a plan of its own.
config::YamlNode PlanOf(const config::YamlNode& study, const std::string& description) {
  auto trials = study.Find("trials");
  if (!trials->IsMap()) trials->Fail("must be a group of keys, as a plan has");
  for (const auto& [key, why] : kNotInTrials)
    if (const auto given = trials->Find(key)) given->Fail(why);
  trials->path.clear();  // the plan's keys are its own
  return trials->With(
      {{"schema_version", config::TextNode(std::to_string(batch::kPlanSchema), *trials)},
       {"description", config::TextNode(description, *trials)}});
}

StudySettings ReadSettings(const config::YamlNode& node, const trial::Plugins& plugins) {
  for (const char* key : {"schema_version", "trials", "gains", "objective"})
    if (!node.Find(key)) throw ConfigError(node.file + ": " + key + ": this key is required");
  StudySettings settings;
  config::Origins origins;
  config::ReadFields(node, &settings, &origins, {"trials"});
  config::CheckSettings(settings, origins);
  std::vector<std::string> numbers;  // the keys of a scenario that may be tuned
  for (const config::KeyDoc& doc : trial::ScenarioKeys(plugins))
    if (doc.type.starts_with("number") && doc.key.find("[]") == std::string::npos)
      numbers.push_back(doc.key);
  const std::vector<config::YamlNode> gains = node.Find("gains")->Elements();
  for (size_t i = 0; i < gains.size(); ++i)
    if (const std::string& key = settings.gains[i].key; std::ranges::count(numbers, key) == 0)
      gains[i].Find("key").value_or(gains[i]).Fail("'" + key + "' is no number of a scenario" +
                                                   config::DidYouMean(key, numbers));
  return settings;
}

// A candidate has one value of each gain in all of its trials.
void RequireNotVaried(const config::YamlNode& trials, const std::vector<GainRange>& gains) {
  batch::VariedKeys tuned;
  for (const GainRange& gain : gains) tuned.Add(gain.key, config::TextNode("", trials));
  const auto require = [&tuned](const std::string& key, const config::YamlNode& value) {
    tuned.RequireNew(key, value, "is tuned: it has one value in all trials");
  };
  if (const auto grid = trials.Find("grid"))
    for (const auto& [key, values] : grid->Entries())
      for (const config::YamlNode& value : values.Elements()) require(key, value);
  if (const auto cases = trials.Find("cases"))
    for (const auto& [name, values] : cases->Entries()) require("", values);
  if (const auto random = trials.Find("random"))
    for (const auto& [key, distribution] : random->Entries())
      require(key, config::TextNode("", distribution));
}

}  // namespace

double GainRange::ValueAt(double u) const {
  const double value = scale == Scale::kLinear
                           ? low + u * (high - low)
                           : std::exp(std::log(low) + u * (std::log(high) - std::log(low)));
  return std::clamp(value, low, high);
}

double GainRange::ShareOf(double value) const {
  const double share = scale == Scale::kLinear ? (value - low) / (high - low)
                                               : std::log(value / low) / std::log(high / low);
  return std::clamp(share, 0.0, 1.0);
}

void StudySettings::Check(const std::string& path) const {
  const auto at = [&](const std::string& key) { return JoinKey(path, key); };
  if (gains.empty()) throw ConfigError(at("gains"), "must name at least one gain");
  if (objective.empty()) throw ConfigError(at("objective"), "must have at least one term");
  std::set<std::string> seen;
  for (size_t i = 0; i < gains.size(); ++i) {
    const GainRange& gain = gains[i];
    const std::string key = at("gains[" + std::to_string(i) + "]");
    if (!seen.insert(gain.key).second)
      throw ConfigError(key + ".key", "'" + gain.key + "' is tuned already");
    if (gain.low >= gain.high)
      throw ConfigError(key + ".low", FormatNumber(gain.low) + " must be below high (" +
                                          FormatNumber(gain.high) + ")");
    if (gain.scale == Scale::kLog && gain.low <= 0)
      throw ConfigError(key + ".low", FormatNumber(gain.low) + " must be > 0 on a log scale");
  }
}

Study::Study(const config::YamlNode& study, const trial::Plugins& plugins)
    : file_(study.file),
      settings_(ReadSettings(study, plugins)),
      plan_(PlanOf(study, settings_.description), {.plugins = plugins}) {
  RequireNotVaried(*study.Find("trials"), settings_.gains);
  if (settings_.proof.held_out_seeds > batch::kMaxTrials / plan_.cells())
    throw ConfigError(fmt::format("{}: proof.held_out_seeds: more than {} trials in {} cells",
                                  file_, batch::kMaxTrials, plan_.cells()));
  std::vector<std::string> names;
  for (const trial::Metric& metric : trial::Metrics()) names.push_back(metric.name);
  for (const config::YamlNode& term : study.Find("objective")->Elements()) {
    const std::string& name = settings_.objective[objective_.size()].metric;
    const auto found = std::ranges::find(trial::Metrics(), name, &trial::Metric::name);
    if (found != trial::Metrics().end())
      objective_.push_back(*found);
    else
      term.Find("metric").value_or(term).Fail("'" + name + "' is produced by no trial" +
                                              config::DidYouMean(name, names));
  }
  const trial::Scenario scenario = plan_.ScenarioOf(plan_.Trial(0));
  for (size_t i = 0; i < settings_.gains.size(); ++i) {
    const GainRange& gain = settings_.gains[i];
    const double value = std::stod(config::ValueOf(scenario, gain.key));
    if (value < gain.low || value > gain.high)
      throw ConfigError(fmt::format(
          "{}: gains[{}]: the search begins at the scenario's {} = {}, which must be in [{}, {}]",
          file_, i, gain.key, value, gain.low, gain.high));
    start_.push_back(value);
  }
  // Both ends must be allowed by the scenario too.
  for (const double end : {0.0, 1.0})
    ScenarioOf(plan_, 0, GainsAt(search::Candidate(settings_.gains.size(), end)));
  resolved_ =
      config::SaveYaml(settings_) + "trials: |\n" + system::Indented(plan_.resolved(), "  ");
}

Gains Study::GainsAt(const search::Candidate& candidate) const {
  Gains gains;
  for (size_t i = 0; i < candidate.size(); ++i)
    gains.push_back(settings_.gains[i].ValueAt(candidate[i]));
  return gains;
}

search::Candidate Study::CandidateOf(const Gains& gains) const {
  search::Candidate candidate;
  for (size_t i = 0; i < gains.size(); ++i)
    candidate.push_back(settings_.gains[i].ShareOf(gains[i]));
  return candidate;
}

batch::Plan Study::TrialsOf(uint64_t set, int seeds) const {
  const SeedTree root(static_cast<uint64_t>(plan_.settings().master_seed));
  std::optional<int64_t> seed;
  if (set > 0)
    seed = static_cast<int64_t>(root.Stream("tuning.seeds." + std::to_string(set)).NextU64() >> 1);
  return plan_.WithSeeds(seed, seeds);
}

trial::Scenario Study::ScenarioOf(const batch::Plan& plan, int64_t trial, const Gains& gains,
                                  bool cameras) const {
  trial::Scenario scenario = plan.ScenarioOf(plan.Trial(trial));
  std::vector<std::string> given;
  for (size_t i = 0; i < gains.size(); ++i)
    given.push_back(settings_.gains[i].key + "=" + FormatNumber(gains[i]));
  if (cameras) given.emplace_back("pose_source=cameras");
  try {
    trial::Resolve(config::ParseAssignments(given), &scenario);
  } catch (const ConfigError& error) {
    throw ConfigError(file_ + ": a range of the gains leads to", error.what());
  }
  return scenario;
}

std::vector<double> Study::CostsOf(const trial::TrialRecord& record) const {
  std::vector<double> costs;
  for (size_t i = 0; i < objective_.size(); ++i) {
    const ObjectiveTerm& term = settings_.objective[i];
    const double size = std::min(std::abs(objective_[i].of(record).value_or(0)), kMostCost);
    costs.push_back(term.weight * (size + (record.success() ? 0 : term.failed)));
  }
  return costs;
}

Study LoadStudy(const std::string& name, const trial::Plugins& plugins) {
  return Study(config::LoadYaml(config::FindBundled("studies", "study", name)), plugins);
}

}  // namespace turbidock::tuning
