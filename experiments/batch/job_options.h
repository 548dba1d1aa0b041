#pragma once
// Who does a long command's jobs: processes of this machine, or tasks of a Slurm cluster.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/worker_pool.h"

namespace turbidock::batch {

struct SlurmParams {
  int tasks = 1;                          // at most so many at a time
  std::vector<std::string> options = {};  // of sbatch: "--time=2:00:00"
  // Between the tasks and this process: on a file system that all nodes see, of this command alone.
  // Made, and removed at the end.
  std::string folder = {};
  std::function<void(const std::string&)> say = nullptr;  // what a person may want to know
};

struct JobOptions {
  int workers = 1;                                     // processes: of this machine, or a task
  std::optional<SlurmParams> slurm = {};               // none: this machine
  std::function<pid_t()> fork = WorkerOptions().fork;  // of this machine's, as of WorkerOptions

  // Jobs that can be under way at a time.
  int capacity() const { return slurm ? slurm->tasks * workers : workers; }
};

// `time_limit_s`: wall time of a job. SimulatorFault where processes cannot be started.
std::unique_ptr<JobPool> MakePool(const JobOptions& options, double time_limit_s, Work work);

inline constexpr double kJobTimeLimit_s = 24 * 3600;  // of what is no trial

// Has a pool do these inputs and gives every output as it comes, with its input's index. False when
// it was stopped: the pool is then good for nothing more. A ConfigError in a job is one here; any
// other failure is a SimulatorFault.
bool MapEach(JobPool* pool, const std::vector<std::string>& inputs,
             const std::function<void(size_t, const std::string& output)>& take,
             const std::function<bool()>& stop_requested);

}  // namespace turbidock::batch
