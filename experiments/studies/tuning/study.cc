#include "experiments/studies/tuning/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "experiments/config/data_files.h"
#include "experiments/config/nearest_name.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/farm/varied_keys.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"
#include "sim/base/random.h"

namespace turbidock::tuning {
namespace {

// The number behind a dotted key.
double* Find(const config::GroupRef& group, const std::string& key) {
  const size_t dot = key.find('.');
  for (const config::Field& field : group.fields) {
    if (field.key != key.substr(0, dot)) continue;
    if (dot == std::string::npos) {
      double* const* number = std::get_if<double*>(&field.value);
      return number ? *number : nullptr;
    }
    const config::GroupRef* inner = std::get_if<config::GroupRef>(&field.value);
    return inner ? Find(*inner, key.substr(dot + 1)) : nullptr;
  }
  return nullptr;
}

double* NumberOf(const std::string& key, trial::Scenario* scenario) {
  return Find(config::GroupOf(scenario), key);
}

// Keys of a scenario that may be tuned.
std::vector<std::string> NumberKeys(const trial::Plugins& plugins) {
  trial::Scenario scenario;
  scenario.plugins = plugins;
  std::vector<std::string> keys;
  for (const config::KeyDoc& doc : trial::ScenarioKeys(plugins))
    if (doc.key.find("[]") == std::string::npos && NumberOf(doc.key, &scenario))
      keys.push_back(doc.key);
  return keys;
}

// The metric of a term; ConfigError where no trial has it.
const trial::Metric& FigureOf(const ObjectiveTerm& term, const std::string& key) {
  std::vector<std::string> names;
  for (const trial::Metric& metric : trial::Metrics()) {
    if (metric.name == term.metric) return metric;
    names.push_back(metric.name);
  }
  throw ConfigError(key, "'" + term.metric + "' is produced by no trial" +
                             config::DidYouMean(term.metric, names));
}

// Keys of a plan that mean nothing in a study's `trials`, and what is said of them.
constexpr auto kNotInTrials = std::to_array<std::pair<const char*, const char*>>({
    {"schema_version", "belongs to the study, not here"},
    {"description", "belongs to the study, not here"},
    {"strata", "a study takes trials one by one; spread them by `random` and `design`"},
    {"precision", "a study runs exactly `seeds` trials in each cell"},
    {"series_every_frames", "a study stores no series"},
});

// A study's `trials` as a plan of its own, with the settings of the map `also` if there is one.
config::YamlNode PlanOf(const config::YamlNode& study, const std::string& description,
                        const char* also = nullptr) {
  auto trials = study.Find("trials");
  if (!trials->IsMap()) trials->Fail("must be a group of keys, as a plan has");
  for (const auto& [key, why] : kNotInTrials)
    if (const auto given = trials->Find(key)) given->Fail(why);
  trials->path.clear();  // the plan's keys are its own
  std::vector<std::pair<std::string, config::YamlNode>> more = {
      {"schema_version", config::TextNode(std::to_string(farm::kPlanSchema), *trials)},
      {"description", config::TextNode(description, *trials)}};
  const auto other = also ? study.Find(also) : std::nullopt;
  if (other) {
    const auto set = trials->Find("set");
    more.emplace_back("set", set ? set->With(other->Entries()) : *other);
  }
  return trials->With(more);
}

StudySettings ReadSettings(const config::YamlNode& node, const trial::Plugins& plugins) {
  for (const char* key : {"schema_version", "trials", "gains", "objective"})
    if (!node.Find(key)) throw ConfigError(node.file + ": " + key + ": this key is required");
  StudySettings settings;
  config::Origins origins;
  config::ReadFields(node, &settings, &origins, {"trials", "against"});
  config::CheckSettings(settings, origins);
  const std::vector<std::string> numbers = NumberKeys(plugins);
  for (size_t i = 0; i < settings.gains.size(); ++i) {
    const std::string& key = settings.gains[i].key;
    if (std::find(numbers.begin(), numbers.end(), key) == numbers.end())
      config::internal::ThrowWithOrigin(ConfigError("gains[" + std::to_string(i) + "].key",
                                                    "'" + key + "' is no number of a scenario" +
                                                        config::DidYouMean(key, numbers)),
                                        origins);
  }
  return settings;
}

// A candidate has one value of each gain in all of its trials.
void RequireNotVaried(const config::YamlNode& trials, const std::vector<GainRange>& gains) {
  farm::VariedKeys tuned;
  for (const GainRange& gain : gains) tuned.Add(gain.key, config::TextNode("", trials));
  const auto require = [&tuned](const std::string& key, const config::YamlNode& value) {
    if (const auto at = tuned.FirstThere(key, value))
      at->Fail("is tuned: it has one value in all trials");
  };
  if (const auto grid = trials.Find("grid"))
    for (const auto& [key, values] : grid->Entries())
      for (const config::YamlNode& value : values.Elements()) require(key, value);
  if (const auto cases = trials.Find("cases"))
    for (const auto& [name, values] : cases->Entries())
      for (const auto& [key, value] : values.Entries()) require(key, value);
  if (const auto random = trials.Find("random"))
    for (const auto& [key, distribution] : random->Entries())
      require(key, config::TextNode("", distribution));
}

// That the trials of every evaluation can be numbered.
void RequireNumbers(const config::YamlNode& study, const StudySettings& settings,
                    const farm::Plan& plan) {
  const auto require = [&](const char* group, const char* key, int64_t seeds) {
    if (seeds <= kMostTrials / plan.cells()) return;
    const auto in = study.Find(group);
    config::YamlNode at = (in ? in->Find(key) : std::nullopt).value_or(study);
    at.path = JoinKey(group, key);
    at.Fail(fmt::format("{} trials in each of {} cells are {}, must be at most {}", seeds,
                        plan.cells(), seeds * plan.cells(), kMostTrials));
  };
  require("trials", "seeds", plan.settings().seeds);
  require("proof", "held_out_seeds", settings.proof.held_out_seeds);
  require("proof", "robustness_seeds", settings.proof.robustness_seeds);
  require("proof", "sensitivity_seeds", settings.proof.sensitivity_seeds);
}

}  // namespace

double GainRange::ValueAt(double u) const {
  if (scale == Scale::kLinear) return low + u * (high - low);
  return std::exp(std::log(low) + u * (std::log(high) - std::log(low)));
}

double GainRange::ShareOf(double value) const {
  if (scale == Scale::kLinear) return (value - low) / (high - low);
  return (std::log(value) - std::log(low)) / (std::log(high) - std::log(low));
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
  for (size_t i = 0; i < objective.size(); ++i)
    FigureOf(objective[i], at("objective[" + std::to_string(i) + "].metric"));
  const bool pareto = optimiser.algorithm == search::Algorithm::kNsga2;
  if (pareto && objective.size() < 2)
    throw ConfigError(at("objective"), "nsga2 needs at least two terms");
}

Study::Study(const std::string& text, const std::string& file, const trial::Plugins& plugins)
    : Study(config::ParseYaml(text, file), plugins) {}

Study::Study(const config::YamlNode& study, const trial::Plugins& plugins)
    : plugins_(plugins),
      settings_(ReadSettings(study, plugins)),
      trials_(PlanOf(study, settings_.description)),
      trials_against_(PlanOf(study, settings_.description, "against")),
      file_(study.file),
      plan_(trials_, {.plugins = plugins}) {
  const std::string& file = file_;
  RequireNotVaried(*study.Find("trials"), settings_.gains);
  RequireNumbers(study, settings_, plan_);
  for (const ObjectiveTerm& term : settings_.objective) objective_.push_back(FigureOf(term, ""));
  trial::Scenario scenario = plan_.ScenarioOf(plan_.Trial(0));
  for (size_t i = 0; i < settings_.gains.size(); ++i) {
    const GainRange& gain = settings_.gains[i];
    const double value = *NumberOf(gain.key, &scenario);
    if (value < gain.low || value > gain.high)
      throw ConfigError(file + ": gains[" + std::to_string(i) + "]",
                        "the search begins at the scenario's " + gain.key + " = " +
                            FormatNumber(value) + ", which must be in [" + FormatNumber(gain.low) +
                            ", " + FormatNumber(gain.high) + "]");
    start_.push_back(value);
  }
  const farm::Plan against = TrialsAgainst(0, 1);
  trial::Scenario compared = against.ScenarioOf(against.Trial(0));
  for (const GainRange& gain : settings_.gains) against_.push_back(*NumberOf(gain.key, &compared));
  // Both ends must be allowed by the scenario too.
  for (const double end : {0.0, 1.0})
    ScenarioOf(plan_, 0, GainsAt(search::Candidate(settings_.gains.size(), end)));
  resolved_ =
      config::SaveYaml(settings_) + "trials: |\n" + system::Indented(plan_.resolved(), "  ");
  if (has_against())
    resolved_ += "against: |\n" +
                 system::Indented(TrialsAgainst(0, plan_.settings().seeds).resolved(), "  ");
}

Gains Study::GainsAt(const search::Candidate& candidate) const {
  Gains gains(candidate.size());
  for (size_t i = 0; i < gains.size(); ++i)
    gains[i] = std::clamp(settings_.gains[i].ValueAt(candidate[i]), settings_.gains[i].low,
                          settings_.gains[i].high);
  return gains;
}

search::Candidate Study::CandidateOf(const Gains& gains) const {
  search::Candidate candidate(gains.size());
  for (size_t i = 0; i < gains.size(); ++i)
    candidate[i] = std::clamp(settings_.gains[i].ShareOf(gains[i]), 0.0, 1.0);
  return candidate;
}

farm::Plan Study::Trials(const config::YamlNode& trials, uint64_t set, int seeds) const {
  const auto master = static_cast<uint64_t>(plan_.settings().master_seed);
  farm::PlanOverrides overrides{.plugins = plugins_};
  overrides.seeds = seeds;
  if (set > 0)
    overrides.master_seed = static_cast<int64_t>(
        SeedTree(master).Stream("tuning.seeds." + std::to_string(set)).NextU64() >> 1);
  return farm::Plan(trials, overrides);
}

std::vector<int64_t> Study::FairOrder(const farm::Plan& plan) {
  std::vector<int64_t> order(static_cast<size_t>(plan.trials()));
  for (int64_t i = 0; i < plan.trials(); ++i) order[static_cast<size_t>(i)] = i;
  std::stable_sort(order.begin(), order.end(), [&](int64_t a, int64_t b) {
    return plan.Trial(a).sample < plan.Trial(b).sample;
  });
  return order;
}

trial::Scenario Study::ScenarioOf(const farm::Plan& plan, int64_t trial, const Gains& gains) const {
  trial::Scenario scenario = plan.ScenarioOf(plan.Trial(trial));
  for (size_t i = 0; i < gains.size(); ++i) *NumberOf(settings_.gains[i].key, &scenario) = gains[i];
  try {
    CheckFields(scenario, "");
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
  const std::string path = config::FindBundled("studies", "study", name);
  return Study(system::ReadWhole(path), path, plugins);
}

}  // namespace turbidock::tuning
