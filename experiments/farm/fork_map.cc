#include "experiments/farm/fork_map.h"

#include <algorithm>

#include "experiments/farm/keep_busy.h"
#include "experiments/farm/worker_pool.h"
#include "sim/base/check.h"

namespace turbidock::farm {
namespace {

constexpr double kTimeLimit_s = 24 * 3600;  // of a job

std::string OutputOf(JobResult result) {
  if (result.end == JobEnd::kDone) return std::move(result.output);
  if (result.end == JobEnd::kBadInput) throw ConfigError(result.error);
  throw SimulatorFault(result.error + (result.log.empty() ? "" : ": " + result.log));
}

}  // namespace

std::vector<std::string> ForkMap(int jobs, const std::function<std::string(int)>& work,
                                 const ForkMapOptions& options) {
  const auto stopped = [&] { return options.stop_requested && options.stop_requested(); };
  std::vector<std::string> results(static_cast<size_t>(jobs));
  int done = 0;
  const auto finished = [&](int job, std::string text) {
    results[static_cast<size_t>(job)] = std::move(text);
    ++done;
    if (options.on_progress) options.on_progress(done, jobs);
  };
  if (options.workers <= 1 || jobs <= 1) {
    for (int job = 0; job < jobs; ++job) {
      if (stopped()) return {};
      finished(job, work(job));
    }
    return results;
  }

  WorkerPool pool(std::min(options.workers, jobs), {.time_limit_s = kTimeLimit_s},
                  [&work](const std::string& job) { return work(std::stoi(job)); });
  int next = 0;
  const auto submit_one = [&] {
    if (next == jobs) return false;
    pool.Submit({.id = next, .input = std::to_string(next)});
    ++next;
    return true;
  };
  const auto take = [&](JobResult result) {
    const auto job = static_cast<int>(result.id);
    finished(job, OutputOf(std::move(result)));
  };
  if (!KeepBusy(&pool, submit_one, take, [&] { return !stopped(); }) && done < jobs) return {};
  return results;
}

}  // namespace turbidock::farm
