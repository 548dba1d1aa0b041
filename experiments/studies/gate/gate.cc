#include "experiments/studies/gate/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>

#include "experiments/system/build_info.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

constexpr const char* kConditionKey = "case";  // as of the named cells of a batch

GateTrial GateTrialOf(const batch::StoredTrial& stored) {
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
std::string ResolvedTrials(const GatePlan& plan) {
  std::string text = fmt::format("seed: {}\nprogram: {}\n", plan.seed, system::ProgramDigest());
  text += "conditions:\n";
  std::map<std::string, trial::Scenario> scenarios;
  for (const GateCondition& condition : plan.conditions) {
    const trial::Scenario& scenario = scenarios[condition.name] =
        condition.Load(plan.assignments, plan.SeedOf(0));
    text += fmt::format("  {}: |\n{}", batch::YamlText(condition.name),
                        system::Indented(trial::SaveScenario(scenario), "    "));
  }
  return text + batch::ModelFilesText(scenarios);
}

}  // namespace

GateTrials::GateTrials(const GatePlan& plan, std::function<int(size_t condition)> wanted,
                       std::function<void(size_t condition, const GateTrial&)> take,
                       GateProgress on_trial)
    : wanted_(std::move(wanted)),
      take_(std::move(take)),
      on_trial_(std::move(on_trial)),
      conditions_(plan.conditions.size()) {}

std::optional<int64_t> GateTrials::Next() {
  std::optional<size_t> first;  // of those that go on, who has begun the fewest
  for (size_t i = 0; i < conditions_.size(); ++i)
    if (conditions_[i].next < wanted_(i) &&
        (!first || conditions_[i].next < conditions_[*first].next))
      first = i;
  if (!first) return std::nullopt;
  return conditions_[*first].next++ * std::ssize(conditions_) + static_cast<int64_t>(*first);
}

void GateTrials::Add(int64_t trial, const GateTrial& result) {
  const auto at = static_cast<size_t>(trial % std::ssize(conditions_));
  Condition& condition = conditions_[at];
  condition.early.emplace(static_cast<int>(trial / std::ssize(conditions_)), result);
  while (const auto next = condition.early.extract(condition.taken)) {
    ++condition.taken;
    take_(at, next.mapped());
  }
  if (!on_trial_) return;
  int done = 0, wanted = 0;
  for (size_t i = 0; i < conditions_.size(); ++i) {
    wanted += wanted_(i);
    done += std::min(conditions_[i].taken, wanted_(i));
  }
  on_trial_(done, wanted);
}

GateRunner MakeGateRunner(const GatePlan& plan, batch::RunOptions options,
                          batch::ResultStore* store) {
  options.plugins = plan.plugins;
  const auto runner = std::make_shared<batch::TrialRunner>(options, store);
  const auto spec = [&plan](int64_t trial) -> batch::TrialSpec {
    const int64_t conditions = std::ssize(plan.conditions);
    const int64_t condition = trial % conditions, sample = trial / conditions;
    return {.trial = trial,
            .cell = condition,
            .sample = sample,
            .seed = plan.SeedOf(static_cast<int>(sample)),
            .parameters = {{kConditionKey, plan.conditions[static_cast<size_t>(condition)].name}}};
  };
  const auto scenario = [&plan](const batch::TrialSpec& of) {
    return plan.conditions[static_cast<size_t>(of.cell)].Load(plan.assignments, of.seed);
  };
  return [=](GateTrials* trials) {
    const auto add = [=](const batch::StoredTrial& trial) {
      trials->Add(trial.trial, GateTrialOf(trial));
    };
    const bool ended = runner->Run({.spec = spec, .scenario = scenario},
                                   {.next = [=] { return trials->Next(); }, .add = add});
    if (!ended) throw batch::Stopped();
  };
}

batch::ResultStore OpenTrials(const std::string& file, const GatePlan& plan,
                              const std::function<void(const std::string&)>& say) {
  const batch::StoreHeader header{.kind = "gate",
                                  .plan = ResolvedTrials(plan),
                                  .build = system::BuildId(),
                                  .shard = {},
                                  .trials = 0,
                                  .keys = {kConditionKey}};
  try {
    return batch::ResultStore::Write(file, header);
  } catch (const batch::OtherResults& other) {
    say(fmt::format("{}: has trials of another gate or build ({}): begun anew", file,
                    other.difference));
    std::filesystem::remove(file);
    return batch::ResultStore::Write(file, header);
  }
}

GateReport RunGate(const GatePlan& plan, const Baseline& baseline, const GateRunner& run,
                   const GateProgress& on_trial) {
  RequireSamePlan(plan, baseline, plan.baseline);
  std::vector<ConditionJudge> judges;
  judges.reserve(plan.conditions.size());
  for (const GateCondition& condition : plan.conditions)
    judges.emplace_back(condition.name, plan.OptionsFor(condition),
                        baseline.Find(condition.name)->outcomes);
  GateTrials trials(
      plan, [&](size_t i) { return judges[i].wanted(); },
      [&](size_t i, const GateTrial& trial) { judges[i].Add(trial); }, on_trial);
  run(&trials);

  GateReport report{.verdict = statistics::Verdict::kPass,
                    .description = plan.description,
                    .build = system::BuildId(),
                    .baseline_build = baseline.build,
                    .alpha = plan.alpha,
                    .alpha_covers = plan.alpha_covers,
                    .assignments = plan.assignments,
                    .conditions = {}};
  for (const ConditionJudge& judge : judges) {
    report.conditions.push_back(judge.Report());
    report.verdict = std::min(report.verdict, report.conditions.back().verdict);
  }
  return report;
}

Baseline MeasureBaseline(const GatePlan& plan, const GateRunner& run,
                         const GateProgress& on_trial) {
  system::RequireReplaceable(plan.baseline, kBaselineFile);
  std::vector<std::vector<GateTrial>> outcomes(plan.conditions.size());
  GateTrials trials(
      plan, [&](size_t i) { return plan.conditions[i].max_trials; },
      [&](size_t i, const GateTrial& trial) { outcomes[i].push_back(trial); }, on_trial);
  run(&trials);
  Baseline baseline{.schema_version = kBaselineSchema,
                    .build = system::BuildId(),
                    .seed = plan.seed,
                    .conditions = {},
                    .checksum = {}};
  for (size_t i = 0; i < plan.conditions.size(); ++i)
    baseline.conditions.push_back(MakeBaselineCondition(plan.conditions[i], outcomes[i]));
  return baseline;
}

}  // namespace turbidock::gate
