#include "experiments/farm/slurm_pool.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <memory>
#include <sstream>

#include "experiments/farm/worker_pool.h"
#include "experiments/report/json.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/system/subprocess.h"
#include "sim/base/check.h"
#include "sim/base/digest.h"

namespace turbidock::farm {
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
std::string ResultsPrefix(int task) { return fmt::format("results-{}.", task); }

// The whole lines of a file from a place on, and where they end.
std::pair<std::vector<std::string>, std::streamoff> LinesFrom(const fs::path& path,
                                                              std::streamoff from) {
  std::ifstream file(path, std::ios::binary);
  file.seekg(from);
  std::ostringstream rest;
  rest << file.rdbuf();
  const std::string text = rest.str();
  std::vector<std::string> lines;
  size_t begin = 0;
  for (size_t end = 0; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1)
    lines.push_back(text.substr(begin, end - begin));
  return {lines, from + static_cast<std::streamoff>(begin)};
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

std::chrono::steady_clock::duration Seconds(double s) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(s));
}

}  // namespace

// ------------------------------------------------------------------------------------ this process

SlurmPool::SlurmPool(const SlurmParams& params, int workers, double time_limit_s, std::string work)
    : params_(params), workers_(workers), time_limit_s_(time_limit_s), work_(std::move(work)) {
  TD_CHECK(params.tasks >= 1 && workers >= 1, "tasks and workers");
  params_.folder = fs::absolute(params_.folder).lexically_normal().string();
  std::error_code error;
  fs::create_directories(params_.folder, error);
  if (error) throw ConfigError(params_.folder + ": cannot be made: " + error.message());
  Digest digest;
  digest.Add(params_.folder);
  name_ = "turbidock-" + digest.Hex();
  // Of a run that was killed: nobody waits for these any more.
  bool left = false;
  for (const auto& entry : fs::directory_iterator(params_.folder))
    if (entry.path().filename().string().starts_with("array-"))
      left |= fs::remove_all(entry.path(), error) > 0;
  if (left) Cancel();
}

SlurmPool::~SlurmPool() {
  try {
    if (!flights_.empty()) Cancel();
  } catch (const std::exception&) {  // what is left of them ends by itself
  }
  std::error_code error;
  for (const auto& [number, array] : arrays_)
    if (!array.lost) fs::remove_all(FolderOf(number), error);
  fs::remove(params_.folder, error);  // unless there is something in it
}

size_t SlurmPool::max_in_flight() const {
  return kAhead * static_cast<size_t>(params_.tasks) * static_cast<size_t>(workers_);
}

fs::path SlurmPool::FolderOf(int array) const {
  return fs::path(params_.folder) / fmt::format("array-{}", array);
}

void SlurmPool::Cancel() const { AskSlurm({"scancel", "--name=" + name_}); }

void SlurmPool::WaitOut(std::optional<Clock::time_point>* since, const std::string& what,
                        const SimulatorFault& error) const {
  if (!*since) {
    *since = Clock::now();
    if (params_.say) params_.say(what + ": " + error.what());
  }
  if (SecondsSince(**since) > kPatience_s) throw error;
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
  if (waiting_.empty() || 2 * busy > all || Clock::now() < try_again_) return;
  const auto workers = static_cast<size_t>(workers_);
  const size_t tasks = std::min(all - busy, (waiting_.size() + workers - 1) / workers);
  // A number a try: an array that was taken although sbatch failed finds no jobs.
  const int number = numbers_++;
  const fs::path folder = FolderOf(number);
  fs::create_directories(folder);
  const std::string head = report::JsonLine(
      {{"work", work_}, {"time_limit_s", time_limit_s_}, {"build", system::BuildId()}});
  for (size_t task = 0; task < tasks; ++task) {
    std::string text = head + "\n";
    for (size_t i = task; i < waiting_.size(); i += tasks) {
      waiting_[i].task = {number, static_cast<int>(task)};
      text += report::JsonLine({{"serial", waiting_[i].serial}, {"input", waiting_[i].job.input}}) +
              "\n";
    }
    system::WriteWhole(folder / JobsFile(static_cast<int>(task)), text);
  }
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
  Array array{.job_id = {}, .read = {}, .open = waiting_.size()};
  try {
    // "JOB" or "JOB;CLUSTER"
    const std::string printed = AskSlurm({"sbatch", "--parsable", (folder / "array.sh").string()});
    array.job_id = printed.substr(0, printed.find_first_of(";\n"));
  } catch (const SimulatorFault& error) {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    // The first one shows whether there is a cluster and what options it takes. Later refusals
    // pass: a controller that comes and goes has many words, so have limits on what a user may
    // submit.
    if (!accepted_) throw;
    WaitOut(&refused_since_, "Slurm takes no array, trying again", error);
    try_again_ = Clock::now() + Seconds(kTryAgain_s);
    return;
  }
  accepted_ = true;
  refused_since_.reset();
  silent_since_.reset();
  arrays_.emplace(number, std::move(array));
  for (Flight& flight : waiting_) flights_.emplace(flight.serial, std::move(flight));
  waiting_.clear();
  asked_ = Clock::now();
  pause_s_ = kShortestPause_s;
}

void SlurmPool::Read(int number, Array* array) {
  for (const auto& entry : fs::directory_iterator(FolderOf(number))) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("results-")) continue;
    std::streamoff& read = array->read[name];
    if (static_cast<std::streamoff>(entry.file_size()) <= read) continue;
    const auto [lines, end] = LinesFrom(entry.path(), read);
    read = end;
    for (const std::string& line : lines) {
      const Json json = report::ParseJson(line, entry.path().string());
      if (json.contains("refused"))
        throw SimulatorFault(fmt::format("a task of Slurm's job {}: {}", array->job_id,
                                         json["refused"].get<std::string>()));
      auto result = json.get<JobResult>();
      auto flight = flights_.extract(result.id);
      if (!flight) continue;  // known from an earlier start of the task
      result.id = flight.mapped().job.id;
      ended_.push_back(std::move(result));
      --array->open;
      pause_s_ = kShortestPause_s;
    }
  }
}

void SlurmPool::Close(int number) {
  const auto array = arrays_.find(number);
  if (array->second.open > 0) return;
  std::error_code error;
  if (!array->second.lost) fs::remove_all(FolderOf(number), error);  // else its logs say why
  arrays_.erase(array);
}

void SlurmPool::Collect() {
  std::vector<int> numbers;
  for (auto& [number, array] : arrays_) {
    Read(number, &array);
    numbers.push_back(number);
  }
  for (const int number : numbers) Close(number);
}

std::set<SlurmPool::TaskId> SlurmPool::Queued() const {
  std::istringstream rows(
      AskSlurm({"squeue", "--noheader", "--array", "--name=" + name_, "--format=%F %K %t"}));
  std::map<std::string, int> numbers;
  for (const auto& [number, array] : arrays_) numbers[array.job_id] = number;
  std::set<TaskId> queued;
  std::string job, task, state;
  while (rows >> job >> task >> state)
    if (const auto array = numbers.find(job); array != numbers.end() && state != "CG" &&
                                              std::isdigit(static_cast<unsigned char>(task[0])))
      queued.emplace(array->second, std::stoi(task));
  return queued;
}

void SlurmPool::Ask() {
  if (flights_.empty() || SecondsSince(asked_) < kAsk_s) return;
  asked_ = Clock::now();
  std::set<TaskId> queued;
  try {
    queued = Queued();
  } catch (const SimulatorFault& error) {
    WaitOut(&silent_since_, "Slurm does not answer, results are read all the same", error);
    return;
  }
  if (silent_since_ && params_.say) params_.say("Slurm answers again");
  silent_since_.reset();
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

std::string SlurmPool::LogOf(const TaskId& task) const {
  std::ifstream file(FolderOf(task.first) / fmt::format("task-{}.log", task.second));
  std::string line, last;
  while (std::getline(file, line))
    if (!line.empty()) last = line;
  return last.empty() ? "it said nothing" : last;
}

void SlurmPool::Lose(const std::set<TaskId>& gone) {
  size_t jobs = 0;
  std::set<int> numbers;
  for (auto it = flights_.begin(); it != flights_.end();) {
    Flight& flight = it->second;
    if (!gone.contains(flight.task)) {
      ++it;
      continue;
    }
    const auto& [number, task] = flight.task;
    Array& array = arrays_.at(number);
    if (++flight.losses == kTries)
      throw SimulatorFault(fmt::format(
          "Slurm's tasks ended {} times without a result of a job; the last one, {}_{}: {}", kTries,
          array.job_id, task, LogOf(flight.task)));
    --array.open;
    array.lost = true;
    numbers.insert(number);
    ++jobs;
    waiting_.push_back(std::move(flight));
    it = flights_.erase(it);
  }
  const TaskId& first = *gone.begin();
  if (params_.say)
    params_.say(
        fmt::format("{} tasks of Slurm's are gone without {} results, submitted again; {}_{}: {}",
                    gone.size(), jobs, arrays_.at(first.first).job_id, first.second, LogOf(first)));
  for (const int number : numbers) Close(number);
}

std::optional<JobResult> SlurmPool::Next(double timeout_s) {
  const auto give_up = Clock::now() + Seconds(std::min(timeout_s, 1e6));
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
    const double left_s = std::chrono::duration<double>(give_up - Clock::now()).count();
    if (left_s <= 0) return std::nullopt;
    const double sleep_s = std::min(left_s, pause_s_);
    pause_s_ = std::clamp(1.3 * pause_s_, kShortestPause_s, kLongestPause_s);
    const timespec time{static_cast<time_t>(sleep_s),
                        static_cast<long>(1e9 * (sleep_s - std::floor(sleep_s)))};
    if (nanosleep(&time, nullptr) != 0) return std::nullopt;  // a signal
  }
  return std::nullopt;
}

// -------------------------------------------------------------------------------------- in the
// task

void RunSlurmTask(const std::string& folder, int task, int workers,
                  const std::vector<Work>& works) {
  const fs::path jobs_file = fs::path(folder) / JobsFile(task);
  const std::vector<std::string> lines = LinesFrom(jobs_file, 0).first;
  if (lines.empty()) throw ConfigError(jobs_file.string() + ": is no list of jobs");
  std::set<int64_t> done;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().filename().string().starts_with(ResultsPrefix(task)))
      for (const std::string& line : LinesFrom(entry.path(), 0).first)
        if (const Json json = report::ParseJson(line, entry.path().string()); json.contains("id"))
          done.insert(json["id"].get<int64_t>());

  // A start a file: nobody appends behind a line that a lost node has torn, or still writes.
  const char* const start = std::getenv("SLURM_RESTART_COUNT");
  const fs::path path = fs::path(folder) / (ResultsPrefix(task) + (start ? start : "0") + ".jsonl");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "ae"),
                                                             &std::fclose);
  // There when it returns, also for those who read on other machines.
  const auto append = [&](const Json& json) {
    const std::string line = report::JsonLine(json) + "\n";
    if (!file || std::fputs(line.c_str(), file.get()) < 0 || std::fflush(file.get()) != 0 ||
        fsync(fileno(file.get())) != 0)
      throw SimulatorFault(path.string() + ": cannot be written: " + std::strerror(errno));
  };
  const Json head = report::ParseJson(lines.front(), jobs_file.string());
  const auto refuse = [&](const std::string& why) {
    append({{"refused", why}});
    throw SimulatorFault(why);
  };
  if (head["build"] != system::BuildId())
    refuse(fmt::format("the program there is {}, not {}", system::BuildId(),
                       head["build"].get<std::string>()));
  const auto work = std::ranges::find(works, head["work"].get<std::string>(), &Work::name);
  TD_CHECK(work != works.end(), "every work of this build is known to it");

  WorkerPool pool(workers, {.time_limit_s = head["time_limit_s"]}, work->run);
  size_t next = 1;
  const auto submit_one = [&] {
    for (; next < lines.size(); ++next) {
      const Json job = report::ParseJson(lines[next], jobs_file.string());
      if (done.contains(job["serial"].get<int64_t>())) continue;
      pool.Submit({.id = job["serial"], .input = job["input"]});
      ++next;
      return true;
    }
    return false;
  };
  RunAll(
      &pool, submit_one, [&](const JobResult& result) { append(result); }, [] { return true; });
}

}  // namespace turbidock::farm
