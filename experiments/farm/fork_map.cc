#include "experiments/farm/fork_map.h"

#include <algorithm>

#include "experiments/farm/worker_pool.h"
#include "sim/base/check.h"

namespace turbidock::farm {
namespace {

std::string OutputOf(JobResult result) {
  if (result.end == JobEnd::kDone) return std::move(result.output);
  if (result.end == JobEnd::kBadInput) throw ConfigError(result.error);
  throw SimulatorFault(result.error + (result.log.empty() ? "" : ": " + result.log));
}

// What a pool makes of inputs, in their order; nothing when it was stopped.
std::vector<std::string> MapOf(JobPool* pool, const std::vector<std::string>& inputs,
                               const ForkMapOptions& options) {
  std::vector<std::string> results(inputs.size());
  int done = 0;
  const auto take = [&](size_t job, const std::string& output) {
    results[job] = output;
    if (options.on_progress) options.on_progress(++done, static_cast<int>(inputs.size()));
  };
  if (!MapEach(pool, inputs, take, options.stop_requested)) return {};
  return results;
}

}  // namespace

std::vector<std::string> ForkMap(int jobs, const std::function<std::string(int)>& work,
                                 const ForkMapOptions& options) {
  std::vector<std::string> numbers;
  numbers.reserve(static_cast<size_t>(std::max(jobs, 0)));
  for (int job = 0; job < jobs; ++job) numbers.push_back(std::to_string(job));
  // A stop is not to wait for the end of a job.
  if (jobs > 0 && (options.stop_requested || std::min(options.workers, jobs) > 1)) {
    WorkerPool pool(std::min(options.workers, jobs), {.time_limit_s = kJobTimeLimit_s},
                    [&work](const std::string& job) { return work(std::stoi(job)); });
    return MapOf(&pool, numbers, options);
  }
  std::vector<std::string> results;
  for (int job = 0; job < jobs; ++job) {
    results.push_back(work(job));
    if (options.on_progress) options.on_progress(job + 1, jobs);
  }
  return results;
}

std::vector<std::string> SlurmMap(const Work& work, const std::vector<std::string>& inputs,
                                  const SlurmParams& slurm, const ForkMapOptions& options) {
  const auto pool = MakePool({.workers = options.workers, .slurm = slurm}, kJobTimeLimit_s, work);
  return MapOf(pool.get(), inputs, options);
}

bool MapEach(JobPool* pool, const std::vector<std::string>& inputs,
             const std::function<void(size_t, const std::string& output)>& take,
             const std::function<bool()>& stop_requested) {
  size_t next = 0, done = 0;
  const auto submit_one = [&] {
    if (next == inputs.size()) return false;
    pool->Submit({.id = static_cast<int64_t>(next), .input = inputs[next]});
    ++next;
    return true;
  };
  const auto take_one = [&](JobResult result) {
    const auto job = static_cast<size_t>(result.id);
    const std::string output = OutputOf(std::move(result));
    ++done;
    take(job, output);
  };
  RunAll(pool, submit_one, take_one, [&] { return !stop_requested || !stop_requested(); });
  return done == inputs.size();
}

}  // namespace turbidock::farm
