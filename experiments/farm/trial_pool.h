#pragma once
// Trials in worker processes: scenarios in, one flat record a trial out.
//
//   TrialPool pool(2, {.time_limit_s = 600});
//   pool.Submit({.id = 0, .scenario = scenario});
//   while (pool.pending() > 0)
//     if (auto record = pool.Next(/*timeout_s=*/1)) Count(record->outcome);

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "experiments/farm/worker_pool.h"
#include "experiments/trial/failure.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"

namespace turbidock::farm {

struct TrialJob {
  int64_t id = 0;  // the caller's, returned as TrialRecord::trial
  trial::Scenario scenario;
  int series_every_frames = 0;  // > 0: the record has a row of the trial's log every so many frames
};

// A number that a trial yields; nothing when what it measures did not happen.
using Metric = std::pair<std::string, std::optional<double>>;

// What is kept of a trial. All but the last group is determined by scenario, seed and build.
struct TrialRecord {
  int64_t trial = 0;
  int64_t seed = 0;
  std::string outcome;  // an Outcome's name, or "crashed", "hung"
  std::string failure;  // a Failure's name
  std::string reason;   // a sentence for people
  bool docked = false, inserted = false;
  double time_s = 0;
  std::string digest;  // empty for a trial without an end of its own
  std::vector<Metric> metrics;
  std::string series_csv;  // as TrajectoryCsv, if asked for

  // What the run itself was like.
  std::string log;  // of a crashed or hung trial: the last of what it printed
  double wall_time_s = 0, cpu_time_s = 0;
  int64_t rss_bytes = 0;  // of the worker, after the trial

  bool success() const { return failure == "none"; }
  bool operator==(const TrialRecord&) const = default;
};

// Every metric of a trial, always the same names in the same order. Lengths, times and angles are
// SI and carry their unit.
std::vector<Metric> MetricsOf(const trial::Scenario& scenario, const trial::TrialResult& result);

// The record of a trial that ran in this process.
TrialRecord RecordOf(const TrialJob& job, const trial::TrialResult& result);

class TrialPool {
 public:
  TrialPool(int workers, const WorkerOptions& options);

  void Submit(const TrialJob& job);
  // As WorkerPool's. A crash or a hang is a record; ConfigError when a scenario cannot run (names
  // the trial), SimulatorFault when this machine cannot draw.
  std::optional<TrialRecord> Next(double timeout_s);

  size_t pending() const { return pool_.pending(); }
  int workers() const { return pool_.workers(); }

 private:
  WorkerPool pool_;
  std::vector<std::pair<int64_t, int64_t>> seeds_;  // (trial, seed) of what is pending
};

}  // namespace turbidock::farm
