#pragma once
// A trial as a job of a pool: a scenario in, a record out.

#include <cstdint>
#include <string>

#include "experiments/batch/job_pool.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/series.h"
#include "experiments/trial/trial_record.h"

namespace turbidock::batch {

// Runs a trial: what a pool of them does with its jobs. `plugins`: what the scenarios' controllers
// and estimators may be besides ours.
Work TrialWork(const trial::Plugins& plugins = {});

// The job of this number. `series_every_frames` > 0: also a row of its log every so many frames.
Job TrialJob(int64_t id, const trial::Scenario& scenario, int series_every_frames = 0);

struct FinishedTrial {
  trial::TrialRecord record;
  trial::Series series = {};  // if asked for
};
// What came of the job of a trial with this seed. A crash or a hang is a record; ConfigError when
// its scenario cannot run (names the trial), SimulatorFault when this machine cannot draw.
FinishedTrial FinishedTrialOf(const JobResult& result, int64_t seed);

}  // namespace turbidock::batch
