#include "experiments/farm/farm.h"

#include "experiments/farm/slurm_pool.h"

namespace turbidock::farm {

std::unique_ptr<JobPool> MakePool(const FarmOptions& options, double time_limit_s, Work work) {
  if (options.slurm)
    return std::make_unique<SlurmPool>(*options.slurm, options.workers, time_limit_s, work.name);
  return std::make_unique<WorkerPool>(
      options.workers, WorkerOptions{.time_limit_s = time_limit_s, .fork = options.fork},
      std::move(work.run));
}

}  // namespace turbidock::farm
