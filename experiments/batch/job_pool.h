#pragma once
// Jobs that depend on nothing but their input, and who does them: processes of this machine
// (worker_pool.cc) or tasks of a Slurm cluster (slurm_pool.cc). What a job yields is the same.
//
//   const auto pool = MakePool({.workers = 2}, /*time_limit_s=*/600, {"square", &Square});
//   pool->Submit({.id = 17, .input = "..."});
//   while (pool->pending() > 0)
//     if (auto result = pool->Next(/*timeout_s=*/1)) Store(result->id, result->output);

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/base/result_fields.h"

namespace turbidock::batch {

struct Job {
  int64_t id = 0;     // the caller's, returned with the result
  std::string input;  // any bytes
};

enum class JobEnd {
  kDone,
  kBadInput,  // the work threw ConfigError
  kFault,     // the work threw SimulatorFault: this machine cannot do it
  kCrashed,   // the process ended: a signal, an exit, any other exception, out of memory
  kHung,      // the process was killed after time_limit_s
};

struct JobResult {
  int64_t id = 0;
  JobEnd end = JobEnd::kDone;
  std::string output{};    // of the work, when done
  std::string error{};     // a sentence, when not done
  std::string log{};       // the last of what the work wrote to stdout and stderr
  double wall_time_s = 0;  // from handing the job to the worker to its end
  double cpu_time_s = 0;   // user and system, of the worker in this job; 0 when it died
  int64_t rss_bytes = 0;   // the worker's resident memory after the job; 0 when it died

  TURBIDOCK_FIELDS(id, end, output, error, log, wall_time_s, cpu_time_s, rss_bytes)
};

// What is done with a job's input. A task on another machine knows it by its name.
struct Work {
  std::string name;
  std::function<std::string(const std::string& input)> run;
};

// Not thread-safe. Who does a job and in which order jobs end is not determined.
class JobPool {
 public:
  JobPool() = default;
  virtual ~JobPool() = default;  // unfinished jobs are lost
  JobPool(const JobPool&) = delete;
  JobPool& operator=(const JobPool&) = delete;

  void Submit(Job job) {
    waiting_.push_back({.job = std::move(job), .serial = serials_++});
    HandOut();
  }
  // The next job to end, as soon as it does, in whatever order. Nothing when none is left, after
  // timeout_s, and when a signal was handled meanwhile. SimulatorFault when jobs cannot be done at
  // all: no process can be started; Slurm refuses the first array, for ten minutes refuses a later
  // one or does not answer, or loses a job's task three times.
  std::optional<JobResult> Next(double timeout_s);
  // Jobs submitted whose result has not been returned.
  size_t pending() const { return waiting_.size() + under_way() + ended_.size(); }
  // So many pending ones leave no worker without work; more would only wait.
  virtual size_t max_in_flight() const = 0;

 protected:
  struct Waiting {
    Job job;
    int64_t serial = 0;  // its number here: ids may repeat
    int losses = 0;      // of what did it
  };

  virtual size_t under_way() const = 0;
  // Gives jobs that wait to whoever is free, when there is a new one and before the caller works on
  // a result.
  virtual void HandOut() {}
  // The same, and waits until a job has ended, so long, or until there is something else to look
  // at. False when a signal was handled.
  virtual bool Wait(double longest_s) = 0;

  std::deque<Waiting> waiting_;
  std::deque<JobResult> ended_;

 private:
  int64_t serials_ = 0;
};

struct SlurmParams {
  int tasks = 1;                          // at most so many at a time
  std::vector<std::string> options = {};  // of sbatch: "--time=2:00:00"
  // Between the tasks and this process: on a file system that all nodes see, of this command alone.
  // Made, and removed at the end.
  std::string folder = {};
  std::function<void(const std::string&)> say = nullptr;  // what a person may want to know
};

struct JobOptions {
  // Processes: of this machine, or a task. Each renders and computes in one thread. They ignore
  // Ctrl-C, which is the caller's to handle, and end with the pool or when the caller's process
  // dies.
  int workers = 1;
  std::optional<SlurmParams> slurm = {};  // none: this machine
  // How a process of this machine is made: for a program with an interpreter that must know of it.
  // Processes begin when there is a job for them, and see the memory as it was then; the caller
  // must not have threads of its own at that time.
  std::function<pid_t()> fork = ::fork;
};

// `time_limit_s`: wall time of a job, counted while the caller waits for it and this process runs:
// neither Ctrl-Z nor a suspended machine makes a job hang. ConfigError when Slurm's folder cannot
// be made.
std::unique_ptr<JobPool> MakePool(const JobOptions& options, double time_limit_s, Work work);

inline constexpr double kJobTimeLimit_s = 24 * 3600;  // of what is no trial

// Runs until there is no job left to submit and none under way, or `go_on` says no; false then: the
// pool is then good for nothing more. `submit_one()` submits the next job, if there is one to
// submit now, and returns whether it did; `take(result)` gets each result, in whatever order they
// come; `go_on()` is asked after each result and at least every second.
bool RunAll(JobPool* pool, const std::function<bool()>& submit_one,
            const std::function<void(JobResult)>& take, const std::function<bool()>& go_on);

// Has a pool do these inputs and gives every output as it comes, with its input's index; likewise
// false when it was stopped. A ConfigError in a job is one here; any other failure is a
// SimulatorFault.
bool MapEach(JobPool* pool, const std::vector<std::string>& inputs,
             const std::function<void(size_t, const std::string& output)>& take,
             const std::function<bool()>& stop_requested);

// What a task of Slurm's does: the jobs of FOLDER/jobs-TASK.jsonl that have no result yet, in
// `workers` processes, by that one of `works` which the file names.
void RunSlurmTask(const std::string& folder, int task, int workers, const std::vector<Work>& works);

namespace internal {  // for MakePool
std::unique_ptr<JobPool> MakeWorkerPool(const JobOptions& options, double time_limit_s, Work work);
std::unique_ptr<JobPool> MakeSlurmPool(const JobOptions& options, double time_limit_s,
                                       const std::string& work);
}  // namespace internal

}  // namespace turbidock::batch
