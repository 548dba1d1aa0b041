#pragma once
// Trials in worker processes, here or on a cluster: scenarios in, one record a trial out.
//
//   TrialPool pool({.workers = 2}, /*time_limit_s=*/600);
//   pool.Submit({.id = 0, .scenario = scenario});
//   while (pool.pending() > 0)
//     if (auto trial = pool.Next(/*timeout_s=*/1)) Count(trial->record.outcome);

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "experiments/farm/farm.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/series.h"
#include "experiments/trial/trial_record.h"

namespace turbidock::farm {

struct TrialJob {
  int64_t id = 0;  // the caller's, returned with what came of it
  trial::Scenario scenario;
  int series_every_frames = 0;  // > 0: also a row of the trial's log every so many frames
};

struct FinishedTrial {
  int64_t id = 0;
  trial::TrialRecord record;
  trial::Series series = {};  // if asked for
};

// Runs a trial: the work of a TrialPool's jobs. `plugins`: what the scenarios' laws and estimators
// may be besides ours.
Work TrialWork(const trial::Plugins& plugins = {});

class TrialPool {
 public:
  TrialPool(const FarmOptions& farm, double time_limit_s, const trial::Plugins& plugins = {});

  void Submit(const TrialJob& job);
  // As JobPool's. A crash or a hang is a record; ConfigError when a scenario cannot run (names
  // the trial), SimulatorFault when this machine cannot draw.
  std::optional<FinishedTrial> Next(double timeout_s);

  size_t pending() const { return pool_->pending(); }
  size_t max_in_flight() const { return pool_->max_in_flight(); }

 private:
  std::unique_ptr<JobPool> pool_;
  std::multimap<int64_t, int64_t> seeds_;  // (trial, seed) of what is pending
};

}  // namespace turbidock::farm
