#include "experiments/batch/worker_pool.h"

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
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <utility>

#include "experiments/report/json.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"

namespace turbidock::batch {
namespace {

constexpr size_t kLongestLog = 4000;  // bytes of a job's output that are kept
constexpr int kExitByException = 70;
constexpr auto kLongestSleep = std::chrono::milliseconds(200);

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

JobResult DoJob(const WorkerPool::Work& work, const std::string& input) {
  JobResult result;
  const double cpu_start_s = CpuTime();
  const auto fail = [&result](JobEnd end, const std::exception& error) {
    result.end = end;
    result.error = error.what();
  };
  try {
    result.output = work(input);
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

[[noreturn]] void RunWorker(int socket, const WorkerPool::Work& work) {
  std::string received;
  for (;;) {
    size_t end = 0;
    while ((end = received.find('\n')) == std::string::npos)
      if (!ReceiveSome(socket, &received)) _exit(0);
    const std::string input = report::ParseJson(received.substr(0, end), "a worker's job");
    received.erase(0, end + 1);
    const JobResult reply = DoJob(work, input);
    std::fflush(nullptr);  // what the work wrote belongs to this job's log
    if (!Send(socket, Line(reply))) _exit(0);
  }
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

std::string SystemError(const char* what) { return std::string(what) + ": " + strerror(errno); }

}  // namespace

WorkerPool::WorkerPool(int workers, const WorkerOptions& options, Work work)
    : options_(options), work_(std::move(work)), workers_(static_cast<size_t>(workers)) {
  TD_CHECK(workers >= 1 && options.time_limit_s > 0, "workers and a time limit");
}

WorkerPool::~WorkerPool() {
  for (Worker& worker : workers_) Stop(&worker);
}

void WorkerPool::Start(Worker* worker) {
  int ends[2] = {-1, -1};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    throw SimulatorFault(SystemError("cannot connect a worker process"));
  worker->log = memfd_create("worker", MFD_CLOEXEC);
  if (worker->log < 0) throw SimulatorFault(SystemError("cannot make a worker's log"));
  fcntl(worker->log, F_SETFL, O_APPEND);
  std::fflush(nullptr);  // or the child would write it again
  const pid_t parent = getpid();
  const pid_t pid = options_.fork();
  if (pid < 0) throw SimulatorFault(SystemError("cannot start a worker process"));
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(0);  // it died before the line above
    std::signal(SIGINT, SIG_IGN);
    std::signal(SIGTERM, SIG_DFL);
    dup2(worker->log, STDOUT_FILENO);
    dup2(worker->log, STDERR_FILENO);
    std::setvbuf(stdout, nullptr, _IOLBF, 0);  // a crash leaves every line that came before it
    const int null = open("/dev/null", O_RDONLY | O_CLOEXEC);
    dup2(null, STDIN_FILENO);
    // Nothing else of the parent's: a lock on a file must end with the process that took it.
    constexpr int kSocket = STDERR_FILENO + 1;
    dup2(ends[1], kSocket);
    close_range(kSocket + 1, ~0U, 0);
    PinThreads();
    OfferToOomKiller();
    RunWorker(kSocket, work_);
  }
  close(ends[1]);
  worker->pid = pid;
  worker->socket = ends[0];
  worker->job.reset();
  worker->received.clear();
}

void WorkerPool::Stop(Worker* worker) {
  if (worker->pid > 0) {
    kill(worker->pid, SIGKILL);
    TEMP_FAILURE_RETRY(waitpid(worker->pid, nullptr, 0));
  }
  worker->pid = -1;
  for (int* fd : {&worker->socket, &worker->log}) {
    if (*fd >= 0) close(*fd);
    *fd = -1;
  }
}

void WorkerPool::Submit(Job job) {
  waiting_.push_back(std::move(job));
  HandOut();
}

size_t WorkerPool::pending() const {
  const auto busy = std::count_if(workers_.begin(), workers_.end(),
                                  [](const Worker& worker) { return worker.job.has_value(); });
  return waiting_.size() + ended_.size() + static_cast<size_t>(busy);
}

void WorkerPool::HandOut() {
  for (Worker& worker : workers_) {
    if (waiting_.empty()) return;
    if (worker.job) continue;
    const Job& job = waiting_.front();
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
    worker.worked = {};
    waiting_.pop_front();
  }
}

void WorkerPool::Ended(Worker* worker, JobResult result) {
  result.id = *worker->job;
  result.log = LogText(worker->log);
  result.wall_time_s = std::chrono::duration<double>(Clock::now() - worker->started).count();
  worker->job.reset();
  ended_.push_back(std::move(result));
}

void WorkerPool::Receive(Worker* worker) {
  if (!ReceiveSome(worker->socket, &worker->received)) {
    int status = 0;
    TEMP_FAILURE_RETRY(waitpid(worker->pid, &status, 0));
    worker->pid = -1;
    if (worker->job) Ended(worker, {.end = JobEnd::kCrashed, .error = EndText(status)});
    Stop(worker);
    return;
  }
  if (!worker->received.ends_with('\n')) return;
  Ended(worker, report::ParseJson(worker->received, "a worker's reply").get<JobResult>());
  worker->received.clear();
}

void WorkerPool::CountTime() {
  const auto now = Clock::now();
  for (Worker& worker : workers_)
    if (worker.job)
      worker.worked +=
          std::min<Clock::duration>(now - std::max(looked_, worker.started), kLongestSleep);
  looked_ = now;
}

std::optional<JobResult> WorkerPool::Next(double timeout_s) {
  const auto seconds = [](double s) {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
  };
  const auto limit = seconds(options_.time_limit_s);
  const auto give_up = Clock::now() + seconds(std::min(timeout_s, 1e6));
  while (ended_.empty() && pending() > 0) {
    HandOut();
    // Sleeps until a worker says something, the first time limit, the caller's timeout, or long
    // enough: see CountTime.
    auto sleep = std::min<Clock::duration>(give_up - Clock::now(), kLongestSleep);
    std::vector<pollfd> sockets;
    for (const Worker& worker : workers_) {
      sockets.push_back({worker.socket, POLLIN, 0});
      if (worker.job) sleep = std::min(sleep, limit - worker.worked);
    }
    const double sleep_s = std::chrono::duration<double>(sleep).count();
    const int ready = poll(sockets.data(), sockets.size(),
                           static_cast<int>(std::ceil(1000 * std::max(sleep_s, 0.0))));
    CountTime();
    if (ready < 0 && errno == EINTR) return std::nullopt;
    for (size_t i = 0; i < workers_.size(); ++i) {
      Worker& worker = workers_[i];
      if (ready > 0 && sockets[i].revents != 0) {
        Receive(&worker);
      } else if (worker.job && worker.worked >= limit) {
        Ended(&worker,
              {.end = JobEnd::kHung,
               .error = fmt::format("no end after {:g} s, the time limit", options_.time_limit_s)});
        Stop(&worker);
      }
    }
    if (ended_.empty() && Clock::now() >= give_up) return std::nullopt;
  }
  if (ended_.empty()) return std::nullopt;
  HandOut();  // before the caller stores the result: no worker waits for that
  JobResult result = std::move(ended_.front());
  ended_.pop_front();
  return result;
}

}  // namespace turbidock::batch
