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

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "experiments/batch/job_pool.h"
#include "experiments/report/json.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"
#include "experiments/system/subprocess.h"
#include "sim/base/check.h"
#include "sim/base/digest.h"

namespace turbidock::batch {
namespace {

namespace fs = std::filesystem;
using report::Json;

constexpr size_t kAhead = 16;        // jobs for each worker in an array
constexpr double kTryAgain_s = 5;    // until an array is handed in again
constexpr double kPatience_s = 600;  // with a controller that does not answer, or refuses
constexpr double kShortestPause_s = 0.05, kLongestPause_s = 1;  // between two looks at the files
constexpr double kAsk_s = 3;  // between two questions to the controller
constexpr int kTries = 3;     // of a job

// ------------------------------------------------------------------------ files of both processes

std::string JobsFile(int task) { return fmt::format("jobs-{}.jsonl", task); }
std::string ResultFile(int task, int64_t serial) {
  return fmt::format("result-{}-{}.json", task, serial);
}

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream rest(text);
  for (std::string line; std::getline(rest, line);)
    if (!line.empty()) lines.push_back(line);
  return lines;
}

// Starts a program of Slurm's and returns what it prints. SimulatorFault when it is missing or
// refuses, in its own words.
std::string AskSlurm(const std::vector<std::string>& command) {
  return system::Subprocess(command, "slurm-client").Finish();
}

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// ------------------------------------------------------------------------------------ this process

class SlurmPool final : public JobPool {
 public:
  SlurmPool(const JobOptions& options, double time_limit_s, std::string work)
      : params_(*options.slurm),
        workers_(static_cast<size_t>(options.workers)),
        time_limit_s_(time_limit_s),
        work_(std::move(work)) {
    params_.folder = fs::absolute(params_.folder).lexically_normal().string();
    system::MakeFolder(params_.folder);
    name_ = "turbidock-" + DigestOf(params_.folder);
    // Of a run that was killed: nobody waits for these any more.
    bool left = false;
    for (const auto& entry : fs::directory_iterator(params_.folder))
      if (entry.path().filename().string().starts_with("array-"))
        left |= fs::remove_all(entry.path()) > 0;
    if (left) Cancel();
  }

  ~SlurmPool() override {
    try {
      if (!tasks_.empty()) Cancel();
    } catch (const std::exception&) {  // what is left of them ends by itself
    }
    std::error_code ignored;
    for (const auto& [number, job] : arrays_) fs::remove_all(FolderOf(number), ignored);
    fs::remove(params_.folder, ignored);  // unless there is something in it
  }

  size_t max_in_flight() const override {
    return kAhead * static_cast<size_t>(params_.tasks) * workers_;
  }

 private:
  using Clock = std::chrono::steady_clock;
  using TaskId = std::pair<int, int>;  // array and task

  size_t under_way() const override {
    size_t jobs = 0;
    for (const auto& [id, left] : tasks_) jobs += left.size();
    return jobs;
  }

  fs::path FolderOf(int array) const {
    return fs::path(params_.folder) / fmt::format("array-{}", array);
  }

  // All tasks of this folder.
  void Cancel() const { AskSlurm({"scancel", "--name=" + name_}); }

  // What a program of Slurm's prints. Nothing where it fails, maybe not for long: that is said the
  // first time, and an error when it has gone on for ten minutes, or with the first array, which
  // shows whether there is a cluster and what options it takes. A controller that comes and goes
  // has many words, so have limits on what a user may submit.
  std::optional<std::string> Try(const std::vector<std::string>& command) {
    try {
      std::string printed = AskSlurm(command);
      failing_since_.erase(command[0]);
      return printed;
    } catch (const SimulatorFault& error) {
      const auto [since, is_first] = failing_since_.emplace(command[0], Clock::now());
      if (!accepted_ || SecondsSince(since->second) > kPatience_s) throw;
      if (is_first && params_.say)
        params_.say(std::string("Slurm fails, trying again: ") + error.what());
      return std::nullopt;
    }
  }

  // What an array's tasks do, and its script.
  void WriteArray(const fs::path& folder, size_t tasks) const {
    system::MakeFolder(folder.string());
    const Json head = {
        {"build", system::BuildId()}, {"work", work_}, {"time_limit_s", time_limit_s_}};
    std::vector<std::string> jobs(tasks, report::JsonLine(head) + "\n");
    for (size_t i = 0; i < waiting_.size(); ++i)
      jobs[i % tasks] +=
          report::JsonLine({{"serial", waiting_[i].serial}, {"input", waiting_[i].job.input}}) +
          "\n";
    for (size_t task = 0; task < tasks; ++task)
      system::WriteWhole(folder / JobsFile(static_cast<int>(task)), jobs[task]);
    std::string script = fmt::format(
        "#!/bin/bash\n#SBATCH --job-name={}\n#SBATCH --array=0-{}\n#SBATCH --cpus-per-task={}\n"
        "#SBATCH --no-requeue\n#SBATCH --open-mode=append\n#SBATCH --output=\"{}/task-%a.log\"\n",
        name_, tasks - 1, workers_, folder.string());
    for (const std::string& option : params_.options) script += "#SBATCH " + option + "\n";
    script += fmt::format("exec {} slurm-task {} --task \"$SLURM_ARRAY_TASK_ID\" --workers {}\n",
                          system::ShellWord(fs::read_symlink("/proc/self/exe").string()),
                          system::ShellWord(folder.string()), workers_);
    system::WriteWhole(folder / "array.sh", script);
  }

  // Submits what waits, where tasks are free.
  void SubmitArray() {
    // Not a task at a time: each array costs the controller something, and us a second.
    const size_t all = static_cast<size_t>(params_.tasks), busy = tasks_.size();
    if (waiting_.empty() || 2 * busy > all || SecondsSince(refused_) < kTryAgain_s) return;
    const size_t tasks = std::min(all - busy, (waiting_.size() + workers_ - 1) / workers_);
    // A number a try: an array that was taken although sbatch failed finds no jobs.
    const int number = numbers_++;
    const fs::path folder = FolderOf(number);
    std::string& job = arrays_[number];  // without tasks it goes again
    WriteArray(folder, tasks);
    const auto printed = Try({"sbatch", "--parsable", (folder / "array.sh").string()});
    if (!printed) {
      refused_ = Clock::now();
      return;
    }
    job = printed->substr(0, printed->find_first_of(";\n"));  // "JOB" or "JOB;CLUSTER"
    accepted_ = true;
    for (size_t i = 0; i < waiting_.size(); ++i) {
      const int64_t serial = waiting_[i].serial;
      const std::pair task(number, static_cast<int>(i % tasks));
      tasks_[task].emplace(serial, std::move(waiting_[i]));
    }
    waiting_.clear();
    asked_ = Clock::now();
    pause_s_ = 0;
  }

  // Reads what has been written. A result that is known, or of a task that was lost, is no more.
  void CollectFrom(int array, const fs::path& file) {
    const std::string name = file.filename().string();
    int task = 0, end = 0;
    long long serial = 0;
    std::sscanf(name.c_str(), "result-%d-%lld.json%n", &task, &serial, &end);
    if (end == 0 || name[static_cast<size_t>(end)] != '\0') return;
    const auto open = tasks_.find({array, task});
    if (open == tasks_.end()) return;
    const auto done = open->second.extract(serial);
    if (!done) return;
    if (open->second.empty()) tasks_.erase(open);
    ended_.push_back(report::ParseJson(system::ReadWhole(file), file.string()).get<JobResult>());
    ended_.back().id = done.mapped().job.id;
    pause_s_ = 0;
  }

  void Collect() {
    for (const auto& [number, job] : arrays_)
      for (const auto& entry : fs::directory_iterator(FolderOf(number)))
        CollectFrom(number, entry.path());
    std::erase_if(arrays_, [&](const auto& array) {
      const auto first = tasks_.lower_bound({array.first, 0});
      const bool is_over = first == tasks_.end() || first->first.first != array.first;
      std::error_code ignored;
      if (is_over) fs::remove_all(FolderOf(array.first), ignored);
      return is_over;
    });
  }

  // Which tasks have gone; what they left is sent again.
  void Ask() {
    if (tasks_.empty() || SecondsSince(asked_) < kAsk_s) return;
    asked_ = Clock::now();
    const auto printed =
        Try({"squeue", "--noheader", "--array", "--name=" + name_, "--format=%F %K %t"});
    if (!printed) return;
    std::istringstream rows(*printed);
    std::map<std::string, std::set<int>> queued;  // tasks by Slurm's job
    std::string job, task, state;
    while (rows >> job >> task >> state)
      if (state != "CG" && std::isdigit(static_cast<unsigned char>(task[0])))
        queued[job].insert(std::stoi(task));
    // Twice gone is gone: a result may come after its task by as long as files take.
    const std::set<TaskId> before = std::exchange(missing_, {});
    std::vector<TaskId> gone;
    for (const auto& [id, left] : tasks_) {
      if (queued[arrays_.at(id.first)].contains(id.second)) continue;
      missing_.insert(id);
      if (before.contains(id)) gone.push_back(id);
    }
    if (!gone.empty()) Lose(gone);
  }

  // Slurm's name of it, with the last line of its log.
  std::string NameOf(const TaskId& task) const {
    const fs::path log = FolderOf(task.first) / fmt::format("task-{}.log", task.second);
    std::vector<std::string> lines;
    if (fs::exists(log)) lines = LinesOf(system::ReadWhole(log));
    return fmt::format("{}_{}: {}", arrays_.at(task.first), task.second,
                       lines.empty() ? "it said nothing" : lines.back());
  }

  void Lose(const std::vector<TaskId>& gone) {
    const size_t before = waiting_.size();
    for (const TaskId& id : gone) {
      auto lost = tasks_.extract(id);
      for (auto& [serial, left] : lost.mapped()) {
        if (++left.losses == kTries)
          throw SimulatorFault(fmt::format(
              "Slurm's tasks ended {} times without a result of a job; the last one, {}", kTries,
              NameOf(id)));
        waiting_.push_back(std::move(left));
      }
    }
    if (params_.say)
      params_.say(
          fmt::format("{} tasks of Slurm's are gone without {} results, submitted again; {}",
                      gone.size(), waiting_.size() - before, NameOf(gone.front())));
  }

  bool Wait(double longest_s) override {
    SubmitArray();
    Collect();
    if (!ended_.empty()) return true;
    Ask();
    const int pause_ms = static_cast<int>(1000 * std::min(longest_s, pause_s_)) + 1;
    pause_s_ = std::clamp(1.3 * pause_s_, kShortestPause_s, kLongestPause_s);
    return poll(nullptr, 0, pause_ms) == 0;  // else a signal
  }

  SlurmParams params_;
  size_t workers_;
  double time_limit_s_;
  std::string work_;
  std::string name_;  // of the jobs in Slurm: of this folder, so that those left over are known
  std::map<TaskId, std::map<int64_t, Waiting>> tasks_;  // jobs by serial, of those that have any
  std::map<int, std::string> arrays_;                   // Slurm's number of each that has tasks
  std::set<TaskId> missing_;  // not in Slurm's queue when it was last asked
  int numbers_ = 0;
  Clock::time_point asked_{}, refused_{};
  double pause_s_ = 0;
  bool accepted_ = false;                                   // an array
  std::map<std::string, Clock::time_point> failing_since_;  // by program
};

}  // namespace

std::unique_ptr<JobPool> internal::MakeSlurmPool(const JobOptions& options, double time_limit_s,
                                                 const std::string& work) {
  return std::make_unique<SlurmPool>(options, time_limit_s, work);
}

// ------------------------------------------------------------------------------------- in the task

void RunSlurmTask(const std::string& folder, int task, int workers,
                  const std::vector<Work>& works) {
  const fs::path array = folder, jobs_file = array / JobsFile(task);
  const std::vector<std::string> lines = LinesOf(system::ReadWhole(jobs_file));
  if (lines.empty()) throw ConfigError(jobs_file.string() + ": is no list of jobs");
  const Json head = report::ParseJson(lines.front(), jobs_file.string());
  if (head["build"] != system::BuildId())
    throw SimulatorFault(fmt::format("the program there is {}, not {}", system::BuildId(),
                                     head["build"].get<std::string>()));
  const auto work = std::ranges::find(works, head["work"].get<std::string>(), &Work::name);
  TD_CHECK(work != works.end(), "work that a task knows");
  const auto pool = MakePool({.workers = workers}, head["time_limit_s"], *work);
  size_t next = 1;
  const auto submit_one = [&] {
    for (; next < lines.size(); ++next) {
      const Json job = report::ParseJson(lines[next], jobs_file.string());
      if (fs::exists(array / ResultFile(task, job["serial"]))) continue;
      pool->Submit({.id = job["serial"], .input = job["input"]});
      ++next;
      return true;
    }
    return false;
  };
  const auto take = [&](const JobResult& result) {
    system::WriteWhole(array / ResultFile(task, result.id), report::JsonLine(result));
  };
  RunAll(pool.get(), submit_one, take, [] { return true; });
}

}  // namespace turbidock::batch
