#include "experiments/studies/gate/gate.h"

#include <algorithm>

namespace turbidock::gate {
namespace {

// The trials of the next round: from each condition in turn, so that all of them go on.
std::vector<GateRequest> NextRound(const GatePlan& plan, const std::vector<ConditionJudge>& judges,
                                   int at_once) {
  std::vector<GateRequest> round;
  for (int ahead = 0; std::ssize(round) < at_once; ++ahead) {
    const size_t before = round.size();
    for (size_t i = 0; i < judges.size() && std::ssize(round) < at_once; ++i) {
      const int trial = judges[i].trials() + ahead;
      if (!judges[i].done() && trial < judges[i].max_trials())
        round.push_back({.condition = i, .seed = plan.SeedOf(trial)});
    }
    if (round.size() == before) break;
  }
  return round;
}

}  // namespace

GateReport RunGate(const GatePlan& plan, const Baseline& baseline, const std::string& baseline_file,
                   const GateRunner& run, const GateOptions& options) {
  RequireSamePlan(plan, baseline, baseline_file);
  const bool paired = plan.seed == baseline.seed;
  std::vector<ConditionJudge> judges;
  judges.reserve(plan.conditions.size());
  for (const GateCondition& condition : plan.conditions)
    judges.emplace_back(condition.name, plan.OptionsFor(condition, paired),
                        baseline.Find(condition.name)->outcomes);

  while (true) {
    const std::vector<GateRequest> round = NextRound(plan, judges, options.at_once);
    if (round.empty()) break;
    const std::vector<GateTrial> trials = run(round);
    for (size_t i = 0; i < round.size(); ++i) judges[round[i].condition].Add(trials[i]);
    if (options.on_round) options.on_round(judges);
  }

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
                         const std::function<void(int done, int all)>& on_round) {
  system::RequireReplaceable(plan.baseline, kBaselineFile);
  std::vector<GateRequest> all;
  for (size_t i = 0; i < plan.conditions.size(); ++i)
    for (int trial = 0; trial < plan.conditions[i].max_trials; ++trial)
      all.push_back({.condition = i, .seed = plan.SeedOf(trial)});

  std::vector<std::vector<GateTrial>> outcomes(plan.conditions.size());
  for (size_t begin = 0; begin < all.size();) {
    const size_t end = std::min(all.size(), begin + static_cast<size_t>(at_once));
    const std::vector<GateRequest> round(all.begin() + static_cast<int64_t>(begin),
                                         all.begin() + static_cast<int64_t>(end));
    const std::vector<GateTrial> trials = run(round);
    for (size_t i = 0; i < round.size(); ++i) outcomes[round[i].condition].push_back(trials[i]);
    begin = end;
    if (on_round) on_round(static_cast<int>(begin), static_cast<int>(all.size()));
  }

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
