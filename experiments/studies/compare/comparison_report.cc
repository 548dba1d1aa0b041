#include <fmt/ranges.h>

#include <algorithm>
#include <tuple>

#include "experiments/batch/summary.h"
#include "experiments/page/batch_page.h"
#include "experiments/page/report_page.h"
#include "experiments/report/report_json.h"
#include "experiments/report/table.h"
#include "experiments/studies/compare/comparison.h"
#include "experiments/system/plain_text.h"

namespace turbidock::compare {
namespace {

using report::Cell;
using report::Tone;

// "water milk 20 ml/m³, controller lqg".
std::string Named(const std::vector<batch::Parameter>& parameters) {
  std::string text;
  for (const auto& [key, value] : parameters) {
    const report::Quantity name = batch::NameOfKey(key);
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name.label,
                        name.Text(batch::ValueText(key, value)));
  }
  return text;
}

// Of a change: its parameters, or its word where it has none.
std::string GroupOf(const Change& change) {
  return change.shared.empty() ? change.group : Named(change.shared);
}

report::Section DifferencesSection(const Comparison& comparison) {
  constexpr size_t kMost = 40;
  report::Table table({"<what", "<A", "<B", "<key"});
  table.Row({"file", comparison.a, comparison.b});
  if (comparison.build_a != comparison.build_b)
    table.Row({"build", comparison.build_a, comparison.build_b});
  size_t left = comparison.differences.size();
  for (const auto& [key, sides] : comparison.differences) {
    if (table.rows().size() >= kMost) break;
    const auto value = [&key = key](const std::string& side) {
      return system::Shortened(batch::ValueText(key, side));
    };
    table.Row({batch::NameOfKey(key).Title(), value(sides[0]), value(sides[1]), key});
    --left;
  }
  std::string note = comparison.differences.empty() ? "The plans are the same." : "";
  if (left > 0) note = fmt::format("And {} more keys.", left);
  if (comparison.left_out_a > 0 || comparison.left_out_b > 0)
    note += fmt::format(
        "{}{} trials of A and {} of B are left out: they have no partner, or did not end.",
        note.empty() ? "" : " ", comparison.left_out_a, comparison.left_out_b);
  return {.title = "What differs", .note = note, .table = table};
}

Tone ToneOf(const Change& change) {
  if (!change.significant || !change.is_rate()) return Tone::kNone;
  return change.difference > 0 ? Tone::kGood : Tone::kBad;
}

// " --by 'KEY,KEY'"; nothing without keys.
std::string OptionText(const char* option, const std::vector<std::string>& keys) {
  return keys.empty() ? "" : fmt::format(" {} '{}'", option, fmt::join(keys, ","));
}

report::Section FlippedSection(const Comparison& comparison) {
  report::Table table({"<seed", "<", "<parameters", "trial in A", "trial in B", "<why"});
  const auto add = [&](const std::vector<Flip>& flips, const Cell& what) {
    for (const Flip& flip : flips)
      table.Row({Cell(std::to_string(flip.seed), Tone::kNone, flip.Link()), what,
                 Named(flip.shared), std::to_string(flip.trial_a), std::to_string(flip.trial_b),
                 report::Words(NameOf(flip.failure))});
  };
  add(comparison.lost, Cell("lost", Tone::kBad));
  add(comparison.gained, Cell("gained", Tone::kGood));
  if (table.rows().empty())
    return {.title = "Seeds that flipped",
            .lines = {"None: every seed ended the same way in both."}};
  return {.title = "Seeds that flipped",
          .note =
              "Lost: docked in A only. Gained: in B only. Why: the reason of the side that "
              "failed.",
          .table = table,
          .commands = {{"A page that shows each of them in both",
                        fmt::format("turbidock compare {} {}{}{} --out compare.html", comparison.a,
                                    comparison.b, OptionText("--by", comparison.options.by),
                                    OptionText("--ignore", comparison.options.ignore))}}};
}

// A place on the axis for each group. One parameter says itself under the axis.
report::Section DifferencePlot(const Comparison& comparison) {
  const std::vector<std::string>& by = comparison.options.by;
  const bool is_one = by.size() == 1;
  report::Axis x{.label = is_one ? batch::NameOfKey(by[0]).Title() : ""};
  report::Series series{.color = report::CurveColor(2), .mark = report::Mark::kBars, .dot_px = 8};
  double lowest = 0, highest = 0;
  for (const Change& c : comparison.changes) {
    if (!c.is_rate()) continue;
    const auto at = static_cast<double>(x.names.size());
    x.names.push_back(is_one && !c.shared.empty() ? batch::ValueText(by[0], c.shared[0].value)
                                                  : GroupOf(c));
    series.points.push_back(report::SampleWithin(at, c.difference, *c.interval_95, /*unit=*/100));
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

report::Verdict VerdictOf(const std::vector<Change>& changes) {
  const auto has = [&](Tone tone) { return std::ranges::count(changes, tone, &ToneOf) > 0; };
  const std::string reason = "B against A, pair by pair on the same seeds.";
  if (has(Tone::kBad))
    return {has(Tone::kGood) ? "docks less here and more there" : "docks less", Tone::kBad, reason};
  if (has(Tone::kGood)) return {"docks more", Tone::kGood, reason};
  return {"no significant change in docking", Tone::kNone, reason};
}

std::vector<report::Fact> FactsOf(const Comparison& comparison) {
  const Change& all = comparison.all;
  const auto& least = comparison.least_difference_seen;
  const auto percent = [](double rate) { return report::Digits(100 * rate) + " %"; };
  std::vector<report::Fact> facts = {
      {"pairs", std::to_string(all.pairs)},
      {"A docked", percent(all.a)},
      {"B docked", percent(all.b)},
      {"lost", std::to_string(comparison.lost.size()), "docked in A only"},
      {"gained", std::to_string(comparison.gained.size()), "docked in B only"},
      {"would have seen", least ? fmt::format("{:.1f} points", 100 * *least) : "no difference",
       "of success rate over all pairs, with 80 % power at p = 0.05"}};
  if (!comparison.not_varied.empty())
    facts.push_back({"not varied", fmt::format("{}", fmt::join(comparison.not_varied, ", ")),
                     "neither within a set nor between the two"});
  return facts;
}

}  // namespace

report::Section ChangeSection(const Comparison& comparison) {
  report::Table table({"<parameters", "<what", "A", "B", "difference [95 %]", "pairs", "p", "<"});
  std::vector<Change> changes = comparison.changes;  // significant ones first, docking before all
  std::ranges::stable_sort(changes, {}, [](const Change& c) {
    return std::tuple(!c.significant, !c.is_rate(), c.p_value);
  });
  for (const Change& c : changes) {
    const report::Quantity quantity =
        c.is_rate() ? report::Quantity{"docked", "%", 100} : report::QuantityOf(c.metric);
    const auto text = [&](double value) { return report::Digits(value * quantity.factor); };
    const auto change = [&](double value) {
      return fmt::format("{:+.3g}", value * quantity.factor + 0.0);
    };
    std::string difference = change(c.difference);
    if (c.interval_95)
      difference +=
          fmt::format(" [{}, {}]", change(c.interval_95->low), change(c.interval_95->high));
    table.Row({GroupOf(c), quantity.Title(), text(c.a), text(c.b), difference,
               std::to_string(c.pairs), report::PValue(c.p_value),
               c.significant ? Cell("significant", ToneOf(c)) : Cell()});
  }
  return {.title = "What changed",
          .note =
              "B less A on the same seeds and parameters: exact McNemar and sign tests. "
              "Significant by Holm: 5 % over the rows of docking, 5 % over all others. "
              "Numbers are medians of the pairs that docked in both.",
          .table = table};
}

report::Report ReportOf(const Comparison& comparison) {
  return {.kind = "comparison",
          .title = fmt::format("{} against {}", comparison.b, comparison.a),
          .verdict = VerdictOf(comparison.changes),
          .facts = FactsOf(comparison),
          .sections = {DifferencesSection(comparison), DifferencePlot(comparison),
                       ChangeSection(comparison), FlippedSection(comparison)}};
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
  add(comparison.lost, "A", "B");
  add(comparison.gained, "B", "A");
  return page;
}

}  // namespace turbidock::compare
