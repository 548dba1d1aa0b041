#include "experiments/batch/job_options.h"

#include "experiments/batch/slurm_pool.h"
#include "sim/base/check.h"

namespace turbidock::batch {
namespace {

std::string OutputOf(JobResult result) {
  if (result.end == JobEnd::kDone) return std::move(result.output);
  if (result.end == JobEnd::kBadInput) throw ConfigError(result.error);
  throw SimulatorFault(result.error + (result.log.empty() ? "" : ": " + result.log));
}

}  // namespace

std::unique_ptr<JobPool> MakePool(const JobOptions& options, double time_limit_s, Work work) {
  if (options.slurm)
    return std::make_unique<SlurmPool>(*options.slurm, options.workers, time_limit_s, work.name);
  return std::make_unique<WorkerPool>(
      options.workers, WorkerOptions{.time_limit_s = time_limit_s, .fork = options.fork},
      std::move(work.run));
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

}  // namespace turbidock::batch
