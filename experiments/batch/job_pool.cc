#include "experiments/batch/job_pool.h"

#include <chrono>
#include <utility>

#include "sim/base/check.h"

namespace turbidock::batch {

std::optional<JobResult> JobPool::Next(double timeout_s) {
  const auto start = std::chrono::steady_clock::now();
  double left_s = timeout_s;
  while (ended_.empty() && pending() > 0) {
    if (left_s <= 0 || !Wait(left_s)) return std::nullopt;
    left_s =
        timeout_s - std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  if (ended_.empty()) return std::nullopt;
  HandOut();
  JobResult result = std::move(ended_.front());
  ended_.pop_front();
  return result;
}

std::unique_ptr<JobPool> MakePool(const JobOptions& options, double time_limit_s, Work work) {
  TD_CHECK(options.workers >= 1 && time_limit_s > 0, "workers and a time limit");
  return options.slurm ? internal::MakeSlurmPool(options, time_limit_s, work.name)
                       : internal::MakeWorkerPool(options, time_limit_s, std::move(work));
}

bool RunAll(JobPool* pool, const std::function<bool()>& submit_one,
            const std::function<void(JobResult)>& take, const std::function<bool()>& go_on) {
  constexpr double kPoll_s = 1;  // how late progress and a stop may be
  for (;;) {
    while (pool->pending() < pool->max_in_flight() && submit_one()) {
    }
    if (pool->pending() == 0) return true;
    if (auto result = pool->Next(kPoll_s)) take(*std::move(result));
    if (!go_on()) return false;
  }
}

bool MapEach(JobPool* pool, const std::vector<std::string>& inputs,
             const std::function<void(size_t, const std::string& output)>& take,
             const std::function<bool()>& stop_requested) {
  size_t next = 0, done = 0;
  const auto submit_one = [&] {
    if (next == inputs.size()) return false;
    pool->Submit({.id = static_cast<int64_t>(next), .input = inputs[next]});
    ++next;
    return true;
  };
  const auto take_one = [&](const JobResult& result) {
    if (result.end == JobEnd::kBadInput) throw ConfigError(result.error);
    if (result.end != JobEnd::kDone)
      throw SimulatorFault(result.error + (result.log.empty() ? "" : ": " + result.log));
    ++done;
    take(static_cast<size_t>(result.id), result.output);
  };
  RunAll(pool, submit_one, take_one, [&] { return !stop_requested || !stop_requested(); });
  return done == inputs.size();
}

}  // namespace turbidock::batch
