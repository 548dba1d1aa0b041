#pragma once
// Jobs as tasks of Slurm job arrays.
//
// Jobs wait until tasks are free, then all that wait are submitted as one array: a generation of a
// search is an array. A task gets its share as a file, does it in worker processes and writes every
// result as it comes; this process reads them where the nodes put them. All of this is in a folder
// that nodes and this process see:
//
//   array-3/jobs-2.jsonl        what task 2 does: a line that says how, then a job a line
//   array-3/result-2-17.json    what came of its job 17
//   array-3/task-2.log          what it said
//   array-3/array.sh            what sbatch got
//
// Whoever loses a task (a node that dies, a limit, scancel, a file system that is full) loses time
// only: what has no result when its task is gone is submitted again, three times at most. A task
// that Slurm itself starts again goes on where it stopped. While the controller does not answer,
// results are read all the same; it is waited for, also when it refuses an array after it took one.

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "experiments/batch/job_options.h"
#include "sim/base/check.h"

namespace turbidock::batch {

// Not thread-safe.
class SlurmPool : public JobPool {
 public:
  // `workers`: processes and cores of a task; `work`: the name of what it does with a job.
  // ConfigError when the folder cannot be made.
  SlurmPool(const SlurmParams& params, int workers, double time_limit_s, std::string work);
  ~SlurmPool() override;  // cancels what is under way
  SlurmPool(const SlurmPool&) = delete;
  SlurmPool& operator=(const SlurmPool&) = delete;

  void Submit(Job job) override;
  // SimulatorFault when Slurm refuses the first array, when for ten minutes it refuses a later one
  // or does not answer, when a job's task was lost too often, or when a task runs another program.
  std::optional<JobResult> Next(double timeout_s) override;
  size_t pending() const override { return waiting_.size() + flights_.size() + ended_.size(); }
  size_t max_in_flight() const override;

 private:
  using Clock = std::chrono::steady_clock;
  using TaskId = std::pair<int, int>;  // array and task

  struct Flight {
    Job job;
    int64_t serial = 0;  // its number here: ids may repeat
    int losses = 0;
    TaskId task{};
  };

  void Send();     // what waits, where tasks are free
  void Collect();  // results that have been written
  void Ask();      // which tasks have gone; what they left is sent again
  void Lose(const std::set<TaskId>& gone);
  std::set<TaskId> OpenTasks() const;
  std::filesystem::path FolderOf(int array) const;
  std::string NameOf(const TaskId& task) const;  // Slurm's, with the last line of its log
  void Cancel() const;                           // all tasks of this folder
  // Slurm has failed, maybe not for long: says `what` the first time, throws the error when it has
  // gone on for ten minutes.
  void WaitOut(const std::string& what, const SimulatorFault& error);

  SlurmParams params_;
  int workers_;
  double time_limit_s_;
  std::string work_;
  std::string name_;  // of the jobs in Slurm: of this folder, so that those left over are known
  std::deque<Flight> waiting_;
  std::map<int64_t, Flight> flights_;  // by serial
  std::deque<JobResult> ended_;
  std::map<int, std::string> arrays_;  // Slurm's number of each that has jobs under way
  std::set<TaskId> missing_;           // not in Slurm's queue when it was last asked
  int64_t serials_ = 0;
  int numbers_ = 0;
  Clock::time_point asked_{}, refused_{};
  double pause_s_ = 0;
  bool accepted_ = false;                                   // an array
  std::map<std::string, Clock::time_point> failing_since_;  // by what is said of it
};

// What a task does: the jobs of FOLDER/jobs-TASK.jsonl that have no result yet, in `workers`
// processes, by that one of `works` which the file names.
void RunSlurmTask(const std::string& folder, int task, int workers, const std::vector<Work>& works);

}  // namespace turbidock::batch
