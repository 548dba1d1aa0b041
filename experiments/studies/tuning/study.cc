#include "experiments/studies/tuning/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "experiments/batch/plan_keys.h"
#include "experiments/config/data_files.h"
#include "experiments/config/nearest_name.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/system/plain_text.h"
#include "experiments/trial/switched_off.h"
#include "sim/base/check.h"
#include "sim/base/random.h"

namespace turbidock::tuning {
namespace {

constexpr const char* kGroup = "tuning";
constexpr uint64_t kAnySet = 1;

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

void TuningSettings::Check(const std::string& path) const {
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
      plan_(study, {.plugins = plugins,
                    .use = kGroup,
                    .refused = {{"precision", "a study runs exactly `seeds` trials in each cell"},
                                batch::kNoRanges},
                    .sees_images = true}),  // its proof goes through the cameras
      settings_(batch::ReadUse<TuningSettings>(study, kGroup)) {
  const config::YamlNode group = *study.Find(kGroup);
  ReadObjective(*group.Find("objective"));
  ReadGains(*group.Find("gains"));
  try {
    TrialsOf(kAnySet, settings_.proof.held_out_seeds);
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{}: {}.proof.held_out_{}", file_, kGroup, error.what()));
  }
}

void Study::ReadObjective(const config::YamlNode& terms) {
  std::vector<std::string> names;
  for (const trial::Metric& metric : trial::Metrics()) names.push_back(metric.name);
  for (const config::YamlNode& term : terms.Elements()) {
    const std::string& name = settings_.objective[objective_.size()].metric;
    const auto found = std::ranges::find(trial::Metrics(), name, &trial::Metric::name);
    if (found == trial::Metrics().end()) {
      const config::YamlNode at = term.Find("metric").value_or(term);
      at.Fail("'" + name + "' is produced by no trial" + config::DidYouMean(name, names));
    }
    objective_.push_back(*found);
  }
}

// A candidate has one value of each gain in all of its trials, which read it.
void Study::ReadGains(const config::YamlNode& ranges) {
  std::vector<std::string> numbers;  // the keys of a scenario that may be tuned
  for (const config::KeyDoc& doc : trial::ScenarioKeys(plan_.plugins()))
    if (doc.type.starts_with("number") && doc.key.find("[]") == std::string::npos)
      numbers.push_back(doc.key);
  const batch::VariedKeys varied = plan_.Varied();
  const trial::Scenario first = plan_.ScenarioOf(plan_.Trial(0));
  for (const config::YamlNode& range : ranges.Elements()) {
    const auto& [key, low, high, scale] = settings_.gains[start_.size()];
    const config::YamlNode at = range.Find("key").value_or(range);
    if (std::ranges::count(numbers, key) == 0)
      at.Fail("'" + key + "' is no number of a scenario" + config::DidYouMean(key, numbers));
    if (const std::string* where = varied.Find(key))
      at.Fail(key + " is tuned and has one value in all trials, but also " + *where);
    std::string off = key;
    for (int64_t trial = 0; trial < plan_.trials() && !off.empty(); ++trial)
      off = trial::SwitchedOffBy(plan_.ScenarioOf(plan_.Trial(trial)), key);
    if (!off.empty()) at.Fail(fmt::format("{} changes no trial: {}", key, off));
    start_.push_back(std::stod(config::ValueOf(first, key)));
    if (start_.back() < low || start_.back() > high)
      at.Fail(fmt::format("the search begins at the trials' {} = {}, which must be in [{}, {}]",
                          key, start_.back(), low, high));
  }
  // Both ends must be allowed by the scenario too.
  for (const double end : {0.0, 1.0})
    ScenarioOf(plan_, 0, GainsAt(search::Candidate(settings_.gains.size(), end)));
}

std::string Study::resolved() const {
  return plan_.resolved() + kGroup + ":\n" + system::Indented(config::SaveYaml(settings_), "  ");
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
  if (cameras) given.emplace_back("estimator.pose_source=cameras");
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

std::vector<config::KeyDoc> StudyKeys() {
  std::vector<config::KeyDoc> docs = config::ListKeys<TuningSettings>();
  for (config::KeyDoc& doc : docs) doc.key = JoinKey(kGroup, doc.key);
  return docs;
}

Study LoadStudy(const std::string& name, const trial::Plugins& plugins) {
  return Study(config::LoadYaml(config::FindBundled("studies", "study", name)), plugins);
}

}  // namespace turbidock::tuning
