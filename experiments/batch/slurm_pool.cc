#include "experiments/batch/slurm_pool.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <sstream>

#include "experiments/batch/worker_pool.h"
#include "experiments/report/json.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
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
constexpr const char* kNoArray = "Slurm takes no array, trying again";
constexpr const char* kNoAnswer = "Slurm does not answer, results are read all the same";

// ------------------------------------------------------------------------ files of both processes

std::string JobsFile(int task) { return fmt::format("jobs-{}.jsonl", task); }
std::string RefusalFile(int task) { return fmt::format("refused-{}", task); }
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

// A word of the shell that means exactly this text.
std::string ShellQuoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

// ------------------------------------------------------------------------------------ this process

SlurmPool::SlurmPool(const SlurmParams& params, int workers, double time_limit_s, std::string work)
    : params_(params), workers_(workers), time_limit_s_(time_limit_s), work_(std::move(work)) {
  TD_CHECK(params.tasks >= 1 && workers >= 1, "tasks and workers");
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

SlurmPool::~SlurmPool() {
  try {
    if (!flights_.empty()) Cancel();
  } catch (const std::exception&) {  // what is left of them ends by itself
  }
  std::error_code ignored;
  for (const auto& [number, job] : arrays_) fs::remove_all(FolderOf(number), ignored);
  fs::remove(params_.folder, ignored);  // unless there is something in it
}

size_t SlurmPool::max_in_flight() const {
  return kAhead * static_cast<size_t>(params_.tasks) * static_cast<size_t>(workers_);
}

fs::path SlurmPool::FolderOf(int array) const {
  return fs::path(params_.folder) / fmt::format("array-{}", array);
}

void SlurmPool::Cancel() const { AskSlurm({"scancel", "--name=" + name_}); }

void SlurmPool::WaitOut(const std::string& what, const SimulatorFault& error) {
  const auto [since, is_first] = failing_since_.emplace(what, Clock::now());
  if (is_first && params_.say) params_.say(what + ": " + error.what());
  if (SecondsSince(since->second) > kPatience_s) throw error;
}

void SlurmPool::Submit(Job job) {
  waiting_.push_back({.job = std::move(job), .serial = serials_++});
}

std::set<SlurmPool::TaskId> SlurmPool::OpenTasks() const {
  std::set<TaskId> open;
  for (const auto& [serial, flight] : flights_) open.insert(flight.task);
  return open;
}

void SlurmPool::Send() {
  // Not a task at a time: each array costs the controller something, and us a second.
  const size_t all = static_cast<size_t>(params_.tasks), busy = OpenTasks().size();
  if (waiting_.empty() || 2 * busy > all || SecondsSince(refused_) < kTryAgain_s) return;
  const auto workers = static_cast<size_t>(workers_);
  const size_t tasks = std::min(all - busy, (waiting_.size() + workers - 1) / workers);
  // A number a try: an array that was taken although sbatch failed finds no jobs.
  const int number = numbers_++;
  const fs::path folder = FolderOf(number);
  system::MakeFolder(folder.string());
  const Json head = {
      {"build", system::BuildId()}, {"work", work_}, {"time_limit_s", time_limit_s_}};
  std::vector<std::string> jobs(tasks, report::JsonLine(head) + "\n");
  for (size_t i = 0; i < waiting_.size(); ++i) {
    Flight& flight = waiting_[i];
    flight.task = {number, static_cast<int>(i % tasks)};
    jobs[i % tasks] +=
        report::JsonLine({{"serial", flight.serial}, {"input", flight.job.input}}) + "\n";
  }
  for (size_t task = 0; task < tasks; ++task)
    system::WriteWhole(folder / JobsFile(static_cast<int>(task)), jobs[task]);
  std::string script = "#!/bin/bash\n";
  std::vector<std::string> options = {"--job-name=" + name_,
                                      fmt::format("--array=0-{}", tasks - 1),
                                      fmt::format("--cpus-per-task={}", workers_),
                                      "--no-requeue",
                                      "--open-mode=append",
                                      fmt::format("--output=\"{}/task-%a.log\"", folder.string())};
  options.insert(options.end(), params_.options.begin(), params_.options.end());
  for (const std::string& option : options) script += "#SBATCH " + option + "\n";
  script += fmt::format("exec {} slurm-task {} --task \"$SLURM_ARRAY_TASK_ID\" --workers {}\n",
                        ShellQuoted(fs::read_symlink("/proc/self/exe").string()),
                        ShellQuoted(folder.string()), workers_);
  system::WriteWhole(folder / "array.sh", script);
  try {
    // "JOB" or "JOB;CLUSTER"
    const std::string printed = AskSlurm({"sbatch", "--parsable", (folder / "array.sh").string()});
    arrays_[number] = printed.substr(0, printed.find_first_of(";\n"));
  } catch (const SimulatorFault& error) {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    // The first one shows whether there is a cluster and what options it takes. Later refusals
    // pass: a controller that comes and goes has many words, so have limits on what a user may
    // submit.
    if (!accepted_) throw;
    WaitOut(kNoArray, error);
    refused_ = Clock::now();
    return;
  }
  accepted_ = true;
  failing_since_.clear();
  for (Flight& flight : waiting_) flights_.emplace(flight.serial, std::move(flight));
  waiting_.clear();
  asked_ = Clock::now();
  pause_s_ = 0;
}

void SlurmPool::Collect() {
  for (const auto& [number, job] : arrays_)
    for (const auto& entry : fs::directory_iterator(FolderOf(number))) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with("refused-"))
        throw SimulatorFault(
            fmt::format("a task of Slurm's job {}: {}", job, system::ReadWhole(entry.path())));
      int task = 0, end = 0;
      long long serial = 0;
      std::sscanf(name.c_str(), "result-%d-%lld.json%n", &task, &serial, &end);
      if (end == 0 || name[static_cast<size_t>(end)] != '\0') continue;
      const auto flight = flights_.extract(serial);
      if (!flight) continue;  // it is known
      const std::string text = system::ReadWhole(entry.path());
      ended_.push_back(report::ParseJson(text, entry.path().string()).get<JobResult>());
      ended_.back().id = flight.mapped().job.id;
      pause_s_ = 0;
    }
  const std::set<TaskId> open = OpenTasks();
  std::erase_if(arrays_, [&](const auto& array) {
    const auto first = open.lower_bound({array.first, 0});
    const bool is_over = first == open.end() || first->first != array.first;
    std::error_code ignored;
    if (is_over) fs::remove_all(FolderOf(array.first), ignored);
    return is_over;
  });
}

void SlurmPool::Ask() {
  if (flights_.empty() || SecondsSince(asked_) < kAsk_s) return;
  asked_ = Clock::now();
  std::istringstream rows;
  try {
    rows.str(AskSlurm({"squeue", "--noheader", "--array", "--name=" + name_, "--format=%F %K %t"}));
  } catch (const SimulatorFault& error) {
    return WaitOut(kNoAnswer, error);
  }
  failing_since_.erase(kNoAnswer);
  std::map<std::string, int> numbers;
  for (const auto& [number, job] : arrays_) numbers[job] = number;
  std::set<TaskId> queued;
  std::string job, task, state;
  while (rows >> job >> task >> state)
    if (numbers.contains(job) && state != "CG" && std::isdigit(static_cast<unsigned char>(task[0])))
      queued.emplace(numbers[job], std::stoi(task));
  // Twice gone is gone: a result may come after its task by as long as files take.
  std::set<TaskId> missing, gone;
  for (const TaskId& id : OpenTasks()) {
    if (queued.contains(id)) continue;
    missing.insert(id);
    if (missing_.contains(id)) gone.insert(id);
  }
  missing_ = missing;
  if (!gone.empty()) Lose(gone);
}

std::string SlurmPool::NameOf(const TaskId& task) const {
  const fs::path log = FolderOf(task.first) / fmt::format("task-{}.log", task.second);
  std::vector<std::string> lines;
  if (fs::exists(log)) lines = LinesOf(system::ReadWhole(log));
  return fmt::format("{}_{}: {}", arrays_.at(task.first), task.second,
                     lines.empty() ? "it said nothing" : lines.back());
}

void SlurmPool::Lose(const std::set<TaskId>& gone) {
  const size_t before = waiting_.size();
  for (auto it = flights_.begin(); it != flights_.end();) {
    Flight& flight = it->second;
    if (!gone.contains(flight.task)) {
      ++it;
      continue;
    }
    if (++flight.losses == kTries)
      throw SimulatorFault(
          fmt::format("Slurm's tasks ended {} times without a result of a job; the last one, {}",
                      kTries, NameOf(flight.task)));
    waiting_.push_back(std::move(flight));
    it = flights_.erase(it);
  }
  if (params_.say)
    params_.say(fmt::format("{} tasks of Slurm's are gone without {} results, submitted again; {}",
                            gone.size(), waiting_.size() - before, NameOf(*gone.begin())));
}

std::optional<JobResult> SlurmPool::Next(double timeout_s) {
  const auto start = Clock::now();
  while (pending() > 0) {
    if (ended_.empty()) {
      Send();
      Collect();
    }
    if (!ended_.empty()) {
      JobResult result = std::move(ended_.front());
      ended_.pop_front();
      return result;
    }
    Ask();
    const double left_s = timeout_s - SecondsSince(start);
    if (left_s <= 0) return std::nullopt;
    const int pause_ms = static_cast<int>(1000 * std::min(left_s, pause_s_)) + 1;
    pause_s_ = std::clamp(1.3 * pause_s_, kShortestPause_s, kLongestPause_s);
    if (poll(nullptr, 0, pause_ms) != 0) return std::nullopt;  // a signal
  }
  return std::nullopt;
}

// ------------------------------------------------------------------------------------- in the task

void RunSlurmTask(const std::string& folder, int task, int workers,
                  const std::vector<Work>& works) {
  const fs::path array = folder, jobs_file = array / JobsFile(task);
  const std::vector<std::string> lines = LinesOf(system::ReadWhole(jobs_file));
  if (lines.empty()) throw ConfigError(jobs_file.string() + ": is no list of jobs");
  const Json head = report::ParseJson(lines.front(), jobs_file.string());
  if (head["build"] != system::BuildId()) {
    const std::string why = fmt::format("the program there is {}, not {}", system::BuildId(),
                                        head["build"].get<std::string>());
    system::WriteWhole(array / RefusalFile(task), why);
    throw SimulatorFault(why);
  }
  const auto work = std::ranges::find(works, head["work"].get<std::string>(), &Work::name);
  TD_CHECK(work != works.end(), "every work of this build is known to it");

  WorkerPool pool(workers, {.time_limit_s = head["time_limit_s"]}, work->run);
  size_t next = 1;
  const auto submit_one = [&] {
    for (; next < lines.size(); ++next) {
      const Json job = report::ParseJson(lines[next], jobs_file.string());
      if (fs::exists(array / ResultFile(task, job["serial"]))) continue;
      pool.Submit({.id = job["serial"], .input = job["input"]});
      ++next;
      return true;
    }
    return false;
  };
  const auto take = [&](const JobResult& result) {
    system::WriteWhole(array / ResultFile(task, result.id), report::JsonLine(result));
  };
  RunAll(&pool, submit_one, take, [] { return true; });
}

}  // namespace turbidock::batch
