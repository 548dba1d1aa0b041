#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "experiments/page/report_page.h"
#include "experiments/page/stored_trials.h"
#include "experiments/report/quantity.h"
#include "experiments/report/report_json.h"
#include "experiments/studies/compare/comparison.h"
#include "experiments/system/plain_text.h"

namespace turbidock::compare {
namespace {

using report::Cell;
using report::Tone;

std::string Percent(double rate) { return fmt::format("{:.1f} %", 100 * rate); }

Cell Significance(bool significant, Tone tone) {
  return significant ? Cell("significant", tone) : Cell();
}

report::Section DifferencesSection(const Comparison& comparison) {
  constexpr size_t kMost = 40;
  report::Table table({"<key", "<A", "<B"});
  table.Row({"file", comparison.a, comparison.b});
  if (comparison.build_a != comparison.build_b)
    table.Row({"build", comparison.build_a, comparison.build_b});
  size_t left = comparison.differences.size();
  for (const auto& [key, sides] : comparison.differences) {
    if (table.rows().size() >= kMost) break;
    table.Row({key, system::Shortened(sides[0]), system::Shortened(sides[1])});
    --left;
  }
  std::string note = comparison.differences.empty() ? "The plans are the same." : "";
  if (left > 0) note = fmt::format("And {} more keys.", left);
  return {.title = "What differs", .note = note, .table = table};
}

// A row of the table of changes: its group first.
struct Change {
  std::vector<Cell> row;
  double p_value = 1;
  bool significant = false, is_rate = false;
  Tone tone = Tone::kNone;
};

Change ChangeOf(const std::string& group, const RateComparison& c) {
  Tone tone = Tone::kNone;
  if (c.significant) tone = c.difference > 0 ? Tone::kGood : Tone::kBad;
  return {.row = {group, "docked", Percent(c.rate_a), Percent(c.rate_b),
                  fmt::format("{:+.1f} points [{:+.1f}, {:+.1f}]", 100 * c.difference,
                              100 * c.interval_95.low, 100 * c.interval_95.high),
                  std::to_string(c.pairs), report::PValue(c.p_value),
                  Significance(c.significant, tone)},
          .p_value = c.p_value,
          .significant = c.significant,
          .is_rate = true,
          .tone = tone};
}

Change ChangeOf(const std::string& group, const MetricComparison& m) {
  const report::Quantity quantity = report::QuantityOf(m.metric);
  const auto text = [&](double value) { return report::Digits(value * quantity.factor); };
  const auto change = [&](double value) {
    return fmt::format("{:+.3g}", value * quantity.factor + 0.0);
  };
  std::string difference = change(*m.median_difference);
  if (m.interval_95)
    difference += fmt::format(" [{}, {}]", change(m.interval_95->low), change(m.interval_95->high));
  return {.row = {group, quantity.Title(), text(*m.median_a), text(*m.median_b), difference,
                  std::to_string(m.pairs), report::PValue(m.p_value),
                  Significance(m.significant, Tone::kNone)},
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

report::Section ChangeSection(const std::vector<Change>& changes) {
  report::Table table({"<parameters", "<what", "A", "B", "difference [95 %]", "pairs", "p", "<"});
  for (const Change& change : changes) table.Row(change.row);
  return {.title = "What changed",
          .note =
              "B less A on the same seeds and parameters: exact McNemar and sign tests. "
              "Significant by Holm: 5 % over the rows of docking, 5 % over all others. "
              "Numbers are medians of the pairs that docked in both.",
          .table = table};
}

// " --by 'KEY,KEY'"; nothing without keys.
std::string OptionText(const char* option, const std::vector<std::string>& keys) {
  return keys.empty() ? "" : fmt::format(" {} '{}'", option, fmt::join(keys, ","));
}

report::Section FlippedSection(const Comparison& comparison) {
  report::Table table({"<seed", "<", "<parameters", "trial in A", "trial in B", "<why"});
  const auto add = [&](const std::vector<Flip>& flips, const Cell& what) {
    for (const Flip& flip : flips)
      table.Row({Cell(std::to_string(flip.seed), Tone::kNone, flip.Link()), what, flip.parameters,
                 std::to_string(flip.trial_a), std::to_string(flip.trial_b),
                 report::Words(NameOf(flip.failure))});
  };
  add(comparison.all.lost, Cell("lost", Tone::kBad));
  add(comparison.all.gained, Cell("gained", Tone::kGood));
  if (table.rows().empty())
    return {.title = "Seeds that flipped",
            .lines = {"None: every seed ended the same way in both."}};
  return {.title = "Seeds that flipped",
          .note =
              "Lost: docked in A only. Gained: in B only. Why: the reason of the side that "
              "failed.",
          .table = table,
          .commands = {{"A page that shows each of them in both",
                        fmt::format("turbidock report {} {}{}{}", comparison.a, comparison.b,
                                    OptionText("--by", comparison.options.by),
                                    OptionText("--ignore", comparison.options.ignore))}}};
}

// A place on the axis for each group. One parameter says itself under the axis.
report::Section DifferencePlot(const std::vector<ComparisonGroup>& groups) {
  report::Axis x;
  report::Series series{.color = report::CurveColor(2), .mark = report::Mark::kBars, .dot_px = 8};
  double lowest = 0, highest = 0;
  for (const ComparisonGroup& group : groups) {
    const bool is_one = group.key.size() == 1;
    if (is_one) x.label = group.key.begin()->first;
    const auto at = static_cast<double>(x.names.size());
    x.names.push_back(is_one ? group.key.begin()->second : group.Name());
    const RateComparison& c = group.docked;
    series.points.push_back(report::SampleWithin(at, c.difference, c.interval_95, /*unit=*/100));
    lowest = std::min(lowest, series.points.back().low);
    highest = std::max(highest, series.points.back().high);
  }
  return {.title = "Difference in docking",
          .note = "In points of per cent, with 95 % intervals.",
          .panels = {{.x = x,
                      .y = {"B less A, points", lowest - 4, highest + 4},
                      .series = {series},
                      .rules = {{.at = 0, .mark = report::Mark::kLine}}}}};
}

report::Section TimesPlot(const std::vector<ComparisonGroup>& groups) {
  report::Section section{
      .title = "Time to dock",
      .note = "Of the pairs that docked in both; on the line where it is the same."};
  report::Series both{.mark = report::Mark::kDots, .dot_px = 5};
  double end_s = 0;
  for (const ComparisonGroup& group : groups)
    for (const TrialPair& pair : group.pairs) {
      if (!pair.docked()) continue;
      both.points.push_back({pair.a.time_s, pair.b.time_s});
      end_s = std::max({end_s, 1.05 * pair.a.time_s, 1.05 * pair.b.time_s});
    }
  const report::Series equal{
      .points = {{0, 0}, {end_s, end_s}}, .color = report::kGrey, .mark = report::Mark::kDashes};
  if (both.points.empty())
    section.lines = {"No pair docked in both."};
  else
    section.panels = {{.x = {"A, s", 0, end_s}, .y = {"B, s", 0, end_s}, .series = {equal, both}}};
  return section;
}

report::Verdict VerdictOf(const std::vector<Change>& changes) {
  const auto has = [&](Tone tone) { return std::ranges::count(changes, tone, &Change::tone) > 0; };
  const std::string reason = "B against A, pair by pair on the same seeds.";
  if (has(Tone::kBad))
    return {has(Tone::kGood) ? "docks less here and more there" : "docks less", Tone::kBad, reason};
  if (has(Tone::kGood)) return {"docks more", Tone::kGood, reason};
  return {"no significant change in docking", Tone::kNone, reason};
}

// "seed (30), sea.state (2)": what the pairs differ in, and how many values it has.
std::string Varied(const Comparison& comparison) {
  std::map<std::string, std::set<std::string>> values;
  std::set<int64_t> seeds;
  for (const ComparisonGroup& group : comparison.groups)
    for (const TrialPair& pair : group.pairs) {
      seeds.insert(pair.a.seed);
      for (const batch::Parameter& p : pair.parameters) values[p.key].insert(p.value);
    }
  std::string text = fmt::format("seed ({})", seeds.size());
  for (const auto& [key, of] : values)
    if (of.size() > 1) text += fmt::format(", {} ({})", key, of.size());
  return text;
}

std::vector<report::Fact> FactsOf(const Comparison& comparison,
                                  const std::vector<Change>& changes) {
  const RateComparison& all = comparison.all;
  const auto& least = all.least_difference_seen;
  return {
      {"pairs", std::to_string(all.pairs)},
      {"A docked", Percent(all.rate_a)},
      {"B docked", Percent(all.rate_b)},
      {"lost", std::to_string(all.lost.size()), "docked in A only"},
      {"gained", std::to_string(all.gained.size()), "docked in B only"},
      {"significant changes", std::to_string(std::ranges::count_if(changes, &Change::significant))},
      {"would have seen", least ? fmt::format("{:.1f} points", 100 * *least) : "no difference",
       "of success rate over all pairs, with 80 % power at p = 0.05"},
      {"varied", Varied(comparison), "nothing else was: it says nothing of other conditions"}};
}

}  // namespace

report::Report ReportOf(const Comparison& comparison) {
  const std::vector<Change> changes = ChangesOf(comparison);
  return {.kind = "comparison",
          .title = fmt::format("{} against {}", comparison.b, comparison.a),
          .verdict = VerdictOf(changes),
          .facts = FactsOf(comparison, changes),
          .sections = {DifferencesSection(comparison), DifferencePlot(comparison.groups),
                       TimesPlot(comparison.groups), ChangeSection(changes),
                       FlippedSection(comparison)}};
}

page::Page PageOf(const Comparison& comparison, const ComparedFile& a, const ComparedFile& b,
                  const trial::Plugins& plugins, int64_t series_bytes) {
  page::Page page =
      page::ReportPage(report::Document(ReportOf(comparison), comparison), "comparison");
  page.model["sections"].back().erase("commands");  // to this page
  page::StoredTrials in_a(a.store, a.file, "A", series_bytes / 2, plugins, &page),
      in_b(b.store, b.file, "B", series_bytes / 2, plugins, &page);
  const auto add = [&](const std::vector<Flip>& flips, const char* docked, const char* failed) {
    for (const Flip& flip : flips)
      page.model["links"][flip.Link()] =
          page::Link{.title = fmt::format("Seed {}", flip.seed),
                     .note = fmt::format("Docked in {} only; in {}: {}.", docked, failed,
                                         report::Words(NameOf(flip.failure))),
                     .trials = {in_a.Of(flip.trial_a), in_b.Of(flip.trial_b)}};
  };
  add(comparison.all.lost, "A", "B");
  add(comparison.all.gained, "B", "A");
  return page;
}

}  // namespace turbidock::compare
