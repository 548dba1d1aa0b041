#include "experiments/batch/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <tuple>

#include "experiments/batch/summary.h"
#include "experiments/report/table.h"
#include "experiments/statistics/paired_tests.h"

namespace turbidock::batch {
namespace {

using report::Cell;
using report::Tone;
using statistics::MeasureKind;
using statistics::PairedDesign;
using statistics::Verdict;

std::optional<PairedDesign> DesignOf(const std::optional<JudgeOptions>& options, double margin) {
  if (!options || margin == 0) return std::nullopt;
  return PairedDesign{.margin = margin,
                      .alpha = options->alpha,
                      .beta = options->beta,
                      .most = options->max_trials};
}

constexpr const char* kFlipTitle = "Seeds that changed";

// Less is worse.
bool IsWorseBelow(const std::string& measure) {
  const auto known =
      std::ranges::find_if(kMeasures, [&measure](const Measure& of) { return measure == of.name; });
  return known == kMeasures.end() || known->worse < 0;
}

// For the worse or the better, as far as it is known.
Tone ToneOf(const Change& change) {
  if (change.verdict == Verdict::kPass) return Tone::kGood;
  if (change.verdict == Verdict::kFail) return Tone::kBad;
  if (!change.significant) return Tone::kNone;
  return (change.difference < 0) == IsWorseBelow(change.measure) ? Tone::kBad : Tone::kGood;
}

std::string SaidOf(const Change& change) {
  if (change.margin) return NameOf(*change.verdict);
  return change.significant ? "significant" : "";
}

// "controller lqg" or "calm".
std::string GroupOf(const Change& change) {
  return change.parameters.empty() ? change.group : Named(change.parameters);
}

// Each difference with its interval, as far as it is for the worse, the worst on top: in margins
// where there are any, else success in points and medians in per cent of those of A.
report::Panel ChangePanel(const std::vector<Change>& changes, const Sides& sides, bool is_judged) {
  struct Row {
    const Change* change;
    report::Sample at;  // y is still to come
  };
  std::vector<Row> rows;
  for (const Change& c : changes) {
    const double percent = (c.is_rate() ? 1 : std::abs(c.a.value_or(0))) / 100;
    const double unit = c.margin.value_or(is_judged ? 0 : percent);
    if (!c.difference || !(unit > 0)) continue;
    const double scale = (IsWorseBelow(c.measure) ? -1 : 1) / unit;
    report::Sample at{scale * *c.difference};
    if (c.interval_95)
      std::tie(at.low, at.high) =
          std::minmax({scale * c.interval_95->low, scale * c.interval_95->high});
    rows.push_back({&c, at});
  }
  std::ranges::stable_sort(rows, std::greater(), [](const Row& row) { return row.at.x; });
  constexpr size_t kMost = 40;
  const size_t all = rows.size();
  rows.resize(std::min(all, kMost));
  report::Panel panel{
      .title = is_judged ? "" : fmt::format("points; medians in % of {}", sides.a),
      .x = {.label = is_judged ? "change for the worse, in margins" : "change for the worse"},
      .y = {.low = static_cast<double>(rows.size()) - 0.4, .high = -0.6},  // downwards
      .rules = {{.at = 0, .mark = report::Mark::kLine, .is_up = true}},
      .legend = true};
  if (is_judged) panel.rules.push_back({.at = 1, .name = "margin", .is_up = true});
  if (all > kMost) panel.title += fmt::format(" (the {} worst of {} rows)", kMost, all);
  panel.series = {{.name = is_judged ? "fail" : "worse", .color = report::CurveColor(1)},
                  {.name = is_judged ? "inconclusive" : "not significant", .color = report::kGrey},
                  {.name = is_judged ? "pass" : "better", .color = report::CurveColor(2)}};
  double low = 0, high = is_judged ? 1 : 0;
  for (auto& [c, at] : rows) {
    const Tone tone = ToneOf(*c);
    report::Series& series = panel.series[tone == Tone::kBad ? 0 : tone == Tone::kNone ? 1 : 2];
    at.y = static_cast<double>(panel.y.names.size());
    low = std::fmin(std::fmin(low, at.x), at.low);  // of which one may be missing
    high = std::fmax(std::fmax(high, at.x), at.high);
    series.points.push_back(at);
    series.links.push_back(fmt::format("#{}#{}", kFlipTitle, GroupOf(*c)));
    panel.y.names.push_back(GroupOf(*c) + ": " + QuantityOf(c->measure).label);
  }
  panel.x.low = low - 0.04 * (high - low) - 1e-9;
  panel.x.high = high + 0.04 * (high - low) + 1e-9;
  for (report::Series& series : panel.series) {
    series.mark = report::Mark::kBarsAcross;
    series.dot_px = 8;
  }
  std::erase_if(panel.series, [](const report::Series& series) { return series.points.empty(); });
  return panel;
}

}  // namespace

ComparedTrial TrialOf(const trial::TrialRecord& record) {
  ComparedTrial trial{.seed = record.seed, .outcome = record.outcome, .digest = record.digest};
  for (size_t i = 0; i < kMeasures.size(); ++i) trial.values[i] = kMeasures[i].of(record);
  return trial;
}

int Margins::tests() const {
  return 1 + static_cast<int>(std::ssize(medians) - std::ranges::count(medians, 0));
}

PairedTrials::PairedTrials(const std::optional<JudgeOptions>& options)
    : rate_(MeasureKind::kRate, -1,
            DesignOf(options, options ? options->margins.success_rate : 0)) {
  if (options) max_trials_ = options->max_trials;
  for (size_t i = 0; i < kMeasures.size(); ++i) {
    const double margin = options ? options->margins.medians[i] : 0;
    medians_.push_back(
        {.of = i, .pairs = {MeasureKind::kMedian, kMeasures[i].worse, DesignOf(options, margin)}});
  }
}

void PairedTrials::Add(const ComparedTrial& a, const ComparedTrial& b) {
  if (done()) return;
  ++pairs_;
  rate_.Add(a.success() ? 1 : 0, b.success() ? 1 : 0, pairs_, a.seed);
  if (!a.success() || !b.success()) return;
  for (Median& median : medians_) {
    const double was = a.values[median.of], is = b.values[median.of];
    if (!std::isnan(was) && !std::isnan(is)) median.pairs.Add(was, is, pairs_, a.seed);
  }
}

bool PairedTrials::done() const {
  if (pairs_ >= max_trials_) return true;
  const auto said = verdict();
  return said && *said != Verdict::kInconclusive;
}

std::optional<Verdict> PairedTrials::verdict() const {
  std::optional<Verdict> worst;
  const auto note = [&worst](const statistics::PairedMeasure& pairs) {
    if (pairs.is_judged())
      worst = std::min(worst.value_or(Verdict::kPass),
                       pairs.verdict().value_or(Verdict::kInconclusive));
  };
  note(rate_);
  for (const Median& median : medians_) note(median.pairs);
  return worst;
}

std::vector<Change> PairedTrials::Changes(const std::string& group) const {
  std::vector<Change> changes = {{rate_.Result(), group, kSuccessRate}};
  for (const Median& median : medians_)
    if (const statistics::PairedResult result = median.pairs.Result();
        rate_.is_judged() ? result.margin.has_value() : result.pairs > 0)
      changes.push_back({result, group, kMeasures[median.of].name});
  return changes;
}

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

report::Quantity QuantityOf(const std::string& measure) {
  if (measure == kSuccessRate) return {"success", "%", 100};
  if (measure == kArea) return {"area", "% of the ranges", 100};
  return report::QuantityOf(measure);
}

std::string Named(const std::vector<Parameter>& parameters) {
  std::string text;
  for (const auto& [key, value] : parameters) {
    const report::Quantity name = NameOfKey(key);
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name.label,
                        name.Text(ValueText(key, value)));
  }
  return text;
}

report::Section ChangeSection(std::vector<Change> changes, const Sides& sides) {
  const bool is_judged =
      std::ranges::any_of(changes, [](const Change& c) { return c.margin.has_value(); });
  report::Table table(is_judged
                          ? std::vector<std::string>{"<condition", "<measure", sides.a, sides.b,
                                                     "difference [95 %]", "margin", "pairs",
                                                     "worse", "better", "<verdict", "after"}
                          : std::vector<std::string>{"<group", "<measure", sides.a, sides.b,
                                                     "difference [95 %]", "pairs", "worse",
                                                     "better", "p", "<"});
  if (!is_judged)
    std::ranges::stable_sort(changes, {}, [](const Change& c) {
      return std::tuple(!c.significant, !c.is_rate(), c.p_value);
    });
  for (const Change& c : changes) {
    const report::Quantity quantity = QuantityOf(c.measure);
    const auto text = [&](const std::optional<double>& value) {
      return value ? report::Digits(*value * quantity.factor) : "-";
    };
    const auto change = [&](double value) {
      const std::string digits = report::Digits(value * quantity.factor, 3);
      return digits.front() == '-' ? digits : "+" + digits;
    };
    std::string difference = c.difference ? change(*c.difference) : "-";
    if (c.interval_95)
      difference +=
          fmt::format(" [{}, {}]", change(c.interval_95->low), change(c.interval_95->high));
    std::vector<Cell> row = {GroupOf(c), quantity.Title(), text(c.a), text(c.b), difference};
    if (is_judged)
      row.emplace_back(c.margin ? change(IsWorseBelow(c.measure) ? -*c.margin : *c.margin) : "-");
    for (const int64_t count : {c.pairs, c.worse, c.better})
      row.emplace_back(std::to_string(count));
    if (!is_judged) row.emplace_back(report::PValue(c.p_value));
    row.emplace_back(SaidOf(c), ToneOf(c));
    if (is_judged) row.emplace_back(c.decided_after ? std::to_string(*c.decided_after) : "-");
    table.Row(row);
  }
  return {
      .title = "What changed",
      .note = fmt::format(
          "Difference: {} less {} on the same seeds{}; medians are of the pairs that succeed in "
          "both, and the difference of a median is the median of the pairs' differences.{}",
          sides.b, sides.a,
          is_judged ? ""
                    : ", by exact McNemar and sign tests in which the pairs of a seed go together",
          is_judged ? " Margin: the change for the worse that matters. After: the trials after "
                      "which the verdict was known; an interval tells no more than the verdict."
                    : " Significant by Holm: 5 % over the rows of success, 5 % over all others."),
      .table = table,
      .panels = {ChangePanel(changes, sides, is_judged)}};
}

report::Section FlipSection(const std::vector<Flip>& flips, const Sides& sides) {
  if (flips.empty())
    return {.title = kFlipTitle, .lines = {"None: every seed ended the same way on both sides."}};
  report::Table table(
      {"<seed", "<change", "<where", "<why", "trial in " + sides.a, "trial in " + sides.b});
  const auto number = [](const std::optional<int64_t>& trial) {
    return trial ? std::to_string(*trial) : "-";
  };
  for (const Flip& flip : flips)
    table.Row(
        {Cell(std::to_string(flip.seed), Tone::kNone, flip.link),
         Cell(NameOf(flip.change), flip.change == FlipKind::kGained ? Tone::kGood : Tone::kBad),
         flip.group, report::Words(flip.why), number(flip.trial_a), number(flip.trial_b)});
  return {.title = kFlipTitle,
          .note = fmt::format("Lost: succeeds in {} only. Gained: in {} only. Why: how the other "
                              "side ended.",
                              sides.a, sides.b),
          .table = table};
}

}  // namespace turbidock::batch
