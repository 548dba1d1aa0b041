#pragma once
// Who does a long command's jobs: processes of this machine, or tasks of a Slurm cluster.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "experiments/farm/worker_pool.h"

namespace turbidock::farm {

struct SlurmParams {
  int tasks = 1;                          // at most so many at a time
  std::vector<std::string> options = {};  // of sbatch: "--time=2:00:00"
  // Between the tasks and this process: on a file system that all nodes see, of this command alone.
  // Made, and removed at the end.
  std::string folder = {};
  std::function<void(const std::string&)> say = nullptr;  // what a person may want to know
};

struct FarmOptions {
  int workers = 1;                                     // processes: of this machine, or a task
  std::optional<SlurmParams> slurm = {};               // none: this machine
  std::function<pid_t()> fork = WorkerOptions().fork;  // of this machine's, as of WorkerOptions

  // Jobs that can be under way at a time.
  int capacity() const { return slurm ? slurm->tasks * workers : workers; }
};

// `time_limit_s`: wall time of a job. SimulatorFault where processes cannot be started.
std::unique_ptr<JobPool> MakePool(const FarmOptions& options, double time_limit_s, Work work);

}  // namespace turbidock::farm
