#include "experiments/studies/compare/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "experiments/config/nearest_name.h"
#include "experiments/farm/summary.h"
#include "experiments/statistics/paired_tests.h"
#include "sim/base/check.h"

namespace turbidock::compare {
namespace {

bool Has(const std::vector<std::string>& list, const std::string& word) {
  return std::find(list.begin(), list.end(), word) != list.end();
}

void RequireKnown(const std::vector<std::string>& words, const std::vector<std::string>& known) {
  for (const std::string& word : words)
    if (!Has(known, word))
      throw ConfigError(word + ": is no parameter of these results" +
                        config::DidYouMean(word, known));
}

std::string Text(const std::vector<farm::Parameter>& parameters) {
  std::vector<std::string> assignments;
  for (const farm::Parameter& p : parameters) assignments.push_back(p.Assignment());
  return fmt::format("{}", fmt::join(assignments, " "));
}

// Trials by what a partner must share.
using Key = std::pair<std::string, int64_t>;  // parameters, seed

// With those of their parameters that have these keys.
std::map<Key, farm::StoredTrial> ByKey(const farm::ResultStore& store,
                                       const std::vector<std::string>& keys) {
  std::map<Key, farm::StoredTrial> trials;
  for (farm::StoredTrial& trial : store.Trials()) {
    if (!trial.record.ended()) continue;
    std::erase_if(trial.parameters, [&](const farm::Parameter& p) { return !Has(keys, p.key); });
    std::ranges::sort(trial.parameters, {}, &farm::Parameter::key);
    const Key key{Text(trial.parameters), trial.record.seed};
    if (!trials.emplace(key, std::move(trial)).second)
      throw ConfigError(
          fmt::format("several trials have the seed {}{}: they differ in a parameter "
                      "that the other set does not have",
                      key.second, key.first.empty() ? "" : " and " + key.first));
  }
  return trials;
}

std::vector<trial::Metric> KnownMetrics() {
  std::vector<trial::Metric> known = trial::Metrics();
  known.push_back({"final_error_m", [](const trial::TrialRecord& record) {
                     return std::optional(record.final_error_true.distance_m());
                   }});
  return known;
}

}  // namespace

std::vector<TrialPair> PairTrials(const farm::ResultStore& a, const farm::ResultStore& b,
                                  const ComparisonOptions& options) {
  std::vector<std::string> keys, shared;
  for (const farm::ResultStore* store : {&a, &b})
    for (const std::string& key : store->header().keys) keys.push_back(key);
  RequireKnown(options.ignore, keys);
  for (const std::string& key : a.header().keys)
    if (Has(b.header().keys, key) && !Has(options.ignore, key)) shared.push_back(key);
  RequireKnown(options.by, shared);

  const std::map<Key, farm::StoredTrial> in_a = ByKey(a, shared), in_b = ByKey(b, shared);
  std::vector<TrialPair> pairs;
  for (const auto& [key, trial] : in_a)
    if (const auto partner = in_b.find(key); partner != in_b.end())
      pairs.push_back({trial.parameters, trial.record, partner->second.record, trial.trial,
                       partner->second.trial});
  if (pairs.empty())
    throw ConfigError("no trial of one set has the seed and parameters of one of the other");
  return pairs;
}

RateComparison CompareRates(const std::vector<TrialPair>& pairs) {
  RateComparison c;
  c.pairs = std::ssize(pairs);
  c.lost = std::ranges::count_if(pairs, &TrialPair::lost);
  c.gained = std::ranges::count_if(pairs, &TrialPair::gained);
  const auto n = static_cast<double>(c.pairs);
  const auto in_a = std::ranges::count_if(pairs, [](const auto& p) { return p.a.success(); });
  c.rate_a = static_cast<double>(in_a) / n;
  c.rate_b = static_cast<double>(in_a - c.lost + c.gained) / n;
  c.difference = c.rate_b - c.rate_a;
  c.interval_95 = statistics::RateDifferenceInterval(c.lost, c.gained, c.pairs);
  c.p_value = statistics::McNemarExactP(c.lost, c.gained);
  return c;
}

trial::Metric MetricNamed(const std::string& name) {
  std::vector<std::string> names;
  for (const trial::Metric& figure : KnownMetrics()) {
    if (figure.name == name) return figure;
    names.push_back(figure.name);
  }
  throw ConfigError(name + ": is no metric of these results" + config::DidYouMean(name, names));
}

MetricComparison CompareMetric(const std::vector<TrialPair>& pairs, const trial::Metric& metric) {
  MetricComparison c;
  c.metric = metric.name;
  std::vector<double> in_a, in_b, differences;
  for (const TrialPair& pair : pairs) {
    const auto a = metric.of(pair.a), b = metric.of(pair.b);
    if (!pair.a.success() || !pair.b.success() || !a || !b) continue;
    in_a.push_back(*a);
    in_b.push_back(*b);
    differences.push_back(*b - *a);
    c.larger += *b > *a;
    c.smaller += *b < *a;
  }
  std::sort(differences.begin(), differences.end());
  c.pairs = std::ssize(differences);
  c.median_a = statistics::Median(std::move(in_a));
  c.median_b = statistics::Median(std::move(in_b));
  c.interval_95 = statistics::MedianInterval(differences);
  c.median_difference = statistics::Median(std::move(differences));
  c.larger_share_interval_95 = statistics::WilsonInterval(c.larger, c.larger + c.smaller);
  c.p_value = statistics::McNemarExactP(c.larger, c.smaller);
  return c;
}

std::vector<ComparisonGroup> GroupPairs(const std::vector<TrialPair>& pairs,
                                        const std::vector<std::string>& by) {
  std::vector<ComparisonGroup> groups;
  std::map<std::string, size_t> index;
  for (const TrialPair& pair : pairs) {
    std::vector<farm::Parameter> key;
    for (const std::string& name : by)
      for (const farm::Parameter& parameter : pair.parameters)
        if (parameter.key == name) key.push_back(parameter);
    const auto [place, is_new] = index.emplace(Text(key), groups.size());
    if (is_new) groups.push_back({.key = key, .pairs = {}});
    groups[place->second].pairs.push_back(pair);
  }
  std::ranges::sort(groups, farm::LessByValue, [](const ComparisonGroup& group) {
    std::vector<std::string> values;
    for (const farm::Parameter& parameter : group.key) values.push_back(parameter.value);
    return values;
  });
  return groups;
}

std::string ComparisonGroup::Name() const { return key.empty() ? "all" : Text(key); }

void MarkSignificant(Comparison* comparison) {
  const auto mark = [](const auto& family) {
    std::vector<double> p_values;
    for (const auto* test : family) p_values.push_back(test->p_value);
    const std::vector<bool> significant = statistics::HolmSignificant(p_values);
    for (size_t i = 0; i < family.size(); ++i) family[i]->significant = significant[i];
  };
  std::vector<RateComparison*> rates;
  std::vector<MetricComparison*> metrics;
  for (ComparisonGroup& group : comparison->groups) {
    rates.push_back(&group.docked);
    for (MetricComparison& metric : group.metrics)
      if (metric.pairs > 0) metrics.push_back(&metric);
  }
  if (comparison->has_several()) rates.push_back(&comparison->all);
  mark(rates);
  mark(metrics);
  if (!comparison->has_several()) comparison->all = comparison->groups[0].docked;
}

Comparison Compare(const ComparedFile& a, const ComparedFile& b, const ComparisonOptions& options) {
  std::vector<trial::Metric> metrics;
  for (const std::string& name : options.metrics) metrics.push_back(MetricNamed(name));
  if (metrics.empty()) metrics = KnownMetrics();
  const std::vector<TrialPair> pairs = PairTrials(a.store, b.store, options);
  Comparison comparison{.a = a.file,
                        .b = b.file,
                        .build_a = a.store.header().build,
                        .build_b = b.store.header().build,
                        .options = options,
                        .groups = GroupPairs(pairs, options.by),
                        .all = CompareRates(pairs)};
  for (ComparisonGroup& group : comparison.groups) {
    group.docked = CompareRates(group.pairs);
    for (const trial::Metric& metric : metrics)
      group.metrics.push_back(CompareMetric(group.pairs, metric));
  }
  MarkSignificant(&comparison);
  return comparison;
}

}  // namespace turbidock::compare
