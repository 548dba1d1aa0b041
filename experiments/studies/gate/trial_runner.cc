#include "experiments/studies/gate/trial_runner.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <utility>

#include "experiments/system/build_info.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

constexpr const char* kConditionKey = "case";  // as of the named cells of a batch

GateTrial GateTrialOf(const farm::StoredTrial& stored) {
  const trial::TrialRecord& record = stored.record;
  if (!record.ended())
    throw SimulatorFault(fmt::format("condition '{}', seed {}: the trial {}: {}\n{}",
                                     stored.parameters.front().value, record.seed,
                                     NameOf(record.outcome), record.reason, record.printed));
  return {.seed = record.seed,
          .outcome = record.outcome,
          .quality = QualityOf(record),
          .digest = record.digest};
}

// Everything that decides the gate's trials. Margins and the like do not, nor does the baseline.
std::string ResolvedTrials(const GatePlan& plan, const std::vector<std::string>& assignments) {
  std::string text = fmt::format("seed: {}\nprogram: {}\n", plan.seed, system::ProgramDigest());
  text += "conditions:\n";
  std::map<std::string, trial::Scenario> scenarios;
  for (const GateCondition& condition : plan.conditions) {
    const trial::Scenario& scenario = scenarios[condition.name] =
        condition.Load(assignments, plan.SeedOf(0));
    text += fmt::format("  {}: |\n{}", farm::YamlText(condition.name),
                        system::Indented(trial::SaveScenario(scenario), "    "));
  }
  return text + "models_digest: \"" + farm::ModelsDigest(scenarios) + "\"\n";
}

}  // namespace

GateRunner MakeGateRunner(const GatePlan& plan, const std::vector<std::string>& assignments,
                          farm::RunOptions options, farm::ResultStore* store) {
  options.plugins = plan.plugins;
  const auto runner = std::make_shared<farm::TrialRunner>(options, store);
  const auto conditions = std::ssize(plan.conditions);
  const farm::TrialSource source{
      .spec = [=, &plan](int64_t trial) -> farm::TrialSpec {
        const int64_t condition = trial % conditions, sample = trial / conditions;
        return {
            .trial = trial,
            .cell = condition,
            .sample = sample,
            .seed = plan.SeedOf(static_cast<int>(sample)),
            .parameters = {{kConditionKey, plan.conditions[static_cast<size_t>(condition)].name}}};
      },
      .scenario =
          [=, &plan](const farm::TrialSpec& spec) {
            return plan.conditions[static_cast<size_t>(spec.cell)].Load(assignments, spec.seed);
          }};
  return [=](GateTrials* trials) {
    const farm::TrialDecider decider{
        .next = [=] { return trials->Next(); },
        .add =
            [=](const farm::StoredTrial& trial) { trials->Add(trial.trial, GateTrialOf(trial)); }};
    if (!runner->Run(source, decider)) throw farm::Stopped();
  };
}

farm::ResultStore OpenTrials(const std::string& file, const GatePlan& plan,
                             const std::vector<std::string>& assignments,
                             const std::function<void(const std::string&)>& say) {
  const farm::StoreHeader header{.kind = "gate",
                                 .plan = ResolvedTrials(plan, assignments),
                                 .build = system::BuildId(),
                                 .shard = {},
                                 .trials = 0,
                                 .keys = {kConditionKey}};
  try {
    return farm::ResultStore::Write(file, header);
  } catch (const farm::OtherResults& other) {
    say(fmt::format("{}: has trials of another gate or build ({}): begun anew", file,
                    other.difference));
    std::filesystem::remove(file);
    return farm::ResultStore::Write(file, header);
  }
}

}  // namespace turbidock::gate
