#include "experiments/studies/gate/baseline.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>

#include "experiments/config/yaml_fields.h"
#include "experiments/system/output_path.h"
#include "sim/base/check.h"
#include "sim/base/digest.h"

namespace turbidock::gate {
namespace {

// How every baseline ends, of whatever schema.
constexpr std::string_view kChecksumKey = "checksum: ";

std::string ChecksumLine(const std::string& covered) {
  return fmt::format("{}\"{}\"\n", kChecksumKey, DigestOf(covered));
}

std::string Quoted(const std::string& text) {
  YAML::Emitter out;
  out << YAML::DoubleQuoted << text;
  return out.c_str();
}

}  // namespace

const BaselineCondition* Baseline::Find(const std::string& name) const {
  const auto found = std::ranges::find(conditions, name, &BaselineCondition::name);
  return found == conditions.end() ? nullptr : &*found;
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
    for (const GateTrial& t : c.outcomes) {
      text += fmt::format("      - {{seed: {}, outcome: {}", t.seed, NameOf(t.outcome));
      for (size_t i = 0; i < kMedianMeasures.size(); ++i)
        text += fmt::format(", {}: {}", kMedianMeasures[i].key, FormatNumber(t.values[i]));
      text += fmt::format(", digest: \"{}\"}}\n", t.digest);
    }
  }
  return text + ChecksumLine(text);
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
  const std::string covered = text.substr(0, text.rfind(kChecksumKey));
  if (text != covered + ChecksumLine(covered))
    throw ConfigError(file +
                      ": the checksum does not match: the file was edited or damaged after it was "
                      "written; restore it, or measure it anew with --update");
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
    if (known->scenario != condition.scenario || known->settings != condition.settings)
      fail(fmt::format("{} was measured in scenario {} with '{}', the gate says {} with '{}'", of,
                       known->scenario, known->settings, condition.scenario, condition.settings));
    if (known->digest != condition.digest)
      fail(fmt::format("the scenario file {} of {} has changed", condition.scenario, of));
  }
  for (const BaselineCondition& known : baseline.conditions)
    if (std::ranges::count(plan.conditions, known.name, &GateCondition::name) == 0)
      fail("the gate has no condition '" + known.name + "'");
}

}  // namespace turbidock::gate
