#pragma once
// Runs a gate: trials of every condition until its verdict is known, and says it for people and CI.
//
//   GateRun run(gate, LoadBaseline(gate.settings.baseline));
//   run.Run(options, store);            // or feed a TrialDecider's trials by hand
//   PrintReport(ReportOf(run.Report()));

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/batch.h"
#include "experiments/batch/comparison.h"
#include "experiments/batch/failure_effects.h"
#include "experiments/batch/result_store.h"
#include "experiments/batch/runner.h"
#include "experiments/report/report.h"
#include "experiments/statistics/intervals.h"
#include "experiments/studies/gate/baseline.h"
#include "experiments/studies/gate/envelope_gate.h"
#include "experiments/studies/gate/gate_plan.h"
#include "sim/base/result_fields.h"

namespace turbidock::gate {

struct ConditionReport {
  std::string condition;  // its name
  statistics::Verdict verdict = statistics::Verdict::kInconclusive;
  int64_t trials = 0, successes = 0;
  statistics::Interval interval_95{};  // of the success rate, Wilson, 95 %
  int baseline_trials = 0, baseline_successes = 0;
  statistics::Interval baseline_interval_95{};
  // Of the success rate: the least loss that fails with a probability of 0.8 in a build that does
  // as the old one but for what it loses. Exact.
  std::optional<double> smallest_loss_noticed{};
  std::vector<batch::Change> changes{};  // the success rate first; judged ones only
  std::vector<batch::Flip> flips{};
  std::vector<batch::FailureEffect> effects{};   // of what varies within the condition
  std::vector<int64_t> never_seeds{};            // of trials that ended as none may
  std::vector<batch::ComparedTrial> outcomes{};  // that the verdict rests on, in their order
  report::Json envelope{};                       // of a plan with ranges (envelope_gate.h)
  std::optional<report::Section> boundaries{};   // likewise, for people

  TURBIDOCK_FIELDS(condition, verdict, trials, successes, interval_95, baseline_trials,
                   baseline_successes, baseline_interval_95, smallest_loss_noticed, changes, flips,
                   effects, never_seeds, outcomes, envelope)
};

struct GateReport {
  statistics::Verdict verdict = statistics::Verdict::kPass;  // the worst of the conditions'
  std::string description;
  std::string build, baseline_build;
  double alpha = 0, beta = 0;  // the most that its conditions, which may have their own, add up to
  AlphaCovers alpha_covers = AlphaCovers::kGate;
  // By --set: not the build as it is. Of a build beside it, what it had otherwise.
  std::vector<std::string> assignments;
  std::vector<ConditionReport> conditions = {};

  TURBIDOCK_FIELDS(verdict, description, build, baseline_build, alpha, beta, alpha_covers,
                   assignments, conditions)
};

// How far a gate is, in trials: `least` if nothing more changes, `most` if it never knows.
struct GateProgress {
  int64_t done = 0, least = 0, most = 0;
};

// Which trials a gate runs, and what they say. It hands out the conditions' samples in turn and
// takes results in that order whatever order they come in, so that nothing depends on who was
// quicker; what was run beyond the last trial needed is dropped. Of a plan with ranges a condition
// has the trials that its baseline's search for the boundary chose.
class GateRun {
 public:
  // Judges against a baseline; ConfigError for one of another plan or that cannot get worse by the
  // margin. Without one all trials are run, and may become a baseline. `gate` must outlive it.
  explicit GateRun(const Gate& gate, const std::optional<Baseline>& baseline = std::nullopt);

  // Runs trials in workers; `store` keeps them, or is null. batch::Stopped when it was asked to
  // stop, SimulatorFault for a trial that crashed or hung: that is no verdict on docking.
  void Run(batch::RunOptions options, batch::ResultStore* store,
           const std::function<void(const GateProgress&)>& on_trial = {});

  std::optional<int64_t> Next();              // a trial of the plan to run; each once
  void Add(const batch::StoredTrial& trial);  // what came of one
  GateProgress progress() const;
  // What there is to say before the first trial: conditions that cannot pass with their trials.
  std::vector<std::string> Remarks() const;

  GateReport Report() const;
  Baseline Measured() const;
  // A condition's trials that count, in their order.
  const std::vector<batch::StoredTrial>& TrialsOf(size_t condition) const {
    return running_[condition].trials;
  }

 private:
  struct Running {
    std::optional<BaselineCondition> baseline;
    std::optional<EnvelopeShift> shift;  // of a plan with ranges
    batch::JudgeOptions options;
    batch::PairedTrials pairs;
    std::vector<batch::StoredTrial> trials;  // that count
    std::vector<int64_t> never_seeds;
    int64_t least = 0;  // trials that it takes if nothing changes
  };

  // A condition's trial by its place in the order, and that place.
  int64_t NumberOf(size_t condition, int64_t place) const;
  int64_t PlaceOf(size_t condition, const batch::StoredTrial& trial) const;

  bool IsDone(const Running& condition) const;
  void Take(size_t condition, const batch::StoredTrial& trial);
  ConditionReport ReportOf(size_t condition) const;

  const Gate& gate_;
  int64_t places_;                               // cells of a condition
  std::optional<batch::TrialScheduler> search_;  // for the boundary, where that is to be found
  std::string baseline_build_;
  std::vector<Running> running_;                 // by condition
  std::vector<std::string> bundles_;             // likewise: BundleNames
  int64_t asked_ = 0, taken_ = 0, most_ = 0;     // in turns: place * conditions + condition
  std::map<int64_t, batch::StoredTrial> early_;  // by turn: results that others come before
  bool failed_at_once_ = false;
};

// The file of a gate's trials, to be gone on with (batch::OpenResults). Trials of another program
// are what a gate is there to tell from this one's: it is begun anew then, which `say` tells. With
// `anew` trials that the gate has no more go, too; a file of another kind is refused.
batch::ResultStore OpenTrials(const std::string& file, const Gate& gate, bool anew,
                              const batch::JobOptions& jobs,
                              const std::function<void(const std::string&)>& say);

// The trials of another build in such a file, judged as if they had been run now. ConfigError where
// they are not the gate's.
GateReport ReportOfFile(const std::string& file, const Gate& gate, const Baseline& baseline);

// Of kind "gate"; `beside` are other builds' reports on the same baseline, by name. Seeds that
// changed are links by their bundles' names.
report::Report ReportOf(const GateReport& report,
                        const std::vector<std::pair<std::string, GateReport>>& beside = {});

// junit.xml: a test suite a condition, with one test case. A condition that fails is a failure, one
// that is inconclusive an error.
std::string Junit(const GateReport& report);

// What folders in failures/ are called by for each of these conditions, before the seed: all
// different, also where a file's name knows no capitals.
std::vector<std::string> BundleNames(const std::vector<std::string>& conditions);

}  // namespace turbidock::gate
