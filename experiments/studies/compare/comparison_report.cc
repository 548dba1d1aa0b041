#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "experiments/report/quantity.h"
#include "experiments/studies/compare/comparison.h"

namespace turbidock::compare {
namespace {

using report::Cell;
using report::Json;
using report::Tone;

std::string Percent(double rate) { return fmt::format("{:.1f} %", 100 * rate); }

Tone ToneOf(const RateComparison& c) {
  if (!c.significant) return Tone::kNone;
  return c.difference > 0 ? Tone::kGood : Tone::kBad;
}

// The pairs of a group that flipped, those that were lost first.
std::vector<const TrialPair*> Flipped(const ComparisonGroup& group) {
  std::vector<const TrialPair*> flipped;
  for (const auto is_so : {&TrialPair::lost, &TrialPair::gained})
    for (const TrialPair& pair : group.pairs)
      if ((pair.*is_so)()) flipped.push_back(&pair);
  return flipped;
}

// A row of the table of changes.
struct Change {
  std::string group, what, a, b, difference;
  int64_t pairs = 0;
  double p_value = 1;
  bool significant = false, is_rate = false;
  Tone tone = Tone::kNone;
};

Change ChangeOf(const std::string& group, const RateComparison& c) {
  return {.group = group,
          .what = "docked",
          .a = Percent(c.rate_a),
          .b = Percent(c.rate_b),
          .difference = fmt::format("{:+.1f} points [{:+.1f}, {:+.1f}]", 100 * c.difference,
                                    100 * c.interval_95.low, 100 * c.interval_95.high),
          .pairs = c.pairs,
          .p_value = c.p_value,
          .significant = c.significant,
          .is_rate = true,
          .tone = ToneOf(c)};
}

Change ChangeOf(const std::string& group, const MetricComparison& m) {
  const report::Quantity quantity = report::QuantityOf(m.metric);
  const auto text = [&](double value) { return report::Digits(value * quantity.factor); };
  const auto signed_text = [&](double value) {
    return fmt::format("{:+.3g}", value * quantity.factor + 0.0);
  };
  return {.group = group,
          .what = quantity.Title(),
          .a = text(*m.median_a),
          .b = text(*m.median_b),
          .difference = signed_text(*m.median_difference) +
                        (m.interval_95 ? fmt::format(" [{}, {}]", signed_text(m.interval_95->low),
                                                     signed_text(m.interval_95->high))
                                       : ""),
          .pairs = m.pairs,
          .p_value = m.p_value,
          .significant = m.significant};
}

// Significant ones first, docking before all else.
std::vector<Change> ChangesOf(const Comparison& comparison) {
  std::vector<Change> changes;
  for (const ComparisonGroup& group : comparison.groups) {
    changes.push_back(ChangeOf(group.Name(), group.docked));
    for (const MetricComparison& metric : group.metrics)
      if (metric.pairs > 0) changes.push_back(ChangeOf(group.Name(), metric));
  }
  if (comparison.has_several()) changes.push_back(ChangeOf("all together", comparison.all));
  std::ranges::stable_sort(changes, {}, [](const Change& c) {
    return std::tuple(!c.significant, !c.is_rate, c.p_value);
  });
  return changes;
}

report::Section ChangeSection(const Comparison& comparison, const std::vector<Change>& changes) {
  const bool several = comparison.has_several();
  std::vector<std::string> titles = {"<what", "A", "B", "difference [95 %]", "pairs", "p", "<"};
  if (several) titles.insert(titles.begin(), "<group");
  report::Table table(titles);
  for (const Change& c : changes) {
    std::vector<Cell> row = {c.what,
                             c.a,
                             c.b,
                             c.difference,
                             std::to_string(c.pairs),
                             report::PValue(c.p_value),
                             c.significant ? Cell("significant", c.tone) : Cell()};
    if (several) row.insert(row.begin(), c.group);
    table.Row(row);
  }
  return {.title = "What changed",
          .note =
              "B less A on the same seeds and parameters: exact McNemar and sign tests. "
              "Significant by Holm: 5 % over the rows of docking, 5 % over all others. "
              "Figures are medians of the pairs that docked in both.",
          .table = table};
}

// " --by 'KEY,KEY'"; nothing without keys.
std::string OptionText(const char* option, const std::vector<std::string>& keys) {
  return keys.empty() ? "" : fmt::format(" {} '{}'", option, fmt::join(keys, ","));
}

report::Section FlippedSection(const Comparison& comparison) {
  const bool several = comparison.has_several();
  std::vector<std::string> titles = {"<seed", "<", "trial in A", "trial in B", "<why"};
  if (several) titles.insert(titles.begin() + 2, "<group");
  report::Table table(titles);
  for (const ComparisonGroup& group : comparison.groups)
    for (const TrialPair* pair : Flipped(group)) {
      std::vector<Cell> row = {
          Cell(std::to_string(pair->a.seed), Tone::kNone, LinkOf(*pair)),
          pair->lost() ? Cell("lost", Tone::kBad) : Cell("gained", Tone::kGood),
          std::to_string(pair->trial_a), std::to_string(pair->trial_b),
          report::Words(NameOf(pair->failure()))};
      if (several) row.insert(row.begin() + 2, group.Name());
      table.Row(row);
    }
  report::Section section{.title = "Seeds that flipped", .wide = true};
  if (table.rows().empty()) {
    section.lines = {"None: every seed ended the same way in both."};
    return section;
  }
  section.note =
      "Lost: docked in A only. Gained: in B only. Why: the reason of the side that failed.";
  section.table = table;
  section.commands = {{"A page that shows each of them in both",
                       fmt::format("turbidock report {} {}{}{}", comparison.a, comparison.b,
                                   OptionText("--by", comparison.options.by),
                                   OptionText("--ignore", comparison.options.ignore))}};
  return section;
}

// A place on the axis for each group. One parameter says itself under the axis.
report::Axis GroupAxis(const std::vector<ComparisonGroup>& groups) {
  report::Axis axis;
  for (const ComparisonGroup& group : groups) {
    const bool is_one = group.key.size() == 1;
    if (is_one) axis.label = group.key[0].key;
    axis.names.push_back(is_one ? group.key[0].value : group.Name());
  }
  return axis;
}

std::vector<report::Section> Plots(const Comparison& comparison) {
  const report::Axis axis = GroupAxis(comparison.groups);
  report::Series in_a{.name = "A", .mark = report::Mark::kDots, .dot_px = 9}, in_b = in_a;
  in_b.name = "B";
  in_b.color = report::CurveColor(1);
  report::Series difference{
      .color = report::CurveColor(2), .mark = report::Mark::kBars, .dot_px = 8};
  report::Series both{.mark = report::Mark::kDots, .dot_px = 5};
  double lowest = 0, highest = 0, longest_s = 1, place = 0;
  for (const ComparisonGroup& group : comparison.groups) {
    const RateComparison& c = group.docked;
    in_a.points.push_back({place - 0.08, 100 * c.rate_a});
    in_b.points.push_back({place + 0.08, 100 * c.rate_b});
    difference.points.push_back(
        report::SampleWithin(place, c.difference, c.interval_95, /*unit=*/100));
    lowest = std::min(lowest, difference.points.back().low);
    highest = std::max(highest, difference.points.back().high);
    ++place;
    for (const TrialPair& pair : group.pairs) {
      if (!pair.a.success() || !pair.b.success()) continue;
      both.points.push_back({pair.a.time_s, pair.b.time_s});
      longest_s = std::max({longest_s, pair.a.time_s, pair.b.time_s});
    }
  }
  std::vector<report::Section> sections = {
      {.title = "Docked",
       .note = "Share of the pairs.",
       .panels = {{.x = axis, .y = {"docked, %", -3, 103}, .series = {in_a, in_b}}}},
      {.title = "Difference in docking",
       .note = "In points, with 95 % intervals.",
       .panels = {{.x = axis,
                   .y = {"B less A, points", lowest - 4, highest + 4},
                   .series = {difference},
                   .rules = {{.at = 0, .mark = report::Mark::kLine}}}}}};
  if (both.points.empty()) return sections;
  const double end_s = 1.05 * longest_s;
  const report::Series equal{
      .points = {{0, 0}, {end_s, end_s}}, .color = report::kGrey, .mark = report::Mark::kDashes};
  sections.push_back(
      {.title = "Time to dock",
       .note = "Of the pairs that docked in both; on the line where it is the same.",
       .panels = {{.x = {"A, s", 0, end_s}, .y = {"B, s", 0, end_s}, .series = {equal, both}}}});
  return sections;
}

report::Verdict VerdictOf(const Comparison& comparison, int64_t less, int64_t more) {
  const std::string reason = fmt::format("A: {} ({}). B: {} ({}).", comparison.a,
                                         comparison.build_a, comparison.b, comparison.build_b);
  if (less > 0 && more > 0) return {"docks less here and more there", Tone::kBad, reason};
  if (less > 0) return {"docks less", Tone::kBad, reason};
  if (more > 0) return {"docks more", Tone::kGood, reason};
  return {"no significant change in docking", Tone::kNone, reason};
}

Json FlippedJson(const ComparisonGroup& group, bool lost) {
  Json list = Json::array();
  for (const TrialPair* pair : Flipped(group))
    if (pair->lost() == lost)
      list.push_back({{"seed", pair->a.seed},
                      {"trial_a", pair->trial_a},
                      {"trial_b", pair->trial_b},
                      {"failure", pair->failure()}});
  return list;
}

}  // namespace

std::string LinkOf(const TrialPair& pair) {
  return fmt::format("{}-{}", pair.trial_a, pair.trial_b);
}

report::Report ReportOf(const Comparison& comparison) {
  const std::vector<Change> changes = ChangesOf(comparison);
  const auto count = [&](const auto& is_so) { return std::ranges::count_if(changes, is_so); };
  const RateComparison& all = comparison.all;
  report::Report report{
      .kind = "comparison",
      .title = fmt::format("{} against {}", comparison.b, comparison.a),
      .verdict = VerdictOf(comparison, count([](const Change& c) { return c.tone == Tone::kBad; }),
                           count([](const Change& c) { return c.tone == Tone::kGood; })),
      .facts = {{"pairs", std::to_string(all.pairs)},
                {"A docked", Percent(all.rate_a)},
                {"B docked", Percent(all.rate_b)},
                {"lost", std::to_string(all.lost), "docked in A only"},
                {"gained", std::to_string(all.gained), "docked in B only"},
                {"significant changes", std::to_string(count(&Change::significant))}},
      .sections = Plots(comparison)};
  report.sections.push_back(ChangeSection(comparison, changes));
  report.sections.push_back(FlippedSection(comparison));
  return report;
}

Json ResultJson(const Comparison& comparison) {
  Json groups = Json::array();
  for (const ComparisonGroup& group : comparison.groups) {
    Json key = Json::object();
    for (const farm::Parameter& parameter : group.key) key[parameter.key] = parameter.value;
    Json json = {{"group", key}};
    json.update(group.docked);
    json["lost"] = FlippedJson(group, true);
    json["gained"] = FlippedJson(group, false);
    json["metrics"] = group.metrics;
    groups.push_back(json);
  }
  return {{"a", comparison.a},
          {"b", comparison.b},
          {"build_a", comparison.build_a},
          {"build_b", comparison.build_b},
          {"pairs", comparison.all.pairs},
          {"all", comparison.all},
          {"groups", groups}};
}

}  // namespace turbidock::compare
