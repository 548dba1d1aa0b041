#pragma once
// Independent jobs on several processor cores, each core in a process of its own: OpenGL, OpenCV
// and the allocator then share nothing.

#include <functional>
#include <string>
#include <vector>

#include "experiments/farm/farm.h"

namespace turbidock::farm {

struct ForkMapOptions {
  int workers = 1;                                         // 1: here, unless it may be stopped
  std::function<void(int done, int of)> on_progress = {};  // after each job
  std::function<bool()> stop_requested = {};               // asked every second
};

// Calls work(0), ..., work(jobs - 1) in copies of this process as it is now (a pool of workers, see
// farm/worker_pool.h) and returns what they return, in order; nothing when it was stopped. Which
// worker does which job is left to chance, so a job's result must depend on its number only. A
// ConfigError in a job is one here; any other failure is a SimulatorFault.
std::vector<std::string> ForkMap(int jobs, const std::function<std::string(int)>& work,
                                 const ForkMapOptions& options);

// The same of inputs, on a cluster: a job must depend on its input only. `options.workers`: of each
// task.
std::vector<std::string> SlurmMap(const Work& work, const std::vector<std::string>& inputs,
                                  const SlurmParams& slurm, const ForkMapOptions& options);

}  // namespace turbidock::farm
