#pragma once
// Jobs that depend on nothing but their input, and who does them: processes of this machine
// (worker_pool.h) or tasks of a Slurm cluster (slurm_pool.h). What a job yields is the same.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

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
  // So many pending ones leave no worker without work.
  virtual size_t appetite() const = 0;
};

}  // namespace turbidock::farm
