#include "experiments/studies/compare/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <map>
#include <utility>

#include "experiments/config/nearest_name.h"
#include "experiments/media/figure.h"
#include "experiments/report/json.h"
#include "experiments/statistics/paired_tests.h"
#include "sim/base/check.h"

namespace turbidock::compare {
namespace {

constexpr double kTail = 0.025;  // of a 95 % interval

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

using report::Json;

Json FlippedJson(const std::vector<TrialPair>& pairs, bool lost) {
  Json list = Json::array();
  for (const TrialPair& pair : Flipped(pairs, lost))
    list.push_back({{"seed", pair.a.seed},
                    {"trial_a", pair.trial_a},
                    {"trial_b", pair.trial_b},
                    {"failure", lost ? pair.b.failure : pair.a.failure}});
  return list;
}

Json ToJson(const ComparisonGroup& group, const std::vector<trial::Metric>& metrics) {
  Json key = Json::object(), list = Json::array();
  for (const farm::Parameter& parameter : group.key) key[parameter.key] = parameter.value;
  for (const trial::Metric& metric : metrics) list.push_back(CompareMetric(group.pairs, metric));
  Json json = {{"group", key}};
  json.update(CompareRates(group.pairs));
  json["lost"] = FlippedJson(group.pairs, true);
  json["gained"] = FlippedJson(group.pairs, false);
  json["metrics"] = list;
  return json;
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
  int64_t both = 0;
  for (const TrialPair& pair : pairs) {
    c.lost += pair.a.success() && !pair.b.success();
    c.gained += !pair.a.success() && pair.b.success();
    both += pair.a.success() && pair.b.success();
  }
  if (c.pairs == 0) return c;
  const auto n = static_cast<double>(c.pairs);
  c.rate_a = static_cast<double>(both + c.lost) / n;
  c.rate_b = static_cast<double>(both + c.gained) / n;
  c.difference = c.rate_b - c.rate_a;
  const double lost = static_cast<double>(c.lost) + 0.5,
               gained = static_cast<double>(c.gained) + 0.5;
  const double total = n + 2, middle = (gained - lost) / total;
  const double z = boost::math::quantile(boost::math::normal(), 1 - kTail);
  const double half =
      z * std::sqrt(lost + gained - (gained - lost) * (gained - lost) / total) / total;
  c.interval_95 = {std::max(-1.0, middle - half), std::min(1.0, middle + half)};
  c.p_value = statistics::McNemarExactP(c.lost, c.gained);
  return c;
}

trial::Metric MetricNamed(const std::string& name) {
  std::vector<trial::Metric> known = trial::Metrics();
  known.push_back({"final_error_m", [](const trial::TrialRecord& record) {
                     return std::optional(record.final_error_true.distance_m());
                   }});
  std::vector<std::string> names;
  for (const trial::Metric& metric : known) {
    if (metric.name == name) return metric;
    names.push_back(metric.name);
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
    if (is_new) groups.push_back({key, {}});
    groups[place->second].pairs.push_back(pair);
  }
  return groups;
}

std::string GroupName(const ComparisonGroup& group) {
  return group.key.empty() ? "all" : Text(group.key);
}

std::vector<TrialPair> Flipped(const std::vector<TrialPair>& pairs, bool lost) {
  std::vector<TrialPair> flipped;
  for (const TrialPair& pair : pairs)
    if (pair.a.success() != pair.b.success() && pair.a.success() == lost) flipped.push_back(pair);
  return flipped;
}

std::string ComparisonJson(const std::string& name_a, const std::string& name_b,
                           const farm::ResultStore& a, const farm::ResultStore& b,
                           const std::vector<ComparisonGroup>& groups,
                           const std::vector<trial::Metric>& metrics) {
  Json list = Json::array();
  for (const ComparisonGroup& group : groups) list.push_back(ToJson(group, metrics));
  int64_t pairs = 0;
  for (const ComparisonGroup& group : groups) pairs += std::ssize(group.pairs);
  return report::JsonText({{"a", name_a},
                           {"b", name_b},
                           {"build_a", a.header().build},
                           {"build_b", b.header().build},
                           {"pairs", pairs},
                           {"groups", list}});
}

void WriteComparisonFigure(const std::string& path, const std::vector<ComparisonGroup>& groups,
                           const std::string& name_a, const std::string& name_b) {
  // Paths are too long for it; the other panel's axes name both.
  report::Panel rates{.title = "success rate, the second less the first",
                      .x = {"percentage points, 95 %", -100, 100},
                      .y = {"", static_cast<double>(groups.size()) - 0.4, -0.6},
                      .series = {{.mark = report::Mark::kBarsAlongX}},
                      .rules = {{.at = 0, .is_up = true}}};
  std::vector<report::Sample> times;
  double longest_s = 1;
  for (const ComparisonGroup& group : groups) {
    const RateComparison c = CompareRates(group.pairs);
    rates.series[0].points.push_back({100 * c.difference, static_cast<double>(rates.y.names.size()),
                                      100 * c.interval_95.low, 100 * c.interval_95.high});
    rates.y.names.push_back(GroupName(group));
    for (const TrialPair& pair : group.pairs) {
      if (!pair.a.success() || !pair.b.success()) continue;
      times.push_back({pair.a.time_s, pair.b.time_s});
      longest_s = std::max({longest_s, pair.a.time_s, pair.b.time_s});
    }
  }
  const double end_s = 1.05 * longest_s;
  const report::Panel docked{.title = "time to dock of pairs that docked in both",
                             .x = {name_a + " (s)", 0, end_s},
                             .y = {name_b + " (s)", 0, end_s},
                             .series = {{"", {{0, 0}, {end_s, end_s}}, report::kGrey},
                                        {"", times, report::CurveColor(0), report::Mark::kDots}}};
  media::WriteFigure(path,
                     {.columns = 2, .width_px = 700, .height_px = 600, .panels = {rates, docked}});
}

}  // namespace turbidock::compare
