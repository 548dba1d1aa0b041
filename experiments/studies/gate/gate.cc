#include "experiments/studies/gate/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>

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
  GateTrial trial{.seed = record.seed, .outcome = record.outcome, .digest = record.digest};
  for (size_t i = 0; i < kMedianMeasures.size(); ++i)
    trial.values[i] = kMedianMeasures[i].of(record);
  return trial;
}

// Everything that decides the gate's trials. Margins and the like do not, nor does the baseline.
std::string ResolvedTrials(const GatePlan& plan) {
  std::string text = fmt::format("seed: {}\nconditions:\n", plan.seed);
  std::map<std::string, trial::ModelFile> files;
  for (const GateCondition& condition : plan.conditions) {
    text += fmt::format("  {}: |\n{}", batch::YamlText(condition.name),
                        system::Indented(trial::SaveScenario(condition.resolved), "    "));
    for (const trial::ModelFile& file : condition.resolved.model_files) files[file.file] = file;
  }
  return text + batch::ModelFilesText(files);
}

// Runs trials of the conditions in turn. `wanted`: of how many trials one consists as far as is
// known; `take` gets them, one after another, and maybe more that were under way.
void RunTrials(const GatePlan& plan, const GateRunner& run,
               const std::function<int(size_t condition)>& wanted,
               const std::function<void(size_t condition, const GateTrial&)>& take,
               const GateProgress& on_trial) {
  int64_t next_trial = 0;
  std::vector<int64_t> taken(plan.conditions.size());
  std::map<int64_t, GateTrial> early;  // results of trials that others come before
  const auto conditions = std::ssize(plan.conditions);
  const int most = std::ranges::max(plan.conditions, {}, &GateCondition::max_trials).max_trials;
  const auto next = [&]() -> std::optional<int64_t> {
    while (next_trial < most * conditions) {
      const int64_t trial = next_trial++;
      if (trial / conditions < wanted(static_cast<size_t>(trial % conditions))) return trial;
    }
    return std::nullopt;
  };
  const auto add = [&](int64_t trial, const GateTrial& result) {
    const int64_t at = trial % conditions;
    early.emplace(trial, result);
    int64_t& so_far = taken[static_cast<size_t>(at)];
    while (const auto found = early.extract(so_far * conditions + at)) {
      ++so_far;
      take(static_cast<size_t>(at), found.mapped());
    }
    int64_t done = 0, all = 0;
    for (size_t i = 0; i < taken.size(); ++i) {
      all += wanted(i);
      done += std::min<int64_t>(taken[i], wanted(i));
    }
    if (on_trial) on_trial(done, all);
  };
  run({.next = next, .add = add});
}

}  // namespace

GateRunner MakeGateRunner(const GatePlan& plan, batch::RunOptions options,
                          batch::ResultStore* store) {
  options.plugins = plan.conditions.front().resolved.plugins;
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
    return ScenarioOf(plan.conditions[static_cast<size_t>(of.cell)], of.seed);
  };
  return [=](const GateTrials& trials) {
    const auto add = [&trials](const batch::StoredTrial& trial) {
      trials.add(trial.trial, GateTrialOf(trial));
    };
    const bool ended =
        runner->Run({.spec = spec, .scenario = scenario}, {.next = trials.next, .add = add});
    if (!ended) throw batch::Stopped();
  };
}

batch::ResultStore OpenTrials(const std::string& file, const GatePlan& plan, bool anew,
                              const std::function<void(const std::string&)>& say) {
  const batch::StoreHeader header{.kind = "gate",
                                  .plan = ResolvedTrials(plan),
                                  .build = system::BuildId(),
                                  .code = plan.conditions.front().resolved.plugins.Code(),
                                  .shard = {},
                                  .trials = 0,
                                  .keys = {kConditionKey}};
  batch::ResultStore store = batch::ResultStore::Open(file, header);
  const std::vector<std::string> differences = batch::Differences(store.header(), header);
  if (differences.empty()) return store;
  // Trials of another program are what a gate is there to tell from this one's.
  const bool is_other_program =
      store.header().build != header.build || store.header().code != header.code;
  if (!anew && !is_other_program) throw batch::OtherResults(file, differences[0]);
  say(fmt::format("{}: has other trials ({}): begun anew", file, differences[0]));
  store.Become(header, {});
  return store;
}

GateReport RunGate(const GatePlan& plan, const Baseline& baseline, const GateRunner& run,
                   const GateProgress& on_trial) {
  RequireSamePlan(plan, baseline, plan.baseline);
  std::vector<ConditionJudge> judges;
  judges.reserve(plan.conditions.size());
  for (const GateCondition& condition : plan.conditions)
    judges.emplace_back(*baseline.Find(condition.name), plan.OptionsFor(condition));
  RunTrials(
      plan, run, [&](size_t i) { return judges[i].wanted(); },
      [&](size_t i, const GateTrial& trial) { judges[i].Add(trial); }, on_trial);
  GateReport report{.description = plan.description,
                    .build = system::BuildId(),
                    .baseline_build = baseline.build,
                    .alpha = plan.alpha,
                    .beta = plan.beta,
                    .alpha_covers = plan.alpha_covers,
                    .assignments = plan.assignments};
  for (const ConditionJudge& judge : judges) {
    report.conditions.push_back(judge.Report());
    report.verdict = std::min(report.verdict, report.conditions.back().verdict);
  }
  return report;
}

Baseline MeasureBaseline(const GatePlan& plan, const GateRunner& run,
                         const GateProgress& on_trial) {
  system::RequireReplaceable(plan.baseline, kBaselineFile);
  Baseline baseline;
  baseline.build = system::BuildId();
  baseline.seed = plan.seed;
  for (const GateCondition& condition : plan.conditions)
    baseline.conditions.push_back({.name = condition.name,
                                   .scenario = condition.scenario,
                                   .settings = condition.settings,
                                   .digest = condition.digest});
  RunTrials(
      plan, run, [&](size_t i) { return plan.conditions[i].max_trials; },
      [&](size_t i, const GateTrial& trial) { baseline.conditions[i].outcomes.push_back(trial); },
      on_trial);
  for (BaselineCondition& c : baseline.conditions) {
    c.trials = static_cast<int>(std::ssize(c.outcomes));
    c.docked = static_cast<int>(std::ranges::count_if(c.outcomes, &GateTrial::docked));
    c.success_rate = static_cast<double>(c.docked) / c.trials;
    c.interval_95 = statistics::WilsonInterval(c.docked, c.trials).AsList();
  }
  return baseline;
}

}  // namespace turbidock::gate
