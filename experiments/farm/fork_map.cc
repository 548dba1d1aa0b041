#include "experiments/farm/fork_map.h"

#include <algorithm>

#include "experiments/farm/worker_pool.h"

namespace turbidock::farm {
namespace {

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

}  // namespace turbidock::farm
