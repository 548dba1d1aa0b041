#pragma once
// Runs a gate: trials of every condition until its verdict is known. They run in worker processes,
// and are kept in a file so that a gate that was stopped goes on.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/runner.h"
#include "experiments/studies/gate/baseline.h"
#include "experiments/studies/gate/gate_plan.h"
#include "experiments/studies/gate/judge.h"

namespace turbidock::gate {

// Called after every trial: how many there were, and how many there will be as far as is known.
using GateProgress = std::function<void(int done, int wanted)>;

// Which trials a gate runs: of the conditions in turn, the seeds of each in their order. Trial
// `sample * conditions + condition` is the sample-th of its condition. Results may come in any
// order; each condition's are handed on in that of its seeds, so that nothing depends on who was
// quicker.
class GateTrials {
 public:
  // `wanted`: of how many trials a condition consists as far as is known; `take` gets them, one
  // after another, and maybe more that were under way.
  GateTrials(const GatePlan& plan, std::function<int(size_t condition)> wanted,
             std::function<void(size_t condition, const GateTrial&)> take, GateProgress on_trial);

  // A trial to run; each once. Nothing when there is none.
  std::optional<int64_t> Next();
  // What came of one of these.
  void Add(int64_t trial, const GateTrial& result);

 private:
  struct Condition {
    int next = 0, taken = 0;              // samples
    std::map<int, GateTrial> early = {};  // results of samples that others come before
  };

  std::function<int(size_t)> wanted_;
  std::function<void(size_t, const GateTrial&)> take_;
  GateProgress on_trial_;
  std::vector<Condition> conditions_;
};

// Has trials run until `trials` asks for none. It throws when one gives no result: a crash is no
// verdict.
using GateRunner = std::function<void(GateTrials* trials)>;

// Runs them in worker processes. It throws Stopped when the options' stop_requested says so, and
// SimulatorFault when a trial crashes or hangs or this machine cannot simulate: that is no verdict
// on docking. `store`, where trials are kept, may be null; it and `plan` must outlive the runner.
GateRunner MakeGateRunner(const GatePlan& plan, batch::RunOptions options,
                          batch::ResultStore* store = nullptr);

// The file of a gate's trials, to be gone on with when they are of the same program, conditions,
// assignments and data. Trials of anything else say nothing about this build: the file is then
// begun anew, which `say` tells. ConfigError when something else is in the way.
batch::ResultStore OpenTrials(const std::string& file, const GatePlan& plan,
                              const std::function<void(const std::string&)>& say);

struct GateReport {
  statistics::Verdict verdict = statistics::Verdict::kInconclusive;
  std::string description;
  std::string build, baseline_build;
  double alpha = 0;
  AlphaCovers alpha_covers = AlphaCovers::kGate;
  std::vector<std::string> assignments;  // by --set: not the build as it is
  std::vector<ConditionReport> conditions;

  TURBIDOCK_FIELDS(verdict, description, build, baseline_build, alpha, alpha_covers, assignments,
                   conditions)
};

// The verdict depends on the trials' results only: what was run beyond the last trial needed is
// dropped. ConfigError for a baseline of another plan.
GateReport RunGate(const GatePlan& plan, const Baseline& baseline, const GateRunner& run,
                   const GateProgress& on_trial = {});

// Runs max_trials trials of every condition. ConfigError before any of them where the plan's
// baseline must not be replaced.
Baseline MeasureBaseline(const GatePlan& plan, const GateRunner& run,
                         const GateProgress& on_trial = {});

}  // namespace turbidock::gate
