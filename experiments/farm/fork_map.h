#pragma once
// Independent jobs on several processor cores, each core in a process of its own: OpenGL, OpenCV
// and the allocator then share nothing.

#include <functional>
#include <string>
#include <vector>

namespace turbidock::farm {

struct ForkMapOptions {
  int workers = 1;                                         // 1: in this process
  std::function<void(int done, int of)> on_progress = {};  // after each job
  std::function<bool()> stop_requested = {};               // polled between jobs
};

// Calls work(0), ..., work(jobs - 1) in copies of this process as it is now (a pool of workers, see
// batch/worker_pool.h) and returns what they return, in order; nothing when it was stopped. Which
// worker does which job is left to chance, so a job's result must depend on its number only. A
// ConfigError in a job is one here; any other failure is a SimulatorFault.
std::vector<std::string> ForkMap(int jobs, const std::function<std::string(int)>& work,
                                 const ForkMapOptions& options);

}  // namespace turbidock::farm
