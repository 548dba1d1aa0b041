#pragma once
// Runs the trials of a plan that a file does not hold yet.

#include <cstdint>
#include <functional>

#include "experiments/batch/job_options.h"
#include "experiments/batch/plan.h"
#include "experiments/batch/result_store.h"
#include "experiments/batch/runner.h"

namespace turbidock::batch {

struct BatchProgress : RunProgress {
  int64_t done = 0, total = 0;  // of the shard; `done` has those of earlier runs
  int64_t most = 0;             // with a precision `total` is a guess, and this what it can become
  int64_t successes = 0;        // of `done`
};

// Runs until all trials of the store's shard are in it (see trial_scheduler.h), or it is stopped.
// Of `options`, time limit and plugins are the plan's; `on_progress` takes the place of its own.
// Errors as of TrialRunner::Run; what was stored stays.
BatchProgress RunBatch(const Plan& plan, RunOptions options,
                       const std::function<void(const BatchProgress&)>& on_progress,
                       ResultStore* store);

}  // namespace turbidock::batch
