#include "experiments/studies/gate/gate_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <utility>

#include "experiments/report/table.h"

namespace turbidock::gate {
namespace {

using report::Fixed;
using report::Mark;
using report::Panel;
using report::Sample;
using report::Section;
using report::Series;
using report::Tone;
using statistics::Verdict;

Tone ToneOf(Verdict verdict) {
  if (verdict == Verdict::kInconclusive) return Tone::kNone;
  return verdict == Verdict::kPass ? Tone::kGood : Tone::kBad;
}

std::string Shown(const MeasureReport& measure, const std::optional<double>& value) {
  return value ? ShownValue(*value, measure.unit) : "none";
}

std::string ShownMargin(const MeasureReport& measure) {
  const char sign = measure.less_is_worse ? '-' : '+';
  if (measure.unit.empty()) return fmt::format("{}{:g} points", sign, 100 * measure.margin);
  if (measure.unit == "m") return fmt::format("{}{:g} mm", sign, 1000 * measure.margin);
  return fmt::format("{}{:g} {}", sign, measure.margin, measure.unit);
}

// "success rate 95.0 % -> 80.0 %, worse in 6 of 31 trials, better in 0".
std::string Described(const MeasureReport& m) {
  return fmt::format("{} {} -> {}, worse in {} of {} trials, better in {}", m.measure,
                     Shown(m, m.before), Shown(m, m.now), m.worse, m.compared, m.better);
}

// The measures that made the condition's verdict.
std::string Reasons(const ConditionReport& condition) {
  std::vector<std::string> reasons;
  for (const MeasureReport& measure : condition.measures)
    if (measure.verdict == condition.verdict) reasons.push_back(Described(measure));
  return fmt::format("{}", fmt::join(reasons, "; "));
}

report::Verdict VerdictOf(const GateReport& report) {
  std::string reason = "No measure got worse by its margin.";
  if (report.verdict == Verdict::kFail) reason = "At least one measure got worse.";
  if (report.verdict == Verdict::kInconclusive)
    reason = "The trials allowed were spent before it was known.";
  for (const ConditionReport& c : report.conditions)
    if (c.verdict != Verdict::kPass) reason += fmt::format(" {}: {}.", c.name, Reasons(c));
  return {NameOf(report.verdict), ToneOf(report.verdict), reason};
}

std::string Points(const std::optional<double>& share) {
  return share ? fmt::format("{:.1f} points", 100 * *share) : "none";
}

// Of each condition in their order.
std::string LossesSeen(const std::vector<ConditionReport>& conditions) {
  std::vector<std::string> losses;
  for (const ConditionReport& c : conditions) losses.push_back(Points(c.test.least_loss_seen));
  return fmt::format("{}", fmt::join(losses, ", "));
}

std::vector<report::Fact> FactsOf(const GateReport& report) {
  size_t trials = 0, failing = 0;
  for (const ConditionReport& c : report.conditions) {
    trials += c.trials.size();
    failing += c.newly_failing_seeds.size();
  }
  std::vector<report::Fact> facts = {
      {"conditions", std::to_string(report.conditions.size())},
      {"trials", std::to_string(trials), "that the verdict rests on"},
      {"no longer dock", std::to_string(failing), "seeds that docked in the baseline"},
      {"alpha", fmt::format("{:g}", report.alpha),
       fmt::format("chance to fail by mistake, of each {}", NameOf(report.alpha_covers))},
      {"would have seen", LossesSeen(report.conditions),
       "less success, in the conditions' order, with 80 % power"},
      {"not varied", "all scenario keys", "within a condition only the seed is"},
      {"build", report.build},
      {"baseline", report.baseline_build}};
  if (!report.assignments.empty())
    facts.push_back({"set", fmt::format("{}", fmt::join(report.assignments, ", ")),
                     "in every condition, by --set"});
  return facts;
}

// What the success rate's tests can tell.
Section Sizes(const std::vector<std::pair<std::string, TestSize>>& tests) {
  report::Table table({"<condition", "margin", "alpha", "beta", "trials at most", "without change",
                       "worse fails", "fails with 80 %"});
  for (const auto& [name, test] : tests)
    table.Row({name, fmt::format("{:g} points", 100 * test.margin),
               fmt::format("{:.2g}", test.alpha), fmt::format("{:.2g}", test.beta),
               std::to_string(test.max_trials),
               test.passes_unchanged ? Fixed(test.unchanged_trials, 0) : "never passes",
               fmt::format("{:.1f} %", 100 * test.worse_fails), Points(test.least_loss_seen)});
  return {.title = "What the success rate's tests can tell",
          .note =
              "Of a build that does as the baseline's but for what it loses, exactly. Without "
              "change: the trials after which it passes. Worse: by the margin. Last: the "
              "least loss that fails with a probability of 80 %. Alpha is this test's share.",
          .table = table};
}

Section Measures(const GateReport& report) {
  report::Table table({"<condition", "<measure", "<verdict", "after", "baseline", "now", "margin",
                       "trials", "worse", "better"});
  for (const ConditionReport& c : report.conditions)
    for (const MeasureReport& m : c.measures)
      table.Row({c.name,
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

// How the test of the success rate went, and some way beyond, to see where its borders lead.
Panel PathPanel(const ConditionReport& condition) {
  const MeasureReport& rate = condition.measures.front();
  const size_t run = condition.trials.size();
  const size_t shown = std::min(condition.path.size(), std::max(run + 12, run * 8 / 5));
  const std::vector<Look> looks(condition.path.begin(),
                                condition.path.begin() + static_cast<int64_t>(shown));
  double top = 3;
  const auto over_trials = [&](std::optional<int> Look::*count) {
    return report::SamplesOf(looks, [&](const Look& look) {
      const std::optional<int>& y = look.*count;
      if (y) top = std::max(top, *y + 0.6);
      return Sample{static_cast<double>(look.trials), y ? *y : report::kOpen};
    });
  };
  Panel panel{
      .title =
          condition.name + ": " + NameOf(rate.verdict) +
          (rate.decided_after_trials ? fmt::format(" after {} trials", *rate.decided_after_trials)
                                     : ""),
      .x = {.label = "trials", .low = 0, .whole = true},
      .y = {.label = "seeds that no longer dock", .low = -0.4, .whole = true},
      .series = {{"fails from here", over_trials(&Look::fails_at), report::CurveColor(1),
                  Mark::kDashedSteps},
                 {"passes up to here", over_trials(&Look::passes_at), report::CurveColor(2),
                  Mark::kDashedSteps},
                 {"so far", over_trials(&Look::worse), report::CurveColor(0), Mark::kSteps, 3.5}}};
  panel.y.high = top;
  return panel;
}

Section Paths(const GateReport& report) {
  Section section{.title = "How the test of the success rate went",
                  .note =
                      "The line is what was counted so far. Where it reaches the upper border "
                      "the gate fails, at the lower one it passes; between them it asks for "
                      "more trials.",
                  .wide = true};
  for (const ConditionReport& c : report.conditions)
    if (!c.path.empty()) section.panels.push_back(PathPanel(c));
  return section;
}

Section ChangedSeeds(const GateReport& report) {
  Section section{.title = "Seeds that changed"};
  report::Table table({"<condition", "seed", "<change", "<outcome now", "time [s]"});
  for (const ConditionReport& c : report.conditions)
    for (const GateTrial& trial : c.trials) {
      const bool fails = std::ranges::count(c.newly_failing_seeds, trial.seed) > 0;
      if (!fails && std::ranges::count(c.newly_docking_seeds, trial.seed) == 0) continue;
      const std::string seed = std::to_string(trial.seed);
      table.Row({c.name,
                 fails ? report::Cell(seed, Tone::kNone, BundleName(c.name, trial.seed)) : seed,
                 {fails ? "fails now" : "docks now", fails ? Tone::kBad : Tone::kGood},
                 NameOf(trial.outcome),
                 Fixed(trial.quality.time_s, 1)});
    }
  if (table.rows().empty())
    section.lines = {"None: every seed ended as in the baseline."};
  else
    section.table = table;
  return section;
}

std::string Escaped(std::string_view text) {
  static const std::map<char, std::string> kEntities = {
      {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\n', "\n"}, {'\t', "\t"}};
  std::string out;
  for (const char c : text) {
    const auto entity = kEntities.find(c);
    if (entity != kEntities.end())
      out += entity->second;
    else  // XML 1.0 has no other control characters
      out += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  }
  return out;
}

std::string Properties(const GateReport& report, const ConditionReport& c) {
  const auto interval = [](const statistics::Interval& i) {
    return fmt::format("{:.4f} {:.4f}", i.low, i.high);
  };
  std::vector<int64_t> seeds;
  for (const GateTrial& trial : c.trials) seeds.push_back(trial.seed);
  const auto n = static_cast<double>(seeds.size());
  const std::vector<std::pair<std::string, std::string>> properties = {
      {"verdict", NameOf(c.verdict)},
      {"n", std::to_string(seeds.size())},
      {"docked", std::to_string(c.docked)},
      {"success_rate", seeds.empty() ? "" : fmt::format("{:.4f}", c.docked / n)},
      {"interval_95", interval(c.interval_95)},
      {"baseline_n", std::to_string(c.baseline_trials)},
      {"baseline_docked", std::to_string(c.baseline_docked)},
      {"baseline_interval_95", interval(c.baseline_interval_95)},
      {"seeds", fmt::format("{}", fmt::join(seeds, " "))},
      {"newly_failing_seeds", fmt::format("{}", fmt::join(c.newly_failing_seeds, " "))},
      {"build", report.build},
      {"baseline_build", report.baseline_build}};
  std::string text;
  for (const auto& [name, value] : properties)
    if (!value.empty())
      text += fmt::format("      <property name=\"{}\" value=\"{}\"/>\n", name, Escaped(value));
  return "    <properties>\n" + text + "    </properties>\n";
}

}  // namespace

std::string ShownValue(double value, const std::string& unit) {
  if (unit.empty()) return fmt::format("{:.1f} %", 100 * value);
  if (unit == "m") return fmt::format("{:.1f} mm", 1000 * value);
  return fmt::format("{:.{}f} {}", value, unit == "F" ? 3 : unit == "V" ? 2 : 1, unit);
}

std::string BundleName(const std::string& condition, int64_t seed) {
  std::string name;  // good for a file everywhere
  for (const char c : condition) name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return fmt::format("{}_{}", name, seed);
}

report::Report ReportOf(const GateReport& report) {
  report::Report shown{.kind = "gate",
                       .title = report.description.empty() ? "docking gate" : report.description,
                       .build = report.build,
                       .verdict = VerdictOf(report),
                       .facts = FactsOf(report),
                       .sections = {Measures(report), ChangedSeeds(report)}};
  std::vector<std::pair<std::string, TestSize>> tests;
  for (const ConditionReport& c : report.conditions) tests.emplace_back(c.name, c.test);
  if (const Section paths = Paths(report); !paths.panels.empty()) shown.sections.push_back(paths);
  shown.sections.push_back(Sizes(tests));
  return shown;
}

report::Report SizeReport(const GatePlan& plan) {
  std::vector<std::pair<std::string, TestSize>> tests;
  for (const GateCondition& condition : plan.conditions)
    tests.emplace_back(condition.name, SizeOf(plan.OptionsFor(condition)));
  return {.kind = "gate_plan_size",
          .title = "trials of a gate" + (plan.description.empty() ? "" : ": " + plan.description),
          .sections = {Sizes(tests)}};
}

report::Json SizesOf(const GatePlan& plan) {
  report::Json conditions = report::Json::array();
  for (const GateCondition& condition : plan.conditions) {
    report::Json& size = conditions.emplace_back(SizeOf(plan.OptionsFor(condition)));
    size["condition"] = condition.name;
  }
  return {{"conditions", conditions}};
}

std::string Junit(const GateReport& report) {
  const auto count = [&](Verdict verdict) {
    return std::ranges::count(report.conditions, verdict, &ConditionReport::verdict);
  };
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<testsuites name=\"turbidock gate\" tests=\"{}\" failures=\"{}\" errors=\"{}\">\n",
      report.conditions.size(), count(Verdict::kFail), count(Verdict::kInconclusive));
  for (const ConditionReport& c : report.conditions) {
    const bool failed = c.verdict == Verdict::kFail, unsure = c.verdict == Verdict::kInconclusive;
    std::string problem;
    if (failed || unsure)
      problem =
          fmt::format("      <{} type=\"{}\" message=\"{}\"/>\n", failed ? "failure" : "error",
                      failed ? "worse" : "inconclusive", Escaped(Reasons(c)));
    text += fmt::format(
        "  <testsuite name=\"{0}\" tests=\"1\" failures=\"{1:d}\" errors=\"{2:d}\">\n{3}"
        "    <testcase name=\"{0}\" classname=\"turbidock.gate\">\n{4}    </testcase>\n"
        "  </testsuite>\n",
        Escaped(c.name), failed, unsure, Properties(report, c), problem);
  }
  return text + "</testsuites>\n";
}

}  // namespace turbidock::gate
