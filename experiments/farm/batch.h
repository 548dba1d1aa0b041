#pragma once
// Runs the trials of a plan that a file does not hold yet.

#include <cstdint>
#include <functional>
#include <vector>

#include "experiments/farm/farm.h"
#include "experiments/farm/plan.h"
#include "experiments/farm/result_store.h"
#include "experiments/farm/runner.h"

namespace turbidock::farm {

struct BatchProgress : RunProgress {
  int64_t done = 0, total = 0;  // of the shard; `done` has those of earlier runs
  int64_t most = 0;             // with a precision `total` is a guess, and this what it can become
  int64_t successes = 0;        // of `done`
};

struct BatchOptions {
  FarmOptions farm = {};
  std::function<void(const BatchProgress&)> on_progress;  // after every trial and every second
  std::function<void(const StoredTrial&)> on_trial;       // once it is stored
  std::function<bool()> stop_requested;                   // polled at least every second
};

// Runs until all trials of the store's shard are in it (see trial_scheduler.h), or stop_requested.
// Errors as of TrialRunner::Run; what was stored stays.
BatchProgress RunBatch(const Plan& plan, const BatchOptions& options, ResultStore* store);

// Runs these trials of the plan again, in any order, without storing them.
void RunTrials(const Plan& plan, const std::vector<int64_t>& trials, const BatchOptions& options);

}  // namespace turbidock::farm
