#pragma once
// Runs a gate: trials of every condition until its verdict is known.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "experiments/studies/gate/baseline.h"
#include "experiments/studies/gate/gate_plan.h"
#include "experiments/studies/gate/judge.h"

namespace turbidock::gate {

// A trial to run: of which condition (an index), with which seed.
struct GateRequest {
  size_t condition = 0;
  int64_t seed = 0;
};

// Runs trials, in whatever order, and returns their results in the order of the requests. It throws
// when a trial gives no result: a crash is no verdict.
using GateRunner = std::function<std::vector<GateTrial>(const std::vector<GateRequest>&)>;

struct GateReport {
  statistics::Verdict verdict = statistics::Verdict::kInconclusive;
  std::string description;
  std::string build, baseline_build;     // `build` is the caller's to fill in
  std::vector<std::string> assignments;  // likewise: --set, not the build as it is
  std::vector<ConditionReport> conditions;
  bool paired = true;

  TURBIDOCK_FIELDS(verdict, description, build, baseline_build, assignments, conditions)
};

struct GateOptions {
  int at_once = 2;  // trials asked for in a round, when there are as many; never decides a verdict
  // Called after every round.
  std::function<void(const std::vector<ConditionJudge>&)> on_round;
};

// The verdict depends on the trials' results only: what was run beyond the last trial needed is
// dropped. ConfigError for a baseline of another plan.
GateReport RunGate(const GatePlan& plan, const Baseline& baseline, const std::string& baseline_file,
                   const GateRunner& run, const GateOptions& options);

// Runs max_trials trials of every condition. `build` is the caller's to fill in. ConfigError before
// any of them where the plan's baseline must not be replaced.
Baseline MeasureBaseline(const GatePlan& plan, const GateRunner& run, int at_once,
                         const std::function<void(int done, int all)>& on_round);

}  // namespace turbidock::gate
