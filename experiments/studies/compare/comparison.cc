#include "experiments/studies/compare/comparison.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <set>
#include <utility>

#include "experiments/batch/batch_report.h"
#include "experiments/batch/summary.h"
#include "experiments/config/nearest_name.h"
#include "experiments/config/yaml_node.h"
#include "experiments/statistics/paired_tests.h"
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
      throw ConfigError(word + ": is no parameter that both sets have and --ignore leaves" +
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
  std::vector<std::string> others = store.header().keys;
  std::erase_if(others, [&keys](const std::string& key) { return Has(keys, key); });
  for (batch::StoredTrial& trial : store.Trials()) {
    if (!trial.record.ended()) continue;
    std::erase_if(trial.parameters, [&](const batch::Parameter& p) { return !Has(keys, p.key); });
    std::ranges::sort(trial.parameters, {}, &batch::Parameter::key);
    std::vector<batch::Parameter> canonical = trial.parameters;
    for (batch::Parameter& parameter : canonical) parameter.value = CanonicalValue(parameter);
    const Key key{Text(canonical), trial.record.seed};
    if (!trials.emplace(key, std::move(trial)).second)
      throw ConfigError(fmt::format(
          "{}: several trials have the seed {}{}: they differ in what the other set does "
          "not vary ({})",
          store.file(), key.second, key.first.empty() ? "" : " and " + key.first,
          fmt::join(others, ", ")));
  }
  return trials;
}

// By the values of these parameters.
auto GroupPairs(const std::vector<TrialPair>& pairs, const std::vector<std::string>& by) {
  std::map<std::vector<std::string>, std::vector<TrialPair>, decltype(&batch::LessByValue)> groups(
      &batch::LessByValue);
  for (const TrialPair& pair : pairs) {
    std::vector<std::string> values;
    values.reserve(by.size());
    for (const std::string& name : by)
      values.push_back(std::ranges::find(pair.parameters, name, &batch::Parameter::key)->value);
    groups[values].push_back(pair);
  }
  return groups;
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

std::vector<TrialPair> PairTrials(const batch::ResultStore& a, const batch::ResultStore& b,
                                  const ComparisonOptions& options) {
  std::vector<std::string> keys = a.header().keys, shared;
  for (const std::string& key : keys)
    if (Has(b.header().keys, key) && !Has(options.ignore, key)) shared.push_back(key);
  keys.insert(keys.end(), b.header().keys.begin(), b.header().keys.end());
  for (const config::KeyDoc& doc : trial::ScenarioKeys()) keys.push_back(doc.key);
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
    const bool lost = pair.a.success();
    if (lost == pair.b.success()) continue;
    comparison.flips.push_back({.seed = pair.a.seed,
                                .change = lost ? batch::FlipKind::kLost : batch::FlipKind::kGained,
                                .group = batch::Named(pair.parameters),
                                .why = NameOf((lost ? pair.b : pair.a).failure),
                                .link = fmt::format("{}-{}", pair.trial_a, pair.trial_b),
                                .trial_a = pair.trial_a,
                                .trial_b = pair.trial_b});
  }
  std::ranges::stable_sort(comparison.flips, {}, &batch::Flip::change);
  const auto changes_of = [](const std::vector<TrialPair>& of, const std::string& group) {
    batch::PairedTrials paired;
    for (const TrialPair& pair : of) paired.Add(batch::TrialOf(pair.a), batch::TrialOf(pair.b));
    return paired.Changes(group);
  };
  comparison.changes = changes_of(pairs, "all");
  batch::MarkSignificant(&comparison.changes);
  comparison.least_difference_seen = statistics::LeastDifferenceSeen(
      std::lround(static_cast<double>(pairs.size()) / comparison.all().cluster_effect),
      static_cast<double>(comparison.flips.size()) / static_cast<double>(pairs.size()));
  if (options.by.empty()) return comparison;
  std::vector<batch::Change> rows;
  for (const auto& [values, of] : GroupPairs(pairs, options.by)) {
    std::vector<batch::Parameter> parameters;
    for (size_t i = 0; i < values.size(); ++i) parameters.push_back({options.by[i], values[i]});
    for (batch::Change& change : changes_of(of, Text(parameters))) {
      change.parameters = parameters;
      rows.push_back(std::move(change));
    }
  }
  batch::MarkSignificant(&rows);
  std::ranges::move(rows, std::back_inserter(comparison.changes));
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
