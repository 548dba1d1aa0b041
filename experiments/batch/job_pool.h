#pragma once
// Jobs that depend on nothing but their input, and who does them: processes of this machine
// (worker_pool.h) or tasks of a Slurm cluster (slurm_pool.h). What a job yields is the same.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

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

class JobPool {
 public:
  virtual ~JobPool() = default;  // unfinished jobs are lost

  virtual void Submit(Job job) = 0;
  // The next job to end, as soon as it does, in whatever order. Nothing when none is left, after
  // timeout_s, and when a signal was handled meanwhile.
  virtual std::optional<JobResult> Next(double timeout_s) = 0;
  // Jobs submitted whose result has not been returned.
  virtual size_t pending() const = 0;
  // So many pending ones leave no worker without work; more would only wait.
  virtual size_t max_in_flight() const = 0;
};

inline constexpr double kPoll_s = 1;  // how late progress and a stop may be

// Runs until there is no job left to submit and none under way, or `go_on` says no; false then.
// `submit_one()` submits the next job, if there is one to submit
// now, and returns whether it did; `take(result)` gets each result, in whatever order they come;
// `go_on()` is asked after each result and at least every second.
template <class SubmitOne, class Take, class GoOn>
bool RunAll(JobPool* pool, const SubmitOne& submit_one, const Take& take, const GoOn& go_on) {
  for (;;) {
    while (pool->pending() < pool->max_in_flight() && submit_one()) {
    }
    if (pool->pending() == 0) return true;
    if (auto result = pool->Next(kPoll_s)) take(*std::move(result));
    if (!go_on()) return false;
  }
}

}  // namespace turbidock::batch
