#include "experiments/studies/gate/baseline.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

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

std::string BaselineText(const Baseline& baseline) {
  std::string text = std::string(kBaselineFile.mark) +
                     " GATE.yaml --update`. Do not edit: the\n"
                     "# checksum covers every byte above it.\n";
  text += fmt::format("schema_version: {}\nbuild: {}\nseed: {}\nconditions:\n", kBaselineSchema,
                      Quoted(baseline.build), baseline.seed);
  for (const BaselineCondition& c : baseline.conditions) {
    text += fmt::format(
        "  - name: {}\n    given: {}\n    digest: \"{}\"\n    trials: {}\n    successes: {}\n"
        "    success_rate: {}\n    interval_95: [{:.4f}, {:.4f}]\n    outcomes:\n",
        Quoted(c.name), Quoted(c.given), c.digest, c.trials, c.successes,
        FormatNumber(c.success_rate), c.interval_95.at(0), c.interval_95.at(1));
    for (const batch::ComparedTrial& t : c.outcomes) {
      text += fmt::format("      - {{{}seed: {}, outcome: {}",
                          t.trial < 0 ? "" : fmt::format("trial: {}, ", t.trial), t.seed,
                          NameOf(t.outcome));
      for (size_t i = 0; i < batch::kMeasures.size(); ++i)
        if (!std::isnan(t.values[i]))
          text += fmt::format(", {}: {}", batch::kMeasures[i].name, FormatNumber(t.values[i]));
      text += fmt::format(", digest: \"{}\"}}\n", t.digest);
    }
  }
  return text + ChecksumLine(text);
}

Baseline LoadBaseline(const std::string& file) {
  if (const std::string why = system::WhyUnreadable(file); !why.empty())
    throw ConfigError(
        fmt::format("{}: {}: there is no baseline; the gate makes it with --update", file, why));
  Baseline baseline;
  try {
    baseline = config::LoadLayers<Baseline>({file}, {});
  } catch (const ConfigError& error) {  // of another version, or no baseline at all
    throw ConfigError(std::string(error.what()) + "; measure it anew with --update");
  }
  // As it was written, also where a checkout has given its lines other ends.
  std::string text = system::ReadWhole(file);
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  std::erase(text, '\r');
  const std::string covered = text.substr(0, text.rfind(kChecksumKey));
  if (text != covered + ChecksumLine(covered))
    throw ConfigError(file +
                      ": the checksum does not match: the file was edited or damaged after it was "
                      "written; restore it, or measure it anew with --update");
  return baseline;
}

std::vector<BaselineCondition> ConditionsOf(const Gate& gate, const Baseline& baseline) {
  const auto fail = [&gate](const std::string& why) {
    throw ConfigError(gate.settings.baseline + ": is from another plan: " + why +
                      "; measure it anew with --update");
  };
  const int64_t seed = gate.plan.settings().master_seed;
  if (seed != baseline.seed)
    fail(fmt::format("its trials are those of master_seed {}, the gate's is {}", baseline.seed,
                     seed));
  std::vector<BaselineCondition> conditions;
  for (const Condition& condition : gate.conditions) {
    const std::string of = "condition '" + condition.name + "'";
    const auto known =
        std::ranges::find(baseline.conditions, condition.name, &BaselineCondition::name);
    if (known == baseline.conditions.end()) fail("it has no " + of);
    if (known->given != condition.given)
      fail(fmt::format("{} was measured with '{}', the gate gives '{}'", of, known->given,
                       condition.given));
    if (known->digest != condition.digest)
      fail(fmt::format("the scenario or another file of {} has changed", of));
    conditions.push_back(*known);
  }
  for (const BaselineCondition& known : baseline.conditions)
    if (std::ranges::count(gate.conditions, known.name, &Condition::name) == 0)
      fail("the gate has no condition '" + known.name + "'");
  return conditions;
}

}  // namespace turbidock::gate
