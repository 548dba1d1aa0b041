#pragma once
// The one loop that hands jobs to workers and takes their results.

#include <utility>

namespace turbidock::farm {

inline constexpr double kPoll_s = 1;  // how late progress and a stop may be

// Runs until there is no job left to submit and none under way, or `go_on` says no; false then.
// Pool: a JobPool or a TrialPool. `submit_one()` submits the next job, if there is one to submit
// now, and returns whether it did; `take(result)` gets each result, in whatever order they come;
// `go_on()` is asked after each result and at least every second.
template <class Pool, class SubmitOne, class Take, class GoOn>
bool KeepBusy(Pool* pool, const SubmitOne& submit_one, const Take& take, const GoOn& go_on) {
  for (;;) {
    while (pool->pending() < pool->appetite() && submit_one()) {
    }
    if (pool->pending() == 0) return true;
    if (auto result = pool->Next(kPoll_s)) take(*std::move(result));
    if (!go_on()) return false;
  }
}

}  // namespace turbidock::farm
