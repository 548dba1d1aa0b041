#pragma once
// Work in child processes: what crashes, hangs or runs out of memory takes its own process along
// and nothing else.
//
//   WorkerPool pool(2, {.time_limit_s = 600}, &Work);  // std::string Work(const std::string&
//   input) pool.Submit({.id = 17, .input = "..."}); while (auto result =
//   pool.Next(/*timeout_s=*/1)) Store(result->id, result->output);
//
// Which worker does a job and in which order jobs end is not determined; what a job yields is, as
// long as the work depends on its input only.

#include <sys/types.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/job_pool.h"

namespace turbidock::batch {

struct WorkerOptions {
  // Wall time of a job, counted while Next waits and this process runs: neither Ctrl-Z nor a
  // suspended machine makes a job hang.
  double time_limit_s = 3600;
  // How a process is made: for a program with an interpreter that must know of it.
  std::function<pid_t()> fork = ::fork;
};

// Not thread-safe. Workers are forked when there is a job for them, and see the memory as it was
// then; the caller must not have threads of its own at that time.
class WorkerPool : public JobPool {
 public:
  using Work = std::function<std::string(const std::string& input)>;

  // At most `workers` >= 1 processes. Each renders and computes in one thread. They ignore Ctrl-C,
  // which is the caller's to handle, and end with the pool or when the caller's process dies.
  WorkerPool(int workers, const WorkerOptions& options, Work work);
  ~WorkerPool() override;  // kills the workers
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  void Submit(Job job) override;
  std::optional<JobResult> Next(double timeout_s) override;
  size_t pending() const override;
  // One ahead for each worker: none waits while a result is stored.
  size_t max_in_flight() const override { return 2 * workers_.size(); }

 private:
  using Clock = std::chrono::steady_clock;

  struct Worker {
    pid_t pid = -1;
    int socket = -1;  // jobs go in, results come out
    int log = -1;     // a memory file: its stdout and stderr
    std::optional<int64_t> job;
    Clock::time_point started;
    Clock::duration worked{};  // of the time limit
    std::string received;      // the beginning of a result
  };

  void Start(Worker* worker);
  void Stop(Worker* worker);     // kills and reaps it
  void HandOut();                // jobs to idle workers, which are started when needed
  void Receive(Worker* worker);  // what it sent, or its death
  // Since the last look, against the time limits. More than a sleep has passed only where this
  // process was paused, and its workers with it: that does not count.
  void CountTime();
  void Ended(Worker* worker, JobResult result);  // notes how its job ended

  WorkerOptions options_;
  Work work_;
  std::vector<Worker> workers_;
  std::deque<Job> waiting_;
  std::deque<JobResult> ended_;
  Clock::time_point looked_ = Clock::now();
};

}  // namespace turbidock::batch
