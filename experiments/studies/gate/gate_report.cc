#include <fmt/ranges.h>

#include <algorithm>
#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <cctype>
#include <set>
#include <sstream>
#include <utility>

#include "experiments/report/table.h"
#include "experiments/studies/gate/gate.h"
#include "experiments/system/plain_text.h"

namespace turbidock::gate {
namespace {

using report::Section;
using report::Tone;
using statistics::Verdict;

Tone ToneOf(Verdict verdict) {
  if (verdict == Verdict::kInconclusive) return Tone::kNone;
  return verdict == Verdict::kPass ? Tone::kGood : Tone::kBad;
}

std::string Percent(double rate) { return report::Digits(100 * rate) + " %"; }

std::string RateText(int64_t successes, int64_t trials, const statistics::Interval& interval) {
  if (trials == 0) return "-";
  return fmt::format("{} [{}, {}]",
                     Percent(static_cast<double>(successes) / static_cast<double>(trials)),
                     report::Digits(100 * interval.low, 3), report::Digits(100 * interval.high, 3));
}

// What made the condition's verdict: "success 95 % -> 80 %, worse in 6 of 31 pairs, better in 0".
std::string Reasons(const ConditionReport& condition) {
  std::vector<std::string> reasons;
  for (const int64_t seed : condition.never_seeds)
    reasons.push_back(fmt::format("seed {} ended as none may", seed));
  for (const batch::Change& c : condition.changes) {
    if (c.verdict != condition.verdict) continue;
    const report::Quantity quantity = batch::QuantityOf(c.measure);
    const auto text = [&](const std::optional<double>& value) {
      return value ? quantity.Text(report::Digits(*value * quantity.factor)) : "none";
    };
    reasons.push_back(fmt::format("{} {} -> {}, worse in {} of {} pairs, better in {}",
                                  quantity.label, text(c.a), text(c.b), c.worse, c.pairs,
                                  c.better));
  }
  return fmt::format("{}", fmt::join(reasons, "; "));
}

report::Verdict VerdictOf(const GateReport& report) {
  std::string reason = "No measure got worse by its margin.";
  if (report.verdict == Verdict::kFail) reason = "At least one measure got worse.";
  if (report.verdict == Verdict::kInconclusive)
    reason = "The trials allowed were spent before it was known.";
  for (const ConditionReport& c : report.conditions) {
    if (!c.never_seeds.empty()) reason = "A trial ended as none may: the gate failed at once.";
  }
  for (const ConditionReport& c : report.conditions)
    if (c.verdict == report.verdict && c.verdict != Verdict::kPass && !Reasons(c).empty())
      reason += fmt::format(" {}: {}.", c.condition, Reasons(c));
  return {NameOf(report.verdict), ToneOf(report.verdict), reason};
}

std::vector<report::Fact> FactsOf(const GateReport& report) {
  int64_t trials = 0, lost = 0;
  for (const ConditionReport& c : report.conditions) {
    trials += c.trials;
    lost += std::ranges::count(c.flips, batch::FlipKind::kLost, &batch::Flip::change);
  }
  std::vector<report::Fact> facts = {
      {"trials", std::to_string(trials), "that the verdict rests on"},
      {"lost", std::to_string(lost), "seeds that succeeded in the baseline"},
      {"alpha", fmt::format("{:g}", report.alpha),
       fmt::format("chance to fail by mistake, of each {}", NameOf(report.alpha_covers))},
      {"beta", fmt::format("{:g}", report.beta),
       "chance to pass by mistake a condition that is worse by its margin"},
      {"build", report.build},
      {"baseline", report.baseline_build}};
  if (!report.assignments.empty())
    facts.push_back({"set", fmt::format("{}", fmt::join(report.assignments, ", ")),
                     "in every condition, by --set"});
  return facts;
}

Section ConditionSection(const GateReport& report) {
  report::Table table({"<condition", "<verdict", "trials", "success [95 %]", "baseline, same seeds",
                       "baseline, all", "smallest loss noticed"});
  for (const ConditionReport& c : report.conditions) {
    const std::optional<double>& before = c.changes.front().a;
    table.Row({c.condition,
               {NameOf(c.verdict), ToneOf(c.verdict)},
               std::to_string(c.trials),
               RateText(c.successes, c.trials, c.interval_95),
               before ? Percent(*before) : "-",
               RateText(c.baseline_successes, c.baseline_trials, c.baseline_interval_95),
               c.smallest_loss_noticed
                   ? fmt::format("{:.1f} points", 100 * *c.smallest_loss_noticed)
                   : "none"});
  }
  return {
      .title = "Conditions",
      .note =
          "Smallest loss noticed: of success, that fails with a probability of 80 %; between the "
          "margin and it a loss may end inconclusive.",
      .table = table};
}

// A column a build, all judged against the same baseline.
Section BuildSection(const GateReport& report,
                     const std::vector<std::pair<std::string, GateReport>>& beside) {
  std::vector<std::pair<std::string, const GateReport*>> builds = {{"this build", &report}};
  for (const auto& [name, other] : beside) builds.emplace_back(name, &other);
  std::vector<std::string> titles = {"<condition"};
  for (const auto& [name, of] : builds) titles.push_back("<" + name);
  report::Table table(titles);
  const auto add = [&](const std::string& what, const auto& cell_of) {
    std::vector<report::Cell> row = {what};
    for (const auto& [name, of] : builds) row.push_back(cell_of(*of));
    table.Row(row);
  };
  add("verdict",
      [](const GateReport& of) { return report::Cell(NameOf(of.verdict), ToneOf(of.verdict)); });
  for (size_t i = 0; i < report.conditions.size(); ++i)
    add(report.conditions[i].condition, [i](const GateReport& of) {
      const ConditionReport& c = of.conditions[i];
      return report::Cell(fmt::format("{}: {} of {}", NameOf(c.verdict), c.successes, c.trials),
                          ToneOf(c.verdict));
    });
  add("program", [](const GateReport& of) { return report::Cell(of.build); });
  add("set otherwise", [&report](const GateReport& of) {
    return &of == &report ? ""
                          : system::Shortened(fmt::format("{}", fmt::join(of.assignments, ", ")));
  });
  return {.title = "Builds side by side",
          .note = "Each against the same baseline; successes of the trials that it took.",
          .table = table};
}

}  // namespace

std::vector<std::string> BundleNames(const std::vector<std::string>& conditions) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (std::string name : conditions) {
    // good for a file everywhere
    std::ranges::replace_if(
        name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
    std::string free = name;
    const auto small = [&free] {
      std::string text = free;
      std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
      return text;
    };
    for (int i = 2; !taken.insert(small()).second; ++i) free = fmt::format("{}_{}", name, i);
    names.push_back(free);
  }
  return names;
}

report::Report ReportOf(const GateReport& report,
                        const std::vector<std::pair<std::string, GateReport>>& beside) {
  std::vector<batch::Change> changes;
  std::vector<batch::Flip> flips;
  for (const ConditionReport& c : report.conditions) {
    changes.insert(changes.end(), c.changes.begin(), c.changes.end());
    flips.insert(flips.end(), c.flips.begin(), c.flips.end());
  }
  const batch::Sides sides{.a = "baseline", .b = "now"};
  report::Report shown{.kind = "gate",
                       .title = report.description.empty() ? "docking gate" : report.description,
                       .build = report.build,
                       .verdict = VerdictOf(report),
                       .facts = FactsOf(report),
                       .sections = {ConditionSection(report)}};
  if (!beside.empty()) shown.sections.push_back(BuildSection(report, beside));
  shown.sections.push_back(batch::ChangeSection(changes, sides));
  shown.sections.push_back(batch::FlipSection(flips, sides));
  for (const ConditionReport& c : report.conditions)
    if (c.boundaries) shown.sections.push_back(*c.boundaries);
  for (const ConditionReport& c : report.conditions)
    if (auto section = batch::FailureSection(c.effects)) {
      section->title += ": " + c.condition;
      shown.sections.push_back(*section);
    }
  return shown;
}

std::string Junit(const GateReport& report) {
  using boost::property_tree::ptree;
  const auto add = [](ptree* parent, const char* path,
                      const std::vector<std::pair<std::string, std::string>>& attributes) {
    ptree& element = parent->add(path, "");
    for (auto [name, value] : attributes) {
      std::ranges::replace_if(
          value, [](unsigned char c) { return std::iscntrl(c); }, '?');  // XML has none
      element.put("<xmlattr>." + name, value);
    }
    return &element;
  };
  const auto count = [&](Verdict verdict) {
    return std::to_string(
        std::ranges::count(report.conditions, verdict, &ConditionReport::verdict));
  };
  ptree document;
  ptree* suites = add(&document, "testsuites",
                      {{"name", "turbidock gate"},
                       {"tests", std::to_string(report.conditions.size())},
                       {"failures", count(Verdict::kFail)},
                       {"errors", count(Verdict::kInconclusive)}});
  for (const ConditionReport& c : report.conditions) {
    const bool failed = c.verdict == Verdict::kFail, unsure = c.verdict == Verdict::kInconclusive;
    ptree* suite = add(suites, "testsuite",
                       {{"name", c.condition},
                        {"tests", "1"},
                        {"failures", failed ? "1" : "0"},
                        {"errors", unsure ? "1" : "0"}});
    ptree* test = add(suite, "testcase", {{"name", c.condition}, {"classname", "turbidock.gate"}});
    if (failed) add(test, "failure", {{"type", "worse"}, {"message", Reasons(c)}});
    if (unsure) add(test, "error", {{"type", "inconclusive"}, {"message", Reasons(c)}});
  }
  std::ostringstream text;
  write_xml(text, document, boost::property_tree::xml_writer_settings<std::string>(' ', 2));
  return text.str();
}

}  // namespace turbidock::gate
