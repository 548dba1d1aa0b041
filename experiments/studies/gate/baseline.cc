#include "experiments/studies/gate/baseline.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

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

// "184 of 200 (92.0 %)".
std::string Docked(const BaselineCondition& c) {
  return fmt::format("{} of {} ({})", c.docked, c.trials, ShownValue(c.success_rate, ""));
}

// "time to dock 39.6 s -> 42.4 s, ...": what differs.
std::string MedianChanges(const BaselineCondition& before, const BaselineCondition& after) {
  std::vector<std::string> changes;
  for (const MedianMeasure& measure : kMedianMeasures) {
    const auto was = DockedMedian(before.outcomes, measure.value),
               is = DockedMedian(after.outcomes, measure.value);
    if (!was || !is) continue;
    const std::string from = ShownValue(*was, measure.unit), to = ShownValue(*is, measure.unit);
    if (from != to) changes.push_back(fmt::format("{} {} -> {}", measure.name, from, to));
  }
  return fmt::format("{}", fmt::join(changes, ", "));
}

// What its trials say, whatever its figures do: those are for people.
void RequireWhole(const BaselineCondition& c, int64_t gate_seed, const std::string& file) {
  const auto fail = [&](const std::string& why) {
    throw ConfigError(file + ": condition '" + c.name + "' " + why);
  };
  const auto docked = std::ranges::count_if(c.outcomes, &GateTrial::docked);
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
  const auto found = std::ranges::find(conditions, name, &BaselineCondition::name);
  return found == conditions.end() ? nullptr : &*found;
}

BaselineCondition MakeBaselineCondition(const GateCondition& condition,
                                        const std::vector<GateTrial>& outcomes) {
  const auto docked = std::ranges::count_if(outcomes, &GateTrial::docked);
  const auto trials = std::ssize(outcomes);
  const statistics::Interval interval = statistics::WilsonInterval(docked, trials);
  return {.name = condition.name,
          .scenario = condition.scenario,
          .settings = JoinAssignments(condition.assignments),
          .digest = condition.digest,
          .trials = static_cast<int>(trials),
          .docked = static_cast<int>(docked),
          .success_rate = static_cast<double>(docked) / static_cast<double>(trials),
          .interval_95 = {interval.low, interval.high},
          .outcomes = outcomes};
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
  if (plan.seed != baseline.seed)
    fail(fmt::format("its trials are those of seed {}, the gate's seed is {}", baseline.seed,
                     plan.seed));
  for (const GateCondition& condition : plan.conditions) {
    const std::string of = "condition '" + condition.name + "'";
    const BaselineCondition* known = baseline.Find(condition.name);
    if (!known) return fail("it has no " + of);
    const std::string settings = JoinAssignments(condition.assignments);
    if (known->scenario != condition.scenario)
      fail(fmt::format("{} was measured in scenario {}, the gate says {}", of, known->scenario,
                       condition.scenario));
    if (known->settings != settings)
      fail(fmt::format("{} was measured with '{}', the gate sets '{}'", of, known->settings,
                       settings));
    if (known->digest != condition.digest)
      fail(fmt::format("the scenario file {} of {} has changed", condition.scenario, of));
  }
  for (const BaselineCondition& known : baseline.conditions)
    if (std::ranges::count(plan.conditions, known.name, &GateCondition::name) == 0)
      fail("the gate has no condition '" + known.name + "'");
}

report::Table ChangeTable(const Baseline& before, const Baseline& after) {
  report::Table table({"<condition", "<docked before", "<now", "no longer dock", "dock now",
                       "bit for bit as before", "<medians"});
  for (const BaselineCondition& now : after.conditions) {
    const BaselineCondition* was = before.Find(now.name);
    if (!was) {
      table.Row({now.name, "new", Docked(now)});
      continue;
    }
    int lost = 0, gained = 0, same = 0;
    for (const GateTrial& trial : now.outcomes) {
      const auto old = std::ranges::find(was->outcomes, trial.seed, &GateTrial::seed);
      if (old == was->outcomes.end()) continue;
      lost += old->docked() && !trial.docked();
      gained += !old->docked() && trial.docked();
      same += old->digest == trial.digest;
    }
    table.Row({now.name, Docked(*was), Docked(now), std::to_string(lost), std::to_string(gained),
               std::to_string(same), MedianChanges(*was, now)});
  }
  for (const BaselineCondition& was : before.conditions)
    if (!after.Find(was.name)) table.Row({was.name, Docked(was), "gone"});
  return table;
}

}  // namespace turbidock::gate
