#include "experiments/studies/compare/comparison.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>

#include "experiments/batch/batch_report.h"
#include "experiments/batch/summary.h"
#include "experiments/config/nearest_name.h"
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

// Those that came to an end of their own.
std::vector<batch::StoredTrial> EndedOf(const batch::ResultStore& store) {
  std::vector<batch::StoredTrial> trials = store.Trials();
  std::erase_if(trials, [](const batch::StoredTrial& trial) { return !trial.record.ended(); });
  return trials;
}

// Those of a trial's parameters that have these keys, by key.
std::vector<batch::Parameter> ParametersOf(const batch::StoredTrial& trial,
                                           const std::vector<std::string>& keys) {
  std::vector<batch::Parameter> parameters = trial.parameters;
  std::erase_if(parameters, [&keys](const batch::Parameter& p) { return !Has(keys, p.key); });
  std::ranges::sort(parameters, {}, &batch::Parameter::key);
  return parameters;
}

using ByKey = std::map<Key, std::vector<const batch::StoredTrial*>>;
ByKey InGroups(const std::vector<batch::StoredTrial>& trials,
               const std::vector<std::string>& keys) {
  ByKey groups;
  for (const batch::StoredTrial& trial : trials) {
    std::vector<batch::Parameter> canonical = ParametersOf(trial, keys);
    for (batch::Parameter& parameter : canonical) parameter.value = CanonicalValue(parameter);
    groups[{Text(canonical), trial.record.seed}].push_back(&trial);
  }
  return groups;
}

// The keys in which trials of a group differ.
std::set<std::string> TellingKeys(const ByKey& groups) {
  std::set<std::string> telling;
  for (const auto& [key, trials] : groups)
    for (const batch::StoredTrial* trial : trials)
      for (size_t i = 0; i < trial->parameters.size(); ++i)
        if (!(trial->parameters[i] == trials.front()->parameters[i]))
          telling.insert(trial->parameters[i].key);
  return telling;
}

// Gives a set's trials their scenarios' values of those of these keys that the set does not vary;
// false where its plan cannot tell them.
bool AddValues(const batch::ResultStore& store, std::vector<std::string> keys,
               const trial::Plugins& plugins, std::vector<batch::StoredTrial>* trials) {
  std::erase_if(keys, [&](const std::string& key) { return Has(store.header().keys, key); });
  if (keys.empty()) return true;
  if (!store.header().is_of_plan()) return false;
  try {
    const batch::Plan plan(store.PlanHere(), store.file(), {.plugins = plugins});
    for (batch::StoredTrial& trial : *trials) {
      const trial::Scenario scenario = plan.ScenarioOf(plan.Trial(trial.trial));
      for (const std::string& key : keys)
        trial.parameters.push_back({key, config::TextOf(scenario, key)});
    }
    return true;
  } catch (const ConfigError&) {
    return false;
  }
}

void RequireOneEach(const ByKey& groups, const batch::ResultStore& store,
                    const std::vector<std::string>& keys) {
  std::vector<std::string> others = store.header().keys;
  std::erase_if(others, [&keys](const std::string& key) { return Has(keys, key); });
  for (const auto& [key, trials] : groups)
    if (trials.size() > 1)
      throw ConfigError(fmt::format(
          "{}: several trials have the seed {}{}: they differ in {}, which tells no pairs apart "
          "(the other set does not vary it, or --ignore leaves it out)",
          store.file(), key.second, key.first.empty() ? "" : " and " + key.first,
          fmt::join(others, ", ")));
}

}  // namespace

std::vector<TrialPair> PairTrials(const batch::ResultStore& a, const batch::ResultStore& b,
                                  const ComparisonOptions& options) {
  std::vector<std::string> scenario_keys, keys = a.header().keys, shared;
  for (const config::KeyDoc& doc : trial::ScenarioKeys(options.plugins))
    scenario_keys.push_back(doc.key);
  for (const std::string& key : keys)
    if (Has(b.header().keys, key) && !Has(options.ignore, key)) shared.push_back(key);
  std::vector<batch::StoredTrial> of_a = EndedOf(a), of_b = EndedOf(b);
  for (const auto& [store, ended] : {std::pair(&a, &of_a), std::pair(&b, &of_b)})
    if (ended->empty())
      throw ConfigError(store->file() +
                        ": none of its trials came to an end of its own: nothing to compare");
  std::vector<std::string> telling;
  for (const ByKey& groups : {InGroups(of_a, shared), InGroups(of_b, shared)})
    for (const std::string& key : TellingKeys(groups))
      if (Has(scenario_keys, key) && !Has(options.ignore, key)) telling.push_back(key);
  if (AddValues(a, telling, options.plugins, &of_a) &&
      AddValues(b, telling, options.plugins, &of_b))
    shared.insert(shared.end(), telling.begin(), telling.end());
  keys.insert(keys.end(), b.header().keys.begin(), b.header().keys.end());
  keys.insert(keys.end(), scenario_keys.begin(), scenario_keys.end());
  RequireKnown(options.ignore, keys);
  RequireKnown(options.by, shared);

  const ByKey in_a = InGroups(of_a, shared), in_b = InGroups(of_b, shared);
  RequireOneEach(in_a, a, shared);
  RequireOneEach(in_b, b, shared);
  std::vector<TrialPair> pairs;
  std::set<int64_t> seeds;
  for (const auto& [key, trials] : in_a) {
    seeds.insert(key.second);
    if (const auto partner = in_b.find(key); partner != in_b.end()) {
      const batch::StoredTrial &one = *trials.front(), &other = *partner->second.front();
      pairs.push_back(
          {ParametersOf(one, shared), one.record, other.record, one.trial, other.trial});
    }
  }
  if (!pairs.empty()) return pairs;
  for (const auto& [key, trials] : in_b)
    if (seeds.contains(key.second))
      throw ConfigError(
          fmt::format("no trial of one set has the seed and parameters of one of the other; give "
                      "--ignore those in which they are meant to differ, of {}",
                      fmt::join(shared, ", ")));
  throw ConfigError(
      "no trial of one set has the seed of one of the other; run both with the same master_seed");
}

Comparison ComparePairs(const std::vector<TrialPair>& pairs, const ComparisonOptions& options) {
  Comparison comparison;
  comparison.options = options;
  batch::PairedTrials all;
  std::map<std::vector<std::string>, batch::PairedTrials, decltype(&batch::LessByValue)> groups(
      &batch::LessByValue);  // by the values of options.by
  for (const TrialPair& pair : pairs) {
    const batch::ComparedTrial a = batch::TrialOf(pair.a), b = batch::TrialOf(pair.b);
    all.Add(a, b);
    std::vector<std::string> values;
    for (const std::string& key : options.by)
      values.push_back(std::ranges::find(pair.parameters, key, &batch::Parameter::key)->value);
    if (!values.empty()) groups[values].Add(a, b);
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
  comparison.changes = all.Changes("all");
  batch::MarkSignificant(&comparison.changes);
  comparison.least_difference_seen = statistics::LeastDifferenceSeen(
      std::lround(static_cast<double>(pairs.size()) / comparison.all().cluster_effect),
      static_cast<double>(comparison.flips.size()) / static_cast<double>(pairs.size()));
  std::vector<batch::Change> rows;
  for (const auto& [values, of] : groups) {
    std::vector<batch::Parameter> parameters;
    for (size_t i = 0; i < values.size(); ++i) parameters.push_back({options.by[i], values[i]});
    for (batch::Change& change : of.Changes(Text(parameters))) {
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
  const auto count = [&](const batch::ResultStore& store, int64_t* left_out, int64_t* unended) {
    const std::vector<batch::StoredTrial> trials = store.Trials();
    *left_out = std::ssize(trials) - std::ssize(pairs);
    *unended = std::ranges::count_if(trials, [](const auto& t) { return !t.record.ended(); });
  };
  count(a.store, &comparison.left_out_a, &comparison.unended_a);
  count(b.store, &comparison.left_out_b, &comparison.unended_b);
  comparison.a = a.file;
  comparison.b = b.file;
  comparison.build_a = a.store.header().build;
  comparison.build_b = b.store.header().build;
  comparison.differences = batch::DifferencesOf(a.store.header().plan, b.store.header().plan);
  const std::vector<std::string> not_varied_b = batch::NotVaried(b.store.header());
  for (const std::string& group : batch::NotVaried(a.store.header()))
    if (Has(not_varied_b, group) &&
        std::ranges::none_of(comparison.differences,
                             [&](const auto& of) { return IsIn(of.first, group); }))
      comparison.not_varied.push_back(group);
  return comparison;
}

}  // namespace turbidock::compare
