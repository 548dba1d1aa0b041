#pragma once
// Runs a gate: trials of every condition until its verdict is known.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/studies/gate/baseline.h"
#include "experiments/studies/gate/gate_plan.h"
#include "experiments/studies/gate/judge.h"

namespace turbidock::gate {

// Which trials a gate runs: of the conditions in turn, the seeds of each in their order. Trial
// `sample * conditions + condition` is the sample-th of its condition. Results may come in any
// order; each condition's are handed on in that of its seeds, so that nothing depends on who was
// quicker.
class GateTrials {
 public:
  // `most_under_way`: trials to run at a time; it decides no verdict. `wanted`: of how many trials
  // a condition consists as far as is known; `take` gets them, one after another.
  GateTrials(const GatePlan& plan, int most_under_way, std::function<int(size_t condition)> wanted,
             std::function<void(size_t condition, const GateTrial&)> take);

  // A trial to run; each once. Nothing when there is none or when results must come first.
  std::optional<int64_t> Next();
  // What came of one of these.
  void Add(int64_t trial, const GateTrial& result);

 private:
  struct Condition {
    int64_t next = 0, taken = 0;              // samples
    std::map<int64_t, GateTrial> early = {};  // results of samples that others come before
  };

  int64_t most_under_way_, under_way_ = 0;
  std::function<int(size_t)> wanted_;
  std::function<void(size_t, const GateTrial&)> take_;
  std::vector<Condition> conditions_;
};

// Has trials run until `trials` asks for none. It throws when one gives no result: a crash is no
// verdict.
using GateRunner = std::function<void(GateTrials* trials)>;

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
  int at_once = 2;  // trials under way at most; never decides a verdict
  // Called after every trial that counts.
  std::function<void(const std::vector<ConditionJudge>&)> on_trial = nullptr;
};

// The verdict depends on the trials' results only: what was run beyond the last trial needed is
// dropped. ConfigError for a baseline of another plan.
GateReport RunGate(const GatePlan& plan, const Baseline& baseline, const std::string& baseline_file,
                   const GateRunner& run, const GateOptions& options);

// Runs max_trials trials of every condition. `build` is the caller's to fill in. ConfigError before
// any of them where the plan's baseline must not be replaced.
Baseline MeasureBaseline(const GatePlan& plan, const GateRunner& run, int at_once,
                         const std::function<void(int done, int all)>& on_trial);

}  // namespace turbidock::gate
