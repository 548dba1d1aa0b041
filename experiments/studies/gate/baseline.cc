#include "experiments/studies/gate/baseline.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>

#include "experiments/config/yaml_fields.h"
#include "experiments/studies/gate/gate_report.h"
#include "experiments/system/output_path.h"
#include "sim/base/check.h"
#include "sim/base/digest.h"
#include "sim/base/random.h"

namespace turbidock::gate {
namespace {

// How every baseline ends, of whatever schema.
constexpr std::string_view kChecksumKey = "checksum: ";

std::string Quoted(const std::string& text) {
  YAML::Emitter out;
  out << YAML::DoubleQuoted << text;
  return out.c_str();
}

std::string JoinAssignments(const std::vector<std::string>& assignments) {
  return fmt::format("{}", fmt::join(assignments, " "));
}

std::string Percent(double share) { return fmt::format("{:.1f} %", 100 * share); }

std::string Rate(const BaselineCondition& c) {
  return fmt::format("{} of {} docked ({}, 95 % interval {} to {})", c.docked, c.trials,
                     Percent(c.success_rate), Percent(c.interval_95.at(0)),
                     Percent(c.interval_95.at(1)));
}

void DescribeMedian(const BaselineCondition& before, const BaselineCondition& after,
                    const MedianMeasure& measure, std::vector<std::string>* lines) {
  const auto old_median = statistics::Median(DockedValues(before.outcomes, measure.value)),
             new_median = statistics::Median(DockedValues(after.outcomes, measure.value));
  if (!old_median || !new_median || *old_median == *new_median) return;
  const auto shown = [&](double value) { return ShownValue(value, measure.unit); };
  lines->push_back(fmt::format("  median {} {} -> {} ({}{})", measure.name, shown(*old_median),
                               shown(*new_median), *new_median > *old_median ? "+" : "",
                               shown(*new_median - *old_median)));
}

// What its trials say, whatever its figures do: those are for people.
void RequireWhole(const BaselineCondition& c, int64_t gate_seed, const std::string& file) {
  const auto fail = [&](const std::string& why) {
    throw ConfigError(file + ": condition '" + c.name + "' " + why);
  };
  const auto docked = std::count_if(c.outcomes.begin(), c.outcomes.end(),
                                    [](const GateTrial& trial) { return trial.docked(); });
  if (c.trials != std::ssize(c.outcomes) || c.docked != docked || c.interval_95.size() != 2)
    fail("is incomplete");
  const SeedTree seeds(static_cast<uint64_t>(gate_seed));
  for (int i = 0; i < c.trials; ++i)
    if (const int64_t seed = c.outcomes[static_cast<size_t>(i)].seed; seed != seeds.TrialSeed(i))
      fail(fmt::format("has a trial of seed {}, which is none of the gate's seed {}", seed,
                       gate_seed));
}

}  // namespace

const BaselineCondition* Baseline::Find(const std::string& name) const {
  const auto found = std::find_if(conditions.begin(), conditions.end(),
                                  [&](const BaselineCondition& c) { return c.name == name; });
  return found == conditions.end() ? nullptr : &*found;
}

BaselineCondition MakeBaselineCondition(const GateCondition& condition,
                                        const std::vector<GateTrial>& outcomes) {
  BaselineCondition made;
  made.name = condition.name;
  made.scenario = condition.scenario;
  made.settings = JoinAssignments(condition.assignments);
  made.digest = condition.digest;
  made.trials = static_cast<int>(outcomes.size());
  made.docked = static_cast<int>(
      std::count_if(outcomes.begin(), outcomes.end(), [](const auto& t) { return t.docked(); }));
  made.success_rate = made.trials > 0 ? static_cast<double>(made.docked) / made.trials : 0;
  const statistics::Interval interval = statistics::WilsonInterval(made.docked, made.trials);
  made.interval_95 = {interval.low, interval.high};
  made.outcomes = outcomes;
  return made;
}

std::string BaselineText(const Baseline& baseline) {
  std::string text = std::string(kBaselineFile.mark) +
                     " GATE.yaml --update`. Do not edit: the\n"
                     "# checksum covers every byte above it.\n";
  text += fmt::format("schema_version: {}\nbuild: {}\nseed: {}\nconditions:\n", kBaselineSchema,
                      Quoted(baseline.build), baseline.seed);
  for (const BaselineCondition& c : baseline.conditions) {
    text += fmt::format(
        "  - name: {}\n    scenario: {}\n    settings: {}\n    digest: \"{}\"\n    trials: {}\n"
        "    docked: {}\n    success_rate: {}\n    interval_95: [{:.4f}, {:.4f}]\n    outcomes:\n",
        Quoted(c.name), Quoted(c.scenario), Quoted(c.settings), c.digest, c.trials, c.docked,
        FormatNumber(c.success_rate), c.interval_95.at(0), c.interval_95.at(1));
    for (const GateTrial& t : c.outcomes)
      text += fmt::format(
          "      - {{seed: {}, outcome: {}, time_s: {}, final_error_m: {}, returns_to_servoing: "
          "{}, "
          "fitness: {}, effort_v: {}, digest: \"{}\"}}\n",
          t.seed, NameOf(t.outcome), FormatNumber(t.quality.time_s),
          FormatNumber(t.quality.final_error_m), FormatNumber(t.quality.returns_to_servoing),
          FormatNumber(t.quality.fitness), FormatNumber(t.quality.effort_v), t.digest);
  }
  return text + std::string(kChecksumKey) + "\"" + DigestOf(text) + "\"\n";
}

Baseline LoadBaseline(const std::string& file) {
  if (const std::string why = system::WhyUnreadable(file); !why.empty())
    throw ConfigError(file + ": " + why +
                      ": there is no baseline; `turbidock gate GATE.yaml --update` makes it");
  Baseline baseline;
  try {
    baseline = config::LoadLayers<Baseline>({file}, {});
  } catch (const ConfigError& error) {  // of another version, or no baseline at all
    throw ConfigError(std::string(error.what()) + "; measure it anew with --update");
  }
  const std::string text = system::ReadWhole(file);
  const size_t end = text.rfind(kChecksumKey);
  const std::string covered = text.substr(0, end == std::string::npos ? text.size() : end);
  const std::string tail = std::string(kChecksumKey) + "\"" + DigestOf(covered) + "\"\n";
  if (end == std::string::npos || text.substr(end) != tail)
    throw ConfigError(file +
                      ": the checksum does not match: the file was edited or damaged after it was "
                      "written; restore it, or measure it anew with --update");
  for (const BaselineCondition& c : baseline.conditions) RequireWhole(c, baseline.seed, file);
  return baseline;
}

void RequireSamePlan(const GatePlan& plan, const Baseline& baseline, const std::string& file) {
  const auto fail = [&file](const std::string& why) {
    throw ConfigError(file + ": is from another plan: " + why + "; measure it anew with --update");
  };
  for (const GateCondition& condition : plan.conditions) {
    const std::string of = "condition '" + condition.name + "'";
    const BaselineCondition* known = baseline.Find(condition.name);
    if (!known) return fail("it has no " + of);
    if (known->scenario != condition.scenario)
      fail(fmt::format("{} was measured in scenario {}, the gate says {}", of, known->scenario,
                       condition.scenario));
    const std::string settings = JoinAssignments(condition.assignments);
    if (known->settings != settings)
      fail(fmt::format("{} was measured with '{}', the gate sets '{}'", of, known->settings,
                       settings));
    if (known->digest != condition.digest)
      fail(fmt::format("the scenario file {} of {} has changed", condition.scenario, of));
  }
  for (const BaselineCondition& known : baseline.conditions)
    if (std::none_of(plan.conditions.begin(), plan.conditions.end(),
                     [&](const GateCondition& c) { return c.name == known.name; }))
      fail("the gate has no condition '" + known.name + "'");
}

std::vector<std::string> DescribeChange(const Baseline& before, const Baseline& after) {
  std::vector<std::string> lines;
  const bool first = before.conditions.empty();
  if (!first) lines.push_back(fmt::format("build {} -> {}", before.build, after.build));
  if (!first && before.seed != after.seed)
    lines.push_back(fmt::format("other seeds: {} -> {}", before.seed, after.seed));
  for (const BaselineCondition& now : after.conditions) {
    const BaselineCondition* was = before.Find(now.name);
    if (!was) {
      lines.push_back(fmt::format("{}: new, {}", now.name, Rate(now)));
      continue;
    }
    std::map<int64_t, const GateTrial*> old_trials;
    for (const GateTrial& trial : was->outcomes) old_trials[trial.seed] = &trial;
    int shared = 0, lost = 0, gained = 0, same = 0;
    for (const GateTrial& trial : now.outcomes) {
      const auto found = old_trials.find(trial.seed);
      if (found == old_trials.end()) continue;
      ++shared;
      lost += found->second->docked() && !trial.docked();
      gained += !found->second->docked() && trial.docked();
      same += found->second->digest == trial.digest;
    }
    const bool unchanged = same == now.trials && now.trials == was->trials;
    lines.push_back(now.name + ": " + (unchanged ? "unchanged, " : "now ") + Rate(now) +
                    (unchanged ? "" : ", before " + Rate(*was)));
    if (was->scenario != now.scenario || was->settings != now.settings || was->digest != now.digest)
      lines.push_back("  another condition than before: its scenario or settings changed");
    if (unchanged) continue;
    if (shared > 0)
      lines.push_back(fmt::format(
          "  of {} seeds in both, {} no longer dock, {} dock now, {} ran bit for bit as before",
          shared, lost, gained, same));
    for (const MedianMeasure& measure : kMedianMeasures) DescribeMedian(*was, now, measure, &lines);
  }
  for (const BaselineCondition& was : before.conditions)
    if (!after.Find(was.name)) lines.push_back(was.name + ": gone, had " + Rate(was));
  return lines;
}

}  // namespace turbidock::gate
