#pragma once
// Work in child processes: what crashes, hangs or runs out of memory takes its own process along
// and nothing else.
//
//   WorkerPool pool(2, {.time_limit_s = 600}, [](const std::string& input) { return Work(input);
//   }); pool.Submit({.id = 17, .input = "..."}); while (auto result = pool.Next(/*timeout_s=*/1))
//   Store(result->id, result->output);
//
// Which worker does a job and in which order jobs end is not determined; what a job yields is, as
// long as the work depends on its input only.

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sim/base/result_fields.h"

namespace turbidock::farm {

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

  TURBIDOCK_FIELDS(end, output, error, cpu_time_s, rss_bytes)  // what the worker sends
};

struct WorkerOptions {
  double time_limit_s = 3600;  // wall time of a job
};

// Not thread-safe. Workers are forked, so they see the memory as it was when the pool was made; the
// caller must not have threads of its own at that time.
class WorkerPool {
 public:
  using Work = std::function<std::string(const std::string& input)>;

  // Starts `workers` >= 1 processes. Each renders and computes in one thread. They ignore Ctrl-C,
  // which is the caller's to handle, and end with the pool or when the caller's process dies.
  WorkerPool(int workers, const WorkerOptions& options, Work work);
  ~WorkerPool();  // kills the workers; unfinished jobs are lost
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  void Submit(Job job);
  // The next job to end, as soon as it does. Nothing when none is left, after timeout_s, and when a
  // signal was handled meanwhile.
  std::optional<JobResult> Next(double timeout_s);

  // Jobs submitted whose result has not been returned. Keep it above workers() and no worker waits.
  size_t pending() const;
  int workers() const { return static_cast<int>(workers_.size()); }

 private:
  using Clock = std::chrono::steady_clock;

  struct Worker {
    pid_t pid = -1;
    int socket = -1;  // jobs go in, results come out
    int log = -1;     // a memory file: its stdout and stderr
    std::optional<int64_t> job;
    Clock::time_point started;
    std::string received;  // the beginning of a result
  };

  void Start(Worker* worker);
  void Stop(Worker* worker);  // kills and reaps it
  void Restart(Worker* worker);
  void HandOut();                                // jobs to idle workers
  void Receive(Worker* worker);                  // what it sent, or its death
  void Ended(Worker* worker, JobResult result);  // notes how its job ended

  WorkerOptions options_;
  Work work_;
  std::vector<Worker> workers_;
  std::deque<Job> waiting_;
  std::deque<JobResult> ended_;
};

}  // namespace turbidock::farm
