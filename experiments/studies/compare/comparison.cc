#include "experiments/studies/compare/comparison.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <utility>

#include "experiments/batch/batch_report.h"
#include "experiments/batch/summary.h"
#include "experiments/config/nearest_name.h"
#include "experiments/config/yaml_node.h"
#include "experiments/statistics/paired_tests.h"
#include "experiments/trial/record_columns.h"
#include "sim/base/check.h"
#include "sim/base/fields.h"

namespace turbidock::compare {
namespace {

// Whether a dotted key is of a group: "scenario.ball_lights.enabled" of "ball lights".
bool IsIn(const std::string& key, const std::string& group) {
  std::string dotted = report::Words("." + key + ".");
  std::ranges::replace(dotted, '[', '.');
  return dotted.find("." + group + ".") != std::string::npos;
}

bool Has(const std::vector<std::string>& list, const std::string& word) {
  return std::ranges::count(list, word) > 0;
}

void RequireKnown(const std::vector<std::string>& words, const std::vector<std::string>& known) {
  for (const std::string& word : words)
    if (!Has(known, word))
      throw ConfigError(word + ": is no parameter of these results" +
                        config::DidYouMean(word, known));
}

std::string Text(const std::vector<batch::Parameter>& parameters) {
  std::string text;
  for (const batch::Parameter& p : parameters) text += (text.empty() ? "" : " ") + p.Assignment();
  return text;
}

// Trials by what a partner must share.
using Key = std::pair<std::string, int64_t>;  // parameters, seed

// With those of their parameters that have these keys.
std::map<Key, batch::StoredTrial> ByKey(const batch::ResultStore& store,
                                        const std::vector<std::string>& keys) {
  std::map<Key, batch::StoredTrial> trials;
  for (batch::StoredTrial& trial : store.Trials()) {
    if (!trial.record.ended()) continue;
    std::erase_if(trial.parameters, [&](const batch::Parameter& p) { return !Has(keys, p.key); });
    std::ranges::sort(trial.parameters, {}, &batch::Parameter::key);
    const Key key{Text(trial.parameters), trial.record.seed};
    if (!trials.emplace(key, std::move(trial)).second)
      throw ConfigError(
          fmt::format("several trials have the seed {}{}: they differ in a parameter "
                      "that the other set does not have",
                      key.second, key.first.empty() ? "" : " and " + key.first));
  }
  return trials;
}

// What is compared of pairs that docked in both, but for how they end.
std::vector<trial::Metric> ComparedMetrics() {
  const std::vector<std::string> names = {"time_s", "tracking_rms_m", "effort_v"};
  std::vector<trial::Metric> metrics;
  for (const trial::Metric& metric : trial::Metrics())
    if (Has(names, metric.name)) metrics.push_back(metric);
  metrics.push_back({"final_error_m", [](const trial::TrialRecord& record) {
                       return std::optional(record.final_error_true.distance_m());
                     }});
  return metrics;
}

Change CompareDocking(const std::string& group, const std::vector<TrialPair>& pairs) {
  const auto n = static_cast<double>(pairs.size());
  int64_t in_a = 0, in_b = 0, in_both = 0;
  for (const TrialPair& pair : pairs) {
    in_a += pair.a.success();
    in_b += pair.b.success();
    in_both += pair.docked();
  }
  const int64_t lost = in_a - in_both, gained = in_b - in_both;
  return {.group = group,
          .metric = kDocked,
          .pairs = std::ssize(pairs),
          .a = static_cast<double>(in_a) / n,
          .b = static_cast<double>(in_b) / n,
          .difference = static_cast<double>(gained - lost) / n,
          .interval_95 = statistics::RateDifferenceInterval(lost, gained, std::ssize(pairs)),
          .p_value = statistics::McNemarExactP(lost, gained)};
}

// Nothing without pairs.
std::optional<Change> CompareMetric(const std::string& group, const std::vector<TrialPair>& pairs,
                                    const trial::Metric& metric) {
  std::vector<double> in_a, in_b, differences;
  for (const TrialPair& pair : pairs) {
    const auto a = metric.of(pair.a), b = metric.of(pair.b);
    if (!pair.docked() || !a || !b) continue;
    in_a.push_back(*a);
    in_b.push_back(*b);
    differences.push_back(*b - *a);
  }
  if (differences.empty()) return std::nullopt;
  return Change{.group = group,
                .metric = metric.name,
                .pairs = std::ssize(differences),
                .a = *statistics::Median(in_a),
                .b = *statistics::Median(in_b),
                .difference = *statistics::Median(differences),
                .interval_95 = statistics::MedianInterval(differences),
                .p_value = statistics::McNemarExactP(
                    std::ranges::count_if(differences, [](double d) { return d > 0; }),
                    std::ranges::count_if(differences, [](double d) { return d < 0; }))};
}

// By the values of these parameters.
auto GroupPairs(const std::vector<TrialPair>& pairs, const std::vector<std::string>& by) {
  std::map<std::vector<std::string>, std::vector<TrialPair>, decltype(&batch::LessByValue)> groups(
      &batch::LessByValue);
  for (const TrialPair& pair : pairs) {
    std::vector<std::string> values;
    for (const std::string& name : by)
      values.push_back(std::ranges::find(pair.parameters, name, &batch::Parameter::key)->value);
    groups[values].push_back(pair);
  }
  return groups;
}

// Marks what is significant in each family of tests: docking, and all metrics.
void MarkSignificant(std::vector<Change>* changes) {
  for (const bool is_rate : {true, false}) {
    std::vector<Change*> family;
    std::vector<double> p_values;
    for (Change& change : *changes)
      if (change.is_rate() == is_rate) {
        family.push_back(&change);
        p_values.push_back(change.p_value);
      }
    const std::vector<bool> significant = statistics::HolmSignificant(p_values);
    for (size_t i = 0; i < family.size(); ++i) family[i]->significant = significant[i];
  }
}

// Notes every value below a node of one of two plans by its dotted key; those of a text of several
// lines, which a scenario is, by their own.
void Note(const config::YamlNode& node, const std::string& key, size_t side, Differences* values) {
  if (node.IsMap()) {
    const auto entries = node.Entries();
    const bool is_scenario = key == "resolved_scenarios" && entries.size() == 1;
    for (const auto& [name, child] : entries)
      Note(child, is_scenario ? "scenario" : JoinKey(key, name), side, values);
    return;
  }
  const std::string text = node.Text().value_or("");
  if (text.find('\n') != std::string::npos) {
    try {
      return Note(config::ParseYaml(text, key), key, side, values);
    } catch (const ConfigError&) {
      // a text for people
    }
  }
  values->try_emplace(key, std::array<std::string, 2>{"-", "-"}).first->second[side] =
      node.OneLine();
}

}  // namespace

std::string Flip::Link() const { return fmt::format("{}-{}", trial_a, trial_b); }

std::vector<TrialPair> PairTrials(const batch::ResultStore& a, const batch::ResultStore& b,
                                  const ComparisonOptions& options) {
  std::vector<std::string> keys = a.header().keys, shared;
  for (const std::string& key : keys)
    if (Has(b.header().keys, key) && !Has(options.ignore, key)) shared.push_back(key);
  keys.insert(keys.end(), b.header().keys.begin(), b.header().keys.end());
  RequireKnown(options.ignore, keys);
  RequireKnown(options.by, shared);

  const std::map<Key, batch::StoredTrial> in_a = ByKey(a, shared), in_b = ByKey(b, shared);
  std::vector<TrialPair> pairs;
  std::set<int64_t> seeds;
  for (const auto& [key, trial] : in_a) {
    seeds.insert(key.second);
    if (const auto partner = in_b.find(key); partner != in_b.end())
      pairs.push_back({trial.parameters, trial.record, partner->second.record, trial.trial,
                       partner->second.trial});
  }
  if (!pairs.empty()) return pairs;
  for (const auto& [key, trial] : in_b)
    if (seeds.contains(key.second))
      throw ConfigError(
          fmt::format("no trial of one set has the seed and parameters of one of the other; give "
                      "--ignore those in which they are meant to differ, of {}",
                      fmt::join(shared, ", ")));
  throw ConfigError(
      "no trial of one set has the seed of one of the other; run both with the same master_seed");
}

Differences PlanDifferences(const std::string& a, const std::string& b) {
  Differences differences;
  Note(config::ParseYaml(a, "plan"), "", 0, &differences);
  Note(config::ParseYaml(b, "plan"), "", 1, &differences);
  std::erase_if(differences, [](const auto& of) { return of.second[0] == of.second[1]; });
  return differences;
}

Comparison ComparePairs(const std::vector<TrialPair>& pairs, const ComparisonOptions& options) {
  Comparison comparison;
  comparison.options = options;
  for (const TrialPair& pair : pairs) {
    const bool in_a = pair.a.success();
    if (in_a == pair.b.success()) continue;
    (in_a ? comparison.lost : comparison.gained)
        .push_back({.seed = pair.a.seed,
                    .trial_a = pair.trial_a,
                    .trial_b = pair.trial_b,
                    .failure = in_a ? pair.b.failure : pair.a.failure,
                    .parameters = Text(pair.parameters),
                    .shared = pair.parameters});
  }
  const auto differing = static_cast<double>(comparison.lost.size() + comparison.gained.size());
  comparison.least_difference_seen = statistics::LeastDifferenceSeen(
      std::ssize(pairs), differing / static_cast<double>(pairs.size()));
  const auto groups = GroupPairs(pairs, options.by);
  for (const auto& [values, of] : groups) {
    std::vector<batch::Parameter> shared;
    for (size_t i = 0; i < values.size(); ++i) shared.push_back({options.by[i], values[i]});
    const std::string name = shared.empty() ? "all" : Text(shared);
    std::vector<Change> changes = {CompareDocking(name, of)};
    for (const trial::Metric& metric : ComparedMetrics())
      if (const auto change = CompareMetric(name, of, metric)) changes.push_back(*change);
    for (Change& change : changes) {
      change.shared = shared;
      comparison.changes.push_back(change);
    }
  }
  if (groups.size() > 1) comparison.changes.push_back(CompareDocking("all together", pairs));
  MarkSignificant(&comparison.changes);
  comparison.all = groups.size() > 1 ? comparison.changes.back() : comparison.changes.front();
  return comparison;
}

Comparison Compare(const ComparedFile& a, const ComparedFile& b, const ComparisonOptions& options) {
  const std::vector<TrialPair> pairs = PairTrials(a.store, b.store, options);
  Comparison comparison = ComparePairs(pairs, options);
  comparison.left_out_a = std::ssize(a.store.Trials()) - std::ssize(pairs);
  comparison.left_out_b = std::ssize(b.store.Trials()) - std::ssize(pairs);
  comparison.a = a.file;
  comparison.b = b.file;
  comparison.build_a = a.store.header().build;
  comparison.build_b = b.store.header().build;
  comparison.differences = PlanDifferences(a.store.header().plan, b.store.header().plan);
  const std::vector<std::string> not_varied_b = batch::NotVaried(b.store.header());
  for (const std::string& group : batch::NotVaried(a.store.header()))
    if (Has(not_varied_b, group) &&
        std::ranges::none_of(comparison.differences,
                             [&](const auto& of) { return IsIn(of.first, group); }))
      comparison.not_varied.push_back(group);
  return comparison;
}

}  // namespace turbidock::compare
