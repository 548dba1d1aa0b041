#include <fmt/ranges.h>

#include <algorithm>
#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <cctype>
#include <sstream>
#include <utility>

#include "experiments/report/table.h"
#include "experiments/studies/gate/gate.h"

namespace turbidock::gate {
namespace {

using report::Section;
using report::Tone;
using statistics::Verdict;

Tone ToneOf(Verdict verdict) {
  if (verdict == Verdict::kInconclusive) return Tone::kNone;
  return verdict == Verdict::kPass ? Tone::kGood : Tone::kBad;
}

std::string Points(const std::optional<double>& share) {
  return share ? fmt::format("{:.1f} points", 100 * *share) : "none";
}

// A measure's value for people: "12.3 s", 0.0045 m as "4.5 mm", a rate of 0.95 as "95 %".
std::string Shown(const MeasureReport& measure, const std::optional<double>& value) {
  if (!value) return "none";
  if (measure.unit.empty()) return report::Digits(100 * *value) + " %";
  if (measure.unit == "m") return report::Digits(1000 * *value) + " mm";
  return report::Digits(*value) + " " + measure.unit;
}

std::string ShownMargin(const MeasureReport& m) {
  return (m.less_is_worse ? "-" : "+") + (m.unit.empty() ? Points(m.margin) : Shown(m, m.margin));
}

// The measures that made the condition's verdict: "success rate 95 % -> 80 %, worse in 6 of 31
// trials, better in 0".
std::string Reasons(const ConditionReport& condition) {
  std::vector<std::string> reasons;
  for (const MeasureReport& m : condition.measures)
    if (m.verdict == condition.verdict)
      reasons.push_back(fmt::format("{} {} -> {}, worse in {} of {} trials, better in {}",
                                    m.measure, Shown(m, m.before), Shown(m, m.now), m.worse,
                                    m.compared, m.better));
  return fmt::format("{}", fmt::join(reasons, "; "));
}

report::Verdict VerdictOf(const GateReport& report) {
  std::string reason = "No measure got worse by its margin.";
  if (report.verdict == Verdict::kFail) reason = "At least one measure got worse.";
  if (report.verdict == Verdict::kInconclusive)
    reason = "The trials allowed were spent before it was known.";
  for (const ConditionReport& c : report.conditions)
    if (c.verdict != Verdict::kPass) reason += fmt::format(" {}: {}.", c.condition, Reasons(c));
  return {NameOf(report.verdict), ToneOf(report.verdict), reason};
}

std::vector<report::Fact> FactsOf(const GateReport& report) {
  int trials = 0;
  size_t failing = 0;
  std::vector<std::string> losses;
  for (const ConditionReport& c : report.conditions) {
    trials += c.trials;
    failing += c.newly_failing_seeds.size();
    losses.push_back(Points(c.least_loss_seen));
  }
  std::vector<report::Fact> facts = {
      {"trials", std::to_string(trials), "that the verdict rests on"},
      {"no longer dock", std::to_string(failing), "seeds that docked in the baseline"},
      {"alpha", fmt::format("{:g}", report.alpha),
       fmt::format("chance to fail by mistake, of each {}", NameOf(report.alpha_covers))},
      {"beta", fmt::format("{:g}", report.beta),
       "chance to pass by mistake a condition that is worse by its margin"},
      {"would have seen", fmt::format("{}", fmt::join(losses, ", ")),
       "less success, in the conditions' order, with 80 % power"},
      {"not varied", "all scenario keys", "within a condition only the seed is"},
      {"build", report.build},
      {"baseline", report.baseline_build}};
  if (!report.assignments.empty())
    facts.push_back({"set", fmt::format("{}", fmt::join(report.assignments, ", ")),
                     "in every condition, by --set"});
  return facts;
}

Section Measures(const GateReport& report) {
  report::Table table({"<condition", "<measure", "<verdict", "after", "baseline", "now", "margin",
                       "trials", "worse", "better"});
  for (const ConditionReport& c : report.conditions)
    for (const MeasureReport& m : c.measures)
      table.Row({c.condition,
                 m.measure,
                 {NameOf(m.verdict), ToneOf(m.verdict)},
                 m.decided_after_trials ? std::to_string(*m.decided_after_trials) : "-",
                 Shown(m, m.before),
                 Shown(m, m.now),
                 ShownMargin(m),
                 std::to_string(m.compared),
                 std::to_string(m.worse),
                 std::to_string(m.better)});
  return {.title = "Measures",
          .note =
              "Margin: the change for the worse that matters. After: the trials of the "
              "condition after which the verdict was known.",
          .table = table};
}

Section ChangedSeeds(const GateReport& report) {
  Section section{.title = "Seeds that changed"};
  report::Table table({"<condition", "seed", "<change", "<outcome now"});
  for (const ConditionReport& c : report.conditions)
    for (const GateTrial& trial : c.outcomes) {
      const report::Cell seed(std::to_string(trial.seed), Tone::kNone,
                              BundleName(c.condition, trial.seed));
      if (std::ranges::count(c.newly_failing_seeds, trial.seed) > 0)
        table.Row({c.condition, seed, {"fails now", Tone::kBad}, NameOf(trial.outcome)});
      else if (std::ranges::count(c.newly_docking_seeds, trial.seed) > 0)
        table.Row({c.condition, seed, {"docks now", Tone::kGood}, NameOf(trial.outcome)});
    }
  if (table.rows().empty())
    section.lines = {"None: every seed ended as in the baseline."};
  else
    section.table = table;
  return section;
}

}  // namespace

std::string BundleName(const std::string& condition, int64_t seed) {
  std::string name = condition;  // good for a file everywhere
  std::ranges::replace_if(
      name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
  return fmt::format("{}_{}", name, seed);
}

report::Report ReportOf(const GateReport& report) {
  return {.kind = "gate",
          .title = report.description.empty() ? "docking gate" : report.description,
          .build = report.build,
          .verdict = VerdictOf(report),
          .facts = FactsOf(report),
          .sections = {Measures(report), ChangedSeeds(report)}};
}

std::string Junit(const GateReport& report) {
  using boost::property_tree::ptree;
  const auto add = [](ptree* parent, const char* path,
                      std::vector<std::pair<std::string, std::string>> attributes) {
    ptree& element = parent->add(path, "");
    for (auto& [name, value] : attributes) {
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
