#pragma once
// Runs a gate: trials of every condition until its verdict is known, and says it for people and CI.
// They run in worker processes, and are kept in a file so that a gate that was stopped goes on.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/runner.h"
#include "experiments/report/report.h"
#include "experiments/studies/gate/baseline.h"
#include "experiments/studies/gate/gate_plan.h"
#include "experiments/studies/gate/judge.h"

namespace turbidock::gate {

// Called after every trial: how many there were, and how many there will be as far as is known.
using GateProgress = std::function<void(int64_t done, int64_t wanted)>;

// Which trials a gate runs. Trial `sample * conditions + condition` is the sample-th of its
// condition. Results may come in any order: each condition's are looked at in that of its seeds, so
// that nothing depends on who was quicker.
struct GateTrials {
  std::function<std::optional<int64_t>()> next;  // one to run; each once. Nothing: no more
  std::function<void(int64_t trial, const GateTrial&)> add;  // what came of one of these
};

// Runs trials until there is none to ask for. It throws when one gives no result: a crash is no
// verdict.
using GateRunner = std::function<void(const GateTrials& trials)>;

// Runs them in worker processes. It throws Stopped when the options' stop_requested says so, and
// SimulatorFault when a trial crashes or hangs or this machine cannot simulate: that is no verdict
// on docking. `store`, where trials are kept, may be null; it and `plan` must outlive the runner.
GateRunner MakeGateRunner(const GatePlan& plan, batch::RunOptions options,
                          batch::ResultStore* store = nullptr);

// The file of a gate's trials, to be gone on with. It is begun anew, which `say` tells, when its
// trials are of another program, or with `anew`. OtherResults when a scenario or a file of it has
// changed, ConfigError when something else is in the way.
batch::ResultStore OpenTrials(const std::string& file, const GatePlan& plan, bool anew,
                              const std::function<void(const std::string&)>& say);

struct GateReport {
  statistics::Verdict verdict = statistics::Verdict::kPass;  // the worst of the conditions'
  std::string description;
  std::string build, baseline_build;
  double alpha = 0, beta = 0;
  AlphaCovers alpha_covers = AlphaCovers::kGate;
  std::vector<std::string> assignments;  // by --set: not the build as it is
  std::vector<ConditionReport> conditions = {};

  TURBIDOCK_FIELDS(verdict, description, build, baseline_build, alpha, beta, alpha_covers,
                   assignments, conditions)
};

// The verdict depends on the trials' results only: what was run beyond the last trial needed is
// dropped. ConfigError for a baseline of another plan.
GateReport RunGate(const GatePlan& plan, const Baseline& baseline, const GateRunner& run,
                   const GateProgress& on_trial = {});

// Runs max_trials trials of every condition. ConfigError before any of them where the plan's
// baseline must not be replaced.
Baseline MeasureBaseline(const GatePlan& plan, const GateRunner& run,
                         const GateProgress& on_trial = {});

// Of kind "gate". Seeds that no longer dock are links to BundleName.
report::Report ReportOf(const GateReport& report);

// junit.xml: a test suite a condition, with one test case. A condition that fails is a failure, one
// that is inconclusive an error.
std::string Junit(const GateReport& report);

// The folder in failures/ of a trial that is run again.
std::string BundleName(const std::string& condition, int64_t seed);

}  // namespace turbidock::gate
