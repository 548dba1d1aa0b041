// Work in child processes: what crashes, hangs or runs out of memory takes its own process along
// and nothing else.

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <utility>

#include "experiments/batch/job_pool.h"
#include "experiments/report/json.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"

namespace turbidock::batch {
namespace {

constexpr size_t kLongestLog = 4000;  // bytes of a job's output that are kept
constexpr int kExitByException = 70;
constexpr double kLongestSleep_s = 0.2;

// ------------------------------------------------------------------------------- in both processes

// Sends all of a text; false when the other side is gone.
bool Send(int socket, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = TEMP_FAILURE_RETRY(send(socket, text.data(), text.size(), MSG_NOSIGNAL));
    if (n <= 0) return false;
    text.remove_prefix(static_cast<size_t>(n));
  }
  return true;
}

// Appends what has arrived; false when the other side is gone.
bool ReceiveSome(int socket, std::string* text) {
  char buffer[1 << 16];
  const ssize_t n = TEMP_FAILURE_RETRY(recv(socket, buffer, sizeof buffer, 0));
  if (n <= 0) return false;
  text->append(buffer, static_cast<size_t>(n));
  return true;
}

// A message is a line of JSON, which has no line breaks of its own.
std::string Line(const report::Json& json) { return report::JsonLine(json) + "\n"; }

// ------------------------------------------------------------------------------------ in the child

double CpuTime() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

int64_t ResidentBytes() {
  int64_t total = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

// One thread a worker: libraries read these when they start.
void PinThreads() {
  for (const char* variable :
       {"OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"})
    setenv(variable, "1", /*overwrite=*/1);
  setenv("LP_NUM_THREADS", "0", /*overwrite=*/1);
}

// When memory runs out, the kernel is to take a worker and not the process that keeps the results.
void OfferToOomKiller() { std::ofstream("/proc/self/oom_score_adj") << 500; }

JobResult DoJob(const Work& work, const std::string& input) {
  JobResult result;
  const double cpu_start_s = CpuTime();
  const auto fail = [&result](JobEnd end, const std::exception& error) {
    result.end = end;
    result.error = error.what();
  };
  try {
    result.output = work.run(input);
  } catch (const ConfigError& error) {
    fail(JobEnd::kBadInput, error);
  } catch (const SimulatorFault& error) {
    fail(JobEnd::kFault, error);
  } catch (const std::exception& error) {  // out of memory: nothing in here can be trusted any more
    std::fprintf(stderr, "%s\n", system::OneLineOf(error.what()).c_str());
    std::fflush(nullptr);
    _exit(kExitByException);
  }
  result.cpu_time_s = CpuTime() - cpu_start_s;
  result.rss_bytes = ResidentBytes();
  return result;
}

[[noreturn]] void RunWorker(pid_t parent, int socket, int log, const Work& work) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(0);  // it died before the line above
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_DFL);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  // A crash leaves every line that came before it. The buffer is ours: with one that was written to
  // glibc 2.41 does not look for ends of lines.
  static char lines[BUFSIZ];
  std::setvbuf(stdout, lines, _IOLBF, sizeof lines);
  dup2(open("/dev/null", O_RDONLY | O_CLOEXEC), STDIN_FILENO);
  // Nothing else of the parent's: a lock on a file must end with the process that took it.
  constexpr int kSocket = STDERR_FILENO + 1;
  dup2(socket, kSocket);
  close_range(kSocket + 1, ~0U, 0);
  PinThreads();
  OfferToOomKiller();
  FILE* const jobs = fdopen(kSocket, "r");
  char* line = nullptr;
  size_t size = 0;
  while (getline(&line, &size, jobs) > 0) {
    const std::string input = report::ParseJson(line, "a worker's job");
    const JobResult reply = DoJob(work, input);
    std::fflush(nullptr);  // what the work wrote belongs to this job's log
    if (!Send(kSocket, Line(reply))) break;
  }
  _exit(0);
}

// ----------------------------------------------------------------------------------- in the parent

std::string LogText(int log) {
  const off_t size = lseek(log, 0, SEEK_END);
  const off_t begin = std::max<off_t>(0, size - static_cast<off_t>(kLongestLog));
  std::string text(static_cast<size_t>(size - begin), '\0');
  const ssize_t n = pread(log, text.data(), text.size(), begin);
  text.resize(static_cast<size_t>(std::max<ssize_t>(n, 0)));
  return (begin > 0 ? "..." : "") + text;
}

std::string EndText(int status) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    return fmt::format("the process was killed by signal {} ({}{})", signal, strsignal(signal),
                       signal == SIGKILL ? "; out of memory?" : "");
  }
  const int code = WEXITSTATUS(status);
  return code == kExitByException ? "the process ended with an exception"
                                  : fmt::format("the process ended with exit status {}", code);
}

double SecondsBetween(std::chrono::steady_clock::time_point start,
                      std::chrono::steady_clock::time_point end) {
  return std::chrono::duration<double>(end - start).count();
}

std::string SystemError(const char* what) { return std::string(what) + ": " + strerror(errno); }

class WorkerPool final : public JobPool {
 public:
  WorkerPool(const JobOptions& options, double time_limit_s, Work work)
      : fork_(options.fork),
        time_limit_s_(time_limit_s),
        work_(std::move(work)),
        workers_(static_cast<size_t>(options.workers)) {}

  ~WorkerPool() override {
    for (Worker& worker : workers_) Stop(&worker);
  }

  // One ahead for each worker: none waits while a result is stored.
  size_t max_in_flight() const override { return 2 * workers_.size(); }

 private:
  using Clock = std::chrono::steady_clock;

  struct Worker {
    pid_t pid = -1;
    int socket = -1;  // jobs go in, results come out
    int log = -1;     // a memory file: its stdout and stderr
    std::optional<int64_t> job{};
    Clock::time_point started{};
    double worked_s = 0;     // of the time limit
    std::string received{};  // the beginning of a result
  };

  size_t under_way() const override {
    return static_cast<size_t>(std::ranges::count_if(
        workers_, [](const Worker& worker) { return worker.job.has_value(); }));
  }

  void Start(Worker* worker) {
    int ends[2] = {-1, -1};
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
      throw SimulatorFault(SystemError("cannot connect a worker process"));
    worker->socket = ends[0];
    worker->log = memfd_create("worker", MFD_CLOEXEC);
    if (worker->log < 0) throw SimulatorFault(SystemError("cannot make a worker's log"));
    fcntl(worker->log, F_SETFL, O_APPEND);
    std::fflush(nullptr);  // or the child would write it again
    const pid_t parent = getpid();
    worker->pid = fork_();
    if (worker->pid < 0) throw SimulatorFault(SystemError("cannot start a worker process"));
    if (worker->pid == 0) RunWorker(parent, ends[1], worker->log, work_);
    close(ends[1]);
  }

  // Kills and reaps it.
  static void Stop(Worker* worker) {
    if (worker->pid > 0) {
      kill(worker->pid, SIGKILL);
      TEMP_FAILURE_RETRY(waitpid(worker->pid, nullptr, 0));
    }
    for (const int fd : {worker->socket, worker->log})
      if (fd >= 0) close(fd);
    *worker = {};
  }

  // Workers are started when needed.
  void HandOut() override {
    for (Worker& worker : workers_) {
      if (waiting_.empty()) return;
      if (worker.job) continue;
      const Job job = std::move(waiting_.front().job);
      waiting_.pop_front();
      if (worker.pid < 0) Start(&worker);
      if (ftruncate(worker.log, 0) != 0) throw SimulatorFault(SystemError("cannot clear a log"));
      const std::string line = Line(job.input);
      if (!Send(worker.socket, line)) {  // somebody killed it while it had nothing to do
        Stop(&worker);
        Start(&worker);
        Send(worker.socket, line);
      }
      worker.job = job.id;
      worker.started = Clock::now();
      worker.worked_s = 0;
    }
  }

  // Notes how its job ended.
  void Ended(Worker* worker, JobResult result) {
    result.id = *std::exchange(worker->job, {});
    result.log = LogText(worker->log);
    result.wall_time_s = SecondsBetween(worker->started, Clock::now());
    ended_.push_back(std::move(result));
  }

  // What it sent, or its death.
  void Receive(Worker* worker) {
    if (!ReceiveSome(worker->socket, &worker->received)) {
      int status = 0;
      TEMP_FAILURE_RETRY(waitpid(std::exchange(worker->pid, -1), &status, 0));
      if (worker->job) Ended(worker, {.end = JobEnd::kCrashed, .error = EndText(status)});
      Stop(worker);
    } else if (worker->received.ends_with('\n')) {
      const std::string reply = std::exchange(worker->received, {});
      Ended(worker, report::ParseJson(reply, "a worker's reply").get<JobResult>());
    }
  }

  // Counts the time since the last look against the time limits. More than a sleep has passed only
  // where this process was paused, and its workers with it: that does not count.
  void CountTime() {
    const auto now = Clock::now();
    for (Worker& worker : workers_)
      if (worker.job)
        worker.worked_s +=
            std::min(SecondsBetween(std::max(looked_, worker.started), now), kLongestSleep_s);
    looked_ = now;
  }

  bool Wait(double longest_s) override {
    HandOut();
    double sleep_s = std::min(longest_s, kLongestSleep_s);
    std::vector<pollfd> sockets;
    for (const Worker& worker : workers_) {
      sockets.push_back({worker.socket, POLLIN, 0});
      if (worker.job) sleep_s = std::min(sleep_s, time_limit_s_ - worker.worked_s);
    }
    const int ready = poll(sockets.data(), sockets.size(),
                           static_cast<int>(std::ceil(1000 * std::max(sleep_s, 0.0))));
    CountTime();
    if (ready < 0 && errno == EINTR) return false;
    for (size_t i = 0; i < workers_.size(); ++i) {
      Worker& worker = workers_[i];
      if (ready > 0 && sockets[i].revents != 0) {
        Receive(&worker);
      } else if (worker.job && worker.worked_s >= time_limit_s_) {
        Ended(&worker,
              {.end = JobEnd::kHung,
               .error = fmt::format("no end after {:g} s, the time limit", time_limit_s_)});
        Stop(&worker);
      }
    }
    return true;
  }

  std::function<pid_t()> fork_;
  double time_limit_s_;
  Work work_;
  std::vector<Worker> workers_;
  Clock::time_point looked_ = Clock::now();
};

}  // namespace

std::unique_ptr<JobPool> internal::MakeWorkerPool(const JobOptions& options, double time_limit_s,
                                                  Work work) {
  return std::make_unique<WorkerPool>(options, time_limit_s, std::move(work));
}

}  // namespace turbidock::batch
