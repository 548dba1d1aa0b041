#include "experiments/studies/gate/gate_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "experiments/config/data_files.h"
#include "experiments/config/nearest_name.h"
#include "sim/base/check.h"
#include "sim/base/digest.h"

namespace turbidock::gate {
namespace {

namespace fs = std::filesystem;

constexpr const char *kGroup = "gate", *kConditionsKey = "conditions", *kNeverKey = "never";

// `has_ranges`: the plan, whose boundary is judged then and nothing else.
void ReadSettings(const config::YamlNode& node, bool has_ranges, auto* settings,
                  config::Origins* origins) {
  config::ReadFields(node, settings, origins, {kConditionsKey, kNeverKey});
  if (const auto most = node.Find("max_trials"); most && has_ranges)
    most->Fail("the plan has ranges: the trials are those that the baseline chose");
  if (const auto margins = node.Find("margins"))
    for (const auto& [key, value] : margins->Entries())
      if ((key == batch::kArea) != has_ranges)
        value.Fail(has_ranges ? "the plan has ranges: the only margin is `area`"
                              : "is for a plan with ranges");
  const auto never = node.Find(kNeverKey);
  if (!never) return;
  if (has_ranges)
    never->Fail("the plan has ranges, whose trials are also where docking fails: leave it out");
  if (!never->IsList()) never->Fail("must be a list of outcomes");
  settings->never.clear();
  for (const config::YamlNode& outcome : never->Elements()) {
    config::ReadValue(outcome, &settings->never.emplace_back());
    if (settings->never.back() == trial::Outcome::kSuccess)
      outcome.Fail("'success' is what a gate is for");
    if (settings->never.back() == trial::Outcome::kHung ||
        settings->never.back() == trial::Outcome::kCrashed)
      outcome.Fail("a trial that hangs or crashes is no verdict: the gate ends with 4 in any case");
  }
}

// Of what the plan says of a cell, and of what that reads. What the program itself brings along may
// change: that is what the gate is for.
std::string DigestOfCell(const batch::Plan& plan, int64_t cell, const batch::CellText& text) {
  Digest digest;
  digest.Add(text.given);
  digest.Add(config::LoadYaml(text.scenario_file).OneLine());
  for (const trial::ModelFile& file : plan.ScenarioOf(plan.FirstOf(cell)).model_files)
    if (fs::path(file.file).is_absolute()) digest.Add(file.content);
  return digest.Hex();
}

// The conditions with what they have of their own; `measured` is the plan without what the command
// line gives.
std::vector<Condition> ConditionsOf(const batch::Plan& measured, const GateSettings& settings,
                                    const config::YamlNode& group, config::Origins* origins) {
  std::vector<Condition> conditions;
  std::vector<std::string> names;
  const auto& ranges = measured.envelope();
  for (int64_t cell = 0; cell < measured.cells(); cell += PlacesOf(measured)) {
    const batch::CellText text = measured.TextOf(cell);
    names.push_back(text.name);
    conditions.push_back({.name = text.name,
                          .given = text.given,
                          .digest = DigestOfCell(measured, cell, text),
                          .settings = settings});
  }
  if (const auto own = group.Find(kConditionsKey))
    for (const auto& [name, node] : own->Entries()) {
      const auto found = std::ranges::find(names, name) - names.begin();
      if (found == std::ssize(names))
        node.Fail("the plan has no condition '" + name + "'" + config::DidYouMean(name, names));
      if (node.Find(kConditionsKey)) node.Fail("has no conditions of its own");
      ReadSettings(node, ranges.has_value(), &conditions[static_cast<size_t>(found)].settings,
                   origins);
    }
  int tests = 0;
  for (Condition& condition : conditions) {
    if (ranges && !(condition.settings.margins.area > 0))
      group.Fail("margins.area: this key is required where a plan has ranges");
    int& most = condition.settings.max_trials;
    if (most == 0) most = measured.settings().seeds;
    if (most > measured.settings().seeds)
      group.Fail(fmt::format("condition '{}': max_trials {} is more than the plan's {} seeds",
                             condition.name, most, measured.settings().seeds));
    if (condition.settings.alpha + condition.settings.beta >= 1)
      group.Fail(fmt::format("condition '{}': alpha {:g} and beta {:g} must be below 1 together",
                             condition.name, condition.settings.alpha, condition.settings.beta));
    tests += condition.settings.margins.tests();
  }
  for (Condition& condition : conditions)
    condition.tests = settings.alpha_covers == AlphaCovers::kGate ? tests
                      : settings.alpha_covers == AlphaCovers::kCondition
                          ? condition.settings.margins.tests()
                          : 1;
  return conditions;
}

}  // namespace

int64_t PlacesOf(const batch::Plan& plan) {
  return plan.envelope() ? plan.envelope()->points() : 1;
}

Gate LoadGate(const std::string& name, const trial::Plugins& plugins,
              const std::vector<config::Assignment>& given) {
  const std::string file = config::FindBundled("gates", "gate", name);
  const config::YamlNode node = config::LoadYaml(file);
  const batch::PlanOverrides overrides{
      .plugins = plugins,
      .use = kGroup,
      .refused = {{"precision", "a gate runs until its own tests know"}}};
  const batch::Plan measured(node, overrides);
  const auto group = node.Find(kGroup);
  if (!group)
    throw ConfigError(file + ": gate: this key is required: a gate's baseline and margins");
  GateSettings settings;
  config::Origins origins;
  ReadSettings(*group, measured.envelope().has_value(), &settings, &origins);
  if (settings.baseline.empty()) group->Fail("needs the key baseline");
  std::vector<Condition> conditions = ConditionsOf(measured, settings, *group, &origins);
  config::CheckSettings(settings, origins);
  settings.baseline =
      (fs::path(file).parent_path() / settings.baseline).lexically_normal().string();
  if (given.empty()) return {settings, measured, std::move(conditions), {}};
  batch::PlanOverrides with_given = overrides;
  with_given.assignments = given;
  std::vector<std::string> texts;
  for (const config::Assignment& each : config::LeavesOf(given))
    texts.push_back(each.key + "=" + each.value.OneLine());
  return {settings, batch::Plan(node, with_given), std::move(conditions), texts};
}

std::vector<config::KeyDoc> GateKeys() {
  std::vector<config::KeyDoc> keys = config::ListKeys<GateSettings>();
  for (config::KeyDoc& key : keys) key.required = key.key == "baseline";
  keys.push_back({.key = kNeverKey,
                  .type = "list of outcomes",
                  .value = "[]",
                  .range = "",
                  .doc = "outcomes of which a single trial fails the gate at once"});
  keys.push_back({.key = kConditionsKey,
                  .type = "map of names",
                  .value = "{}",
                  .range = "",
                  .doc = "settings of single conditions by name, in place of the gate's: alpha, "
                         "beta, max_trials, margins, never"});
  return keys;
}

}  // namespace turbidock::gate
