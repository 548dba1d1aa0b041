#include <fmt/ranges.h>

#include <algorithm>

#include "experiments/batch/summary.h"
#include "experiments/report/table.h"
#include "experiments/studies/compare/comparison.h"
#include "experiments/system/plain_text.h"

namespace turbidock::compare {
namespace {

using report::Tone;

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

// " --by KEY,KEY"; nothing without keys.
std::string OptionText(const char* option, const std::vector<std::string>& keys) {
  return keys.empty() ? ""
                      : fmt::format(" {} {}", option,
                                    system::ShellWord(fmt::format("{}", fmt::join(keys, ","))));
}

// With the command whose page opens them.
report::Section FlipsOf(const Comparison& comparison) {
  report::Section section = batch::FlipSection(comparison.flips, {});
  if (!comparison.flips.empty())
    section.commands = {
        {"A page that shows each of them on both sides",
         fmt::format("turbidock compare {} {}{}{} --out compare.html",
                     system::ShellWord(comparison.a), system::ShellWord(comparison.b),
                     OptionText("--by", comparison.options.by),
                     OptionText("--ignore", comparison.options.ignore))}};
  return section;
}

// Of all pairs; --by adds rows, and changes nothing.
report::Verdict VerdictOf(const Comparison& comparison) {
  const batch::Change& all = comparison.all();
  const bool unended = comparison.unended_a > 0 || comparison.unended_b > 0;
  std::string reason = fmt::format(
      "B against A over all {} pairs of the same {} seeds, p = {} (McNemar's exact test; "
      "the pairs of a seed count as one).",
      all.pairs, all.seeds, report::PValue(all.p_value));
  if (!comparison.least_difference_seen) reason += " So few pairs could not have shown any change.";
  if (unended)
    reason += fmt::format(
        " {} trials of A and {} of B crashed, hung or had no answer: what they would have come to "
        "is not known.",
        comparison.unended_a, comparison.unended_b);
  if (!all.significant)
    return {unended ? "no significant change in success, of the trials that ended"
                    : "no significant change in success",
            unended ? Tone::kBad : Tone::kNone, reason};
  if (*all.difference > 0) return {"succeeds more often", Tone::kGood, reason};
  return {"succeeds less often", Tone::kBad, reason};
}

std::vector<report::Fact> FactsOf(const Comparison& comparison) {
  const batch::Change& all = comparison.all();
  const auto& least = comparison.least_difference_seen;
  const auto percent = [](const std::optional<double>& rate) {
    return report::Digits(100 * *rate) + " %";
  };
  std::vector<report::Fact> facts = {
      {"pairs", std::to_string(all.pairs)},
      {"success of A", percent(all.a)},
      {"success of B", percent(all.b)},
      {"lost", std::to_string(comparison.lost()), "succeed in A only"},
      {"gained", std::to_string(comparison.gained()), "succeed in B only"},
      {"smallest change noticed", least ? fmt::format("{:.1f} points", 100 * *least) : "none",
       "of success over all pairs, with a probability of 80 % at p = 0.05"}};
  if (!comparison.not_varied.empty())
    facts.push_back({"not varied", fmt::format("{}", fmt::join(comparison.not_varied, ", ")),
                     "neither within a set nor between the two"});
  return facts;
}

}  // namespace

report::Report ReportOf(const Comparison& comparison) {
  return {.kind = "comparison",
          .title = fmt::format("{} against {}", comparison.b, comparison.a),
          .verdict = VerdictOf(comparison),
          .facts = FactsOf(comparison),
          .sections = {DifferencesSection(comparison), batch::ChangeSection(comparison.changes, {}),
                       FlipsOf(comparison)}};
}

}  // namespace turbidock::compare
