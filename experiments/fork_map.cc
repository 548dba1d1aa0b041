#include "experiments/fork_map.h"

#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>

#include "sim/base/check.h"

namespace turbidock::experiments {
namespace {

enum class Kind : uint32_t { kResult, kConfigError, kFault };

// In front of each text from a worker.
struct Header {
  Kind kind;
  int32_t job;
  uint64_t bytes;
};

bool WriteAll(int fd, const void* data, size_t bytes) {
  const char* next = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t n = write(fd, next, bytes);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    next += n;
    bytes -= static_cast<size_t>(n);
  }
  return true;
}

// The number of the next job, from the pipe that all workers read; false when there is none left.
bool TakeJob(int queue, int32_t* job) {
  ssize_t n;
  do n = read(queue, job, sizeof *job);
  while (n < 0 && errno == EINTR);
  return n == sizeof *job;
}

[[noreturn]] void Work(int queue, int out, const std::function<std::string(int)>& work) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // The parent decides when to stop; a Ctrl-C reaches it as well.
  std::signal(SIGINT, SIG_IGN);
  for (int32_t job = 0; TakeJob(queue, &job);) {
    Header header{Kind::kResult, job, 0};
    std::string text;
    try {
      text = work(job);
    } catch (const ConfigError& error) {
      header.kind = Kind::kConfigError;
      text = error.what();
    } catch (const std::exception& error) {
      header.kind = Kind::kFault;
      text = error.what();
    }
    header.bytes = text.size();
    if (!WriteAll(out, &header, sizeof header) || !WriteAll(out, text.data(), text.size())) break;
  }
  _exit(0);
}

struct Worker {
  pid_t pid = -1;
  int in = -1;           // from the worker; -1: it has ended
  std::string received;  // not yet a whole message
};

class Workers {
 public:
  Workers(int jobs, int count, const std::function<std::string(int)>& work) {
    int queue[2];
    TD_CHECK(pipe(queue) == 0, std::strerror(errno));
    for (int32_t job = 0; job < jobs; ++job) WriteAll(queue[1], &job, sizeof job);
    close(queue[1]);
    for (int i = 0; i < count; ++i) {
      int result[2];
      TD_CHECK(pipe(result) == 0, std::strerror(errno));
      const pid_t pid = fork();
      if (pid < 0) throw SimulatorFault(std::string("no worker process: ") + std::strerror(errno));
      if (pid == 0) {
        close(result[0]);
        Work(queue[0], result[1], work);
      }
      close(result[1]);
      workers_.push_back({pid, result[0], {}});
    }
    close(queue[0]);
  }
  ~Workers() {
    for (const Worker& worker : workers_) {
      if (worker.in >= 0) close(worker.in);
      kill(worker.pid, SIGKILL);  // most have ended by themselves
      waitpid(worker.pid, nullptr, 0);
    }
  }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  // Waits up to 0.2 s and hands over what came.
  void Receive(const std::function<void(const Header&, std::string)>& take) {
    std::vector<pollfd> waiting;
    for (const Worker& worker : workers_) waiting.push_back({worker.in, POLLIN, 0});
    poll(waiting.data(), waiting.size(), 200);
    for (size_t i = 0; i < workers_.size(); ++i)
      if (waiting[i].revents != 0) ReadFrom(&workers_[i], take);
  }

  bool ended() const {
    return std::all_of(workers_.begin(), workers_.end(),
                       [](const Worker& worker) { return worker.in < 0; });
  }

 private:
  static void ReadFrom(Worker* worker,
                       const std::function<void(const Header&, std::string)>& take) {
    char block[65536];
    const ssize_t n = read(worker->in, block, sizeof block);
    if (n < 0 && errno == EINTR) return;
    if (n <= 0) {
      close(worker->in);
      worker->in = -1;
      return;
    }
    std::string& received = worker->received;
    received.append(block, static_cast<size_t>(n));
    Header header;
    while (received.size() >= sizeof header) {
      std::memcpy(&header, received.data(), sizeof header);
      if (received.size() < sizeof header + header.bytes) return;
      take(header, received.substr(sizeof header, header.bytes));
      received.erase(0, sizeof header + header.bytes);
    }
  }

  std::vector<Worker> workers_;
};

}  // namespace

std::vector<std::string> ForkMap(int jobs, const std::function<std::string(int)>& work,
                                 const ForkMapOptions& options) {
  TD_CHECK(jobs <= 10000, "more jobs than the queue holds");
  const auto stopped = [&] { return options.stop_requested && options.stop_requested(); };
  std::vector<std::string> results(static_cast<size_t>(jobs));
  int done = 0;
  const auto finished = [&](int job, std::string text) {
    results[static_cast<size_t>(job)] = std::move(text);
    ++done;
    if (options.on_progress) options.on_progress(done, jobs);
  };
  if (options.workers <= 1) {
    for (int job = 0; job < jobs; ++job) {
      if (stopped()) return {};
      finished(job, work(job));
    }
    return results;
  }

  Workers workers(jobs, std::min(options.workers, jobs), work);
  while (done < jobs) {
    if (stopped()) return {};
    if (workers.ended())
      throw SimulatorFault(std::to_string(jobs - done) + " of " + std::to_string(jobs) +
                           " jobs were lost: their worker process died");
    workers.Receive([&](const Header& header, std::string text) {
      if (header.kind == Kind::kConfigError) throw ConfigError(text);
      if (header.kind == Kind::kFault) throw SimulatorFault(text);
      finished(header.job, std::move(text));
    });
  }
  return results;
}

}  // namespace turbidock::experiments
