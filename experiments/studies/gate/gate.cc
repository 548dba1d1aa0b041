#include "experiments/studies/gate/gate.h"

#include <algorithm>
#include <utility>

namespace turbidock::gate {
GateTrials::GateTrials(const GatePlan& plan, int most_under_way,
                       std::function<int(size_t condition)> wanted,
                       std::function<void(size_t condition, const GateTrial&)> take)
    : most_under_way_(most_under_way),
      wanted_(std::move(wanted)),
      take_(std::move(take)),
      conditions_(plan.conditions.size()) {}

std::optional<int64_t> GateTrials::Next() {
  if (under_way_ >= most_under_way_) return std::nullopt;
  std::optional<size_t> first;  // of those that go on, who has begun the fewest
  for (size_t i = 0; i < conditions_.size(); ++i)
    if (conditions_[i].next < wanted_(i) &&
        (!first || conditions_[i].next < conditions_[*first].next))
      first = i;
  if (!first) return std::nullopt;
  ++under_way_;
  return conditions_[*first].next++ * std::ssize(conditions_) + static_cast<int64_t>(*first);
}

void GateTrials::Add(int64_t trial, const GateTrial& result) {
  --under_way_;
  const auto at = static_cast<size_t>(trial % std::ssize(conditions_));
  Condition& condition = conditions_[at];
  condition.early.emplace(trial / std::ssize(conditions_), result);
  while (const auto next = condition.early.extract(condition.taken)) {
    ++condition.taken;
    take_(at, next.mapped());
  }
}

GateReport RunGate(const GatePlan& plan, const Baseline& baseline, const std::string& baseline_file,
                   const GateRunner& run, const GateOptions& options) {
  RequireSamePlan(plan, baseline, baseline_file);
  const bool paired = plan.seed == baseline.seed;
  std::vector<ConditionJudge> judges;
  judges.reserve(plan.conditions.size());
  for (const GateCondition& condition : plan.conditions)
    judges.emplace_back(condition.name, plan.OptionsFor(condition, paired),
                        baseline.Find(condition.name)->outcomes);

  GateTrials trials(
      plan, options.at_once,
      [&](size_t i) { return judges[i].done() ? judges[i].trials() : judges[i].max_trials(); },
      [&](size_t i, const GateTrial& trial) {
        judges[i].Add(trial);
        if (options.on_trial) options.on_trial(judges);
      });
  run(&trials);

  GateReport report{.verdict = statistics::Verdict::kPass,
                    .description = plan.description,
                    .build = {},
                    .baseline_build = baseline.build,
                    .assignments = {},
                    .conditions = {},
                    .paired = paired};
  for (const ConditionJudge& judge : judges) {
    report.conditions.push_back(judge.Report());
    report.conditions.back().path = judge.Path();
    report.verdict = std::min(report.verdict, report.conditions.back().verdict);
  }
  return report;
}

Baseline MeasureBaseline(const GatePlan& plan, const GateRunner& run, int at_once,
                         const std::function<void(int done, int all)>& on_trial) {
  system::RequireReplaceable(plan.baseline, kBaselineFile);
  int done = 0, all = 0;
  for (const GateCondition& condition : plan.conditions) all += condition.max_trials;
  std::vector<std::vector<GateTrial>> outcomes(plan.conditions.size());
  GateTrials trials(
      plan, at_once, [&](size_t i) { return plan.conditions[i].max_trials; },
      [&](size_t i, const GateTrial& trial) {
        outcomes[i].push_back(trial);
        if (on_trial) on_trial(++done, all);
      });
  run(&trials);

  Baseline baseline{.schema_version = kBaselineSchema,
                    .build = {},
                    .seed = plan.seed,
                    .conditions = {},
                    .checksum = {}};
  for (size_t i = 0; i < plan.conditions.size(); ++i)
    baseline.conditions.push_back(MakeBaselineCondition(plan.conditions[i], outcomes[i]));
  return baseline;
}

}  // namespace turbidock::gate
