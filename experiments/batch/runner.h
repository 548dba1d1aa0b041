#pragma once
// The one engine that runs trials: of a batch, of a gate, of a tuning run.
//
//   TrialRunner runner({.jobs = {.workers = 2}}, &store);
//   const bool ended = runner.Run(SourceOf(plan), {.next = ..., .add = ...});
//
// Who has trials run says three things: what a number stands for (TrialSource), where results go (a
// ResultStore, or none), and which trial runs next (TrialDecider). A trial that the store has is
// handed to the decider without being run: whatever stops a run, also kill -9 or the power, it goes
// on where it was. It ends the same, for any number of workers and after any interruption, as long
// as the decider looks at results in an order of its own, never in that in which they come.

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>

#include "experiments/batch/job_pool.h"
#include "experiments/batch/plan.h"
#include "experiments/batch/result_store.h"
#include "experiments/system/build_info.h"
#include "experiments/trial/scenario.h"
#include "sim/view/gl_context.h"

namespace turbidock::batch {

// What the trials of a run are.
struct TrialSource {
  std::function<TrialSpec(int64_t trial)> spec;  // what the store keeps of it
  // Resolved, with its `model_files`: nothing that decides it is read again.
  std::function<trial::Scenario(const TrialSpec&)> scenario;
  int series_every_frames = 0;  // > 0: also a row of a trial's log every so many frames
};
TrialSource SourceOf(const Plan& plan);  // which must outlive it

// Which trials run, and when it is enough.
struct TrialDecider {
  // A trial to run; each once. Nothing when it is enough, or when results must come first.
  std::function<std::optional<int64_t>()> next;
  // What came of one of these. If it throws, the trial is not stored, and runs again next time.
  std::function<void(const StoredTrial&)> add = {};
};

// Of this process: trials that the store had are not in it.
struct RunProgress {
  int64_t done_now = 0;    // trials
  double wall_time_s = 0;  // since the runner was made
};

struct RunOptions {
  JobOptions jobs = {};
  double time_limit_s = 3600;                             // of a trial
  trial::Plugins plugins = {};                            // what scenarios may choose besides ours
  std::function<void(const StoredTrial&)> on_trial = {};  // once it has run and is stored
  std::function<void(const RunProgress&)> on_progress = {};  // after every trial and every second
  std::function<bool()> stop_requested = {};                 // polled at least every second
};

// Runs a trial: what a pool of them does with its jobs. `plugins`: what the scenarios' controllers
// and estimators may be besides ours.
Work TrialWork(const trial::Plugins& plugins = {});

// The job of this number. `series_every_frames` > 0: also a row of its log every so many frames.
Job TrialJob(int64_t id, const trial::Scenario& scenario, int series_every_frames = 0);

// What came of a trial's job. A crash or a hang is a record; ConfigError when its scenario cannot
// run (names the trial), SimulatorFault when this machine cannot draw.
StoredTrial FinishedTrialOf(const JobResult& result, TrialSpec spec);

// Thrown by a study whose run was stopped. What was stored stays.
struct Stopped : std::runtime_error {
  Stopped() : std::runtime_error("stopped") {}
};

// MapEach (job_pool.h) of which a store keeps every output: what it has is given without being done
// again. `first`: the first input's number in it. `store`: null for none.
bool MapEachKept(JobPool* pool, ResultStore* store, int64_t first,
                 const std::vector<std::string>& inputs,
                 const std::function<void(size_t, const std::string& output)>& take,
                 const std::function<bool()>& stop_requested);

class TrialRunner {
 public:
  // `store`: null for none.
  TrialRunner(const RunOptions& options, ResultStore* store);

  // Runs until the decider has no trial and none is under way; false when it was stopped: the
  // trials under way are then lost, and the runner is good for nothing more. Errors as of
  // FinishedTrialOf, ResultStore::Add and the decider; MismatchError when a stored trial is not
  // what the source says.
  bool Run(const TrialSource& source, const TrialDecider& decider);

  // MismatchError when this trial was drawn by another renderer than others for which the same was
  // asked for.
  void RequireSameRenderer(int64_t trial, view::GlBackend asked, const std::string& drawn);

  const RunProgress& progress() const { return progress_; }

 private:
  std::optional<StoredTrial> Find(const TrialSpec& spec, const trial::Scenario& scenario) const;

  RunOptions options_;
  ResultStore* store_;
  std::unique_ptr<JobPool> pool_;
  std::string program_ = system::BuildId();
  std::map<view::GlBackend, std::string> renderers_;  // what drew, by what was asked for
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  RunProgress progress_;
};

}  // namespace turbidock::batch
