#include "experiments/studies/gate/gate_output.h"

#include <fmt/format.h>

#include <cctype>
#include <map>
#include <string_view>

#include "experiments/report/json.h"
#include "experiments/report/table.h"

namespace turbidock::gate {
namespace {

std::string Shown(const MeasureReport& measure, const std::optional<double>& value) {
  return value ? ShownValue(*value, measure.unit) : "none";
}

std::string ShownMargin(const MeasureReport& measure) {
  const char sign = measure.less_is_worse ? '-' : '+';
  if (measure.unit.empty()) return fmt::format("{}{:g} %", sign, 100 * measure.margin);
  if (measure.unit == "m") return fmt::format("{}{:g} mm", sign, 1000 * measure.margin);
  return fmt::format("{}{:g} {}", sign, measure.margin, measure.unit);
}

std::string VerdictWords(const MeasureReport& measure) {
  if (!measure.decided_after_trials) return "not known yet";
  return fmt::format(
      "{}, known after {} trials",
      measure.verdict == statistics::Verdict::kFail ? "worse" : "no worse by the margin",
      *measure.decided_after_trials);
}

std::string SeedList(const std::vector<int64_t>& seeds) {
  return fmt::format("{}", fmt::join(seeds, " "));
}

// What was found, a row a measure.
report::Table Measures(const GateReport& report) {
  report::Table table({"<condition", "<measure", "baseline", "now", "margin", "trials", "worse",
                       "better", "<verdict"});
  for (const ConditionReport& c : report.conditions)
    for (const MeasureReport& m : c.measures)
      table.Row({c.name, m.measure, Shown(m, m.before), Shown(m, m.now), ShownMargin(m),
                 std::to_string(m.compared), std::to_string(m.worse), std::to_string(m.better),
                 NameOf(m.verdict)});
  return table;
}

std::string Escaped(std::string_view text) {
  static const std::map<char, const char*> kEntities = {
      {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}};
  std::string out;
  for (const char c : text)
    if (const auto entity = kEntities.find(c); entity != kEntities.end())
      out += entity->second;
    else  // XML 1.0 has no other control characters
      out += static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t' ? '?' : c;
  return out;
}

std::string Reasons(const ConditionReport& condition) {
  std::vector<std::string> reasons;
  for (const MeasureReport& measure : condition.measures)
    if (measure.verdict == condition.verdict)
      reasons.push_back(DescribeMeasure(measure, condition.paired));
  return fmt::format("{}", fmt::join(reasons, "; "));
}

// The heading of a report: "FAIL: docking at night".
std::string Headline(const GateReport& report) {
  std::string text = NameOf(report.verdict);
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  if (!report.description.empty()) text += ": " + report.description;
  for (const std::string& assignment : report.assignments) text += ", " + assignment;
  return text;
}

}  // namespace

std::string ShownValue(double value, const std::string& unit) {
  if (unit.empty()) return fmt::format("{:.1f} %", 100 * value);
  if (unit == "m") return fmt::format("{:.1f} mm", 1000 * value);
  return fmt::format("{:.{}f} {}", value, unit == "F" ? 3 : unit == "V" ? 2 : 1, unit);
}

std::string DescribeMeasure(const MeasureReport& m, bool paired) {
  std::string counts;
  if (m.unit.empty() && paired)
    counts =
        fmt::format("of {} pairs {} no longer dock, {} dock now", m.compared, m.worse, m.better);
  else if (m.unit.empty())
    counts = fmt::format("{} of {} trials docked", m.better, m.compared);
  else if (paired)
    counts = fmt::format("of {} pairs that docked {} are worse, {} better", m.compared, m.worse,
                         m.better);
  else
    counts = fmt::format("of {} trials that docked {} are worse than the baseline's median",
                         m.compared, m.worse);
  return fmt::format("{} {} -> {}: {}; {}", m.measure, Shown(m, m.before), Shown(m, m.now), counts,
                     VerdictWords(m));
}

std::string GateTable(const GateReport& report) {
  std::string table = Measures(report).Text();
  for (const ConditionReport& c : report.conditions)
    if (c.verdict != statistics::Verdict::kPass) table += c.name + ": " + Reasons(c) + "\n";
  return table + Headline(report);
}

std::string GateJson(const GateReport& report) { return report::JsonText(report); }

std::string GateJunit(const GateReport& report) {
  int failures = 0, errors = 0;
  std::string suites;
  for (const ConditionReport& c : report.conditions) {
    const bool failed = c.verdict == statistics::Verdict::kFail,
               unsure = c.verdict == statistics::Verdict::kInconclusive;
    failures += failed;
    errors += unsure;
    suites += fmt::format(
        "  <testsuite name=\"{}\" tests=\"1\" failures=\"{}\" errors=\"{}\">\n    <properties>\n",
        Escaped(c.name), failed ? 1 : 0, unsure ? 1 : 0);
    const auto property = [&](std::string_view name, const std::string& value) {
      suites += fmt::format("      <property name=\"{}\" value=\"{}\"/>\n", name, Escaped(value));
    };
    const auto interval = [](const statistics::Interval& i) {
      return fmt::format("{:.4f} {:.4f}", i.low, i.high);
    };
    property("verdict", NameOf(c.verdict));
    property("n", std::to_string(c.trials.size()));
    property("docked", std::to_string(c.docked));
    if (!c.trials.empty())
      property("success_rate",
               fmt::format("{:.4f}", c.docked / static_cast<double>(c.trials.size())));
    property("interval_95", interval(c.interval_95));
    property("baseline_n", std::to_string(c.baseline_trials));
    property("baseline_docked", std::to_string(c.baseline_docked));
    property("baseline_interval_95", interval(c.baseline_interval_95));
    std::vector<int64_t> seeds;
    for (const GateTrial& trial : c.trials) seeds.push_back(trial.seed);
    property("seeds", SeedList(seeds));
    property("newly_failing_seeds", SeedList(c.newly_failing_seeds));
    property("build", report.build);
    property("baseline_build", report.baseline_build);
    suites +=
        fmt::format("    </properties>\n    <testcase name=\"{}\" classname=\"turbidock.gate\"",
                    Escaped(c.name));
    const std::string reasons = Escaped(Reasons(c));
    if (failed)
      suites += fmt::format(">\n      <failure type=\"worse\" message=\"{}\"/>\n    </testcase>\n",
                            reasons);
    else if (unsure)
      suites += fmt::format(
          ">\n      <error type=\"inconclusive\" message=\"{}\"/>\n    </testcase>\n", reasons);
    else
      suites += "/>\n";
    suites += "  </testsuite>\n";
  }
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<testsuites name=\"turbidock gate\" tests=\"{}\" failures=\"{}\" errors=\"{}\">\n{}"
      "</testsuites>\n",
      report.conditions.size(), failures, errors, suites);
}

std::string GateMarkdown(const GateReport& report) {
  std::string text =
      fmt::format("### Docking gate: {}\n\n{}\n", Headline(report), Measures(report).Markdown());
  for (const ConditionReport& c : report.conditions) {
    if (c.verdict != statistics::Verdict::kPass)
      text += fmt::format("- **{}**: {}\n", c.name, Reasons(c));
    if (!c.newly_failing_seeds.empty())
      text += fmt::format("- {}: seeds that docked before and no longer do: {}\n", c.name,
                          SeedList(c.newly_failing_seeds));
  }
  return text + fmt::format("\nBuild {}, baseline from {}{}.\n", report.build,
                            report.baseline_build,
                            report.paired ? ", compared seed by seed" : ", on other seeds");
}

}  // namespace turbidock::gate
