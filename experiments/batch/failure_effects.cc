#include "experiments/batch/failure_effects.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <utility>

#include "experiments/batch/summary.h"
#include "experiments/statistics/logistic.h"
#include "experiments/statistics/paired_tests.h"
#include "experiments/trial/record_columns.h"

namespace turbidock::batch {
namespace {

using Trials = std::vector<StoredTrial>;

constexpr int64_t kFewestOfAKind = 5;  // to say something of it
constexpr size_t kMostRows = 10;

bool HasFailed(const StoredTrial& trial) { return !trial.record.success(); }

// Adds what so much more of a number, which not every trial has, does to the odds of failing.
void AddEffect(const Trials& trials, const std::vector<std::optional<double>>& numbers, double more,
               const std::string& name, const std::string& change,
               std::vector<FailureEffect>* effects) {
  std::vector<statistics::BinomialPoint> points;
  std::vector<int64_t> seeds;
  for (size_t i = 0; i < trials.size(); ++i) {
    if (!numbers[i]) continue;
    points.push_back({*numbers[i], HasFailed(trials[i]) ? 1 : 0, 1});
    seeds.push_back(trials[i].record.seed);
  }
  if (const auto fit = statistics::FitSlope(points, seeds))
    effects->push_back({.name = name,
                        .change = change,
                        .odds = std::exp(fit->slope * more),
                        .odds_low = std::exp(fit->low * more),
                        .odds_high = std::exp(fit->high * more),
                        .p = fit->p});
}

void AddNumber(const Trials& trials, const std::vector<std::optional<double>>& numbers,
               const std::string& key, const std::string& name,
               std::vector<FailureEffect>* effects) {
  std::vector<double> values;
  for (const std::optional<double>& number : numbers)
    if (number) values.push_back(*number);
  if (values.empty()) return;
  double low = *statistics::Quantile(values, 0.25), high = *statistics::Quantile(values, 0.75);
  if (low == high) {
    low = std::ranges::min(values);
    high = std::ranges::max(values);
  }
  const report::Quantity quantity = NameOfKey(key);
  const std::string change = quantity.Text(fmt::format(
      "{} to {}", report::Digits(quantity.factor * low), report::Digits(quantity.factor * high)));
  AddEffect(trials, numbers, high - low, name, change, effects);
}

// Each value of a parameter that is no number; of two only the one that fails more often.
void AddValues(const Trials& trials, const std::vector<std::string>& values,
               const std::string& name, std::vector<FailureEffect>* effects) {
  std::map<std::string, statistics::Count> failures;
  for (size_t i = 0; i < trials.size(); ++i) {
    failures[values[i]].successes += HasFailed(trials[i]);
    ++failures[values[i]].trials;
  }
  const auto rate = [](const auto& value) {
    return static_cast<double>(value.second.successes) / static_cast<double>(value.second.trials);
  };
  const auto worst = std::ranges::max_element(failures, {}, rate);
  for (auto at = failures.begin(); at != failures.end(); ++at) {
    const int64_t have = at->second.trials;
    if (have < kFewestOfAKind || std::ssize(trials) - have < kFewestOfAKind) continue;
    if (failures.size() == 2 && at != worst) continue;
    std::vector<std::optional<double>> is_it(values.size());
    std::ranges::transform(values, is_it.begin(),
                           [&](const std::string& value) { return value == at->first ? 1 : 0; });
    AddEffect(trials, is_it, 1, fmt::format("{}: {}", name, at->first), "against the others",
              effects);
  }
}

void AddParameter(const Trials& trials, const std::string& key,
                  std::vector<FailureEffect>* effects) {
  std::vector<std::string> values;
  std::vector<std::optional<double>> numbers;
  for (const StoredTrial& trial : trials) {
    const auto at = std::ranges::find(trial.parameters, key, &Parameter::key);
    values.push_back(at == trial.parameters.end() ? "" : at->value);
    numbers.push_back(report::NumberIn(values.back()));
  }
  const std::string name = NameOfKey(key).label;
  if (std::ranges::all_of(numbers, [](const auto& number) { return number.has_value(); }))
    AddNumber(trials, numbers, key, name, effects);
  else
    AddValues(trials, values, name, effects);
}

std::string OddsText(double odds) {
  return odds > 999 ? ">999" : odds < 0.001 ? "<0.001" : report::Digits(odds, 2 + (odds >= 100));
}

}  // namespace

std::vector<FailureEffect> FailureEffects(const Trials& trials) {
  const int64_t failed = std::ranges::count_if(trials, HasFailed);
  if (std::min(failed, std::ssize(trials) - failed) < kFewestOfAKind) return {};
  std::vector<FailureEffect> effects;
  for (const Parameter& parameter : trials.front().parameters)
    AddParameter(trials, parameter.key, &effects);
  for (const trial::Metric& metric : trial::Metrics()) {
    if (!metric.name.starts_with("start_")) continue;
    std::vector<std::optional<double>> off;
    for (const StoredTrial& trial : trials) {
      const auto start = metric.of(trial.record);
      off.push_back(start ? std::optional(std::abs(*start)) : std::nullopt);
    }
    AddNumber(trials, off, metric.name, "|" + NameOfKey(metric.name).label + "|", &effects);
  }
  std::ranges::stable_sort(effects, {}, &FailureEffect::p);
  std::vector<double> p_values(effects.size());
  std::ranges::transform(effects, p_values.begin(), &FailureEffect::p);
  const std::vector<bool> significant = statistics::HolmSignificant(p_values);
  for (size_t i = 0; i < effects.size(); ++i) effects[i].significant = significant[i];
  return effects;
}

std::optional<report::Section> FailureSection(const std::vector<FailureEffect>& effects) {
  if (effects.empty()) return std::nullopt;
  report::Section section{
      .title = "What goes with failures",
      .note =
          "Odds of failing: so many times higher after the change, each quantity on its own, "
          "with 95 % intervals (Firth's logistic regression, profile likelihood). Numbers "
          "change from their lower to their upper quartile. Significant: Holm at 5 %."};
  if (!effects.front().significant)
    section.lines.emplace_back(
        "No starting condition and nothing that was varied explains the "
        "failures.");
  report::Table table(
      {"<quantity", "<change", "odds of failing, times", "interval", "p", "<significant"});
  for (const FailureEffect& effect : std::span(effects).first(std::min(effects.size(), kMostRows)))
    table.Row({effect.name, effect.change, OddsText(effect.odds),
               fmt::format("{}-{}", OddsText(effect.odds_low), OddsText(effect.odds_high)),
               report::PValue(effect.p), effect.significant ? "yes" : "no"});
  if (effects.size() > kMostRows)
    section.lines.push_back(
        fmt::format("{} more go with failures less.", effects.size() - kMostRows));
  section.table = table;
  return section;
}

}  // namespace turbidock::batch
