#include "experiments/system/subprocess.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "experiments/system/plain_text.h"
#include "sim/base/check.h"

namespace turbidock::system {
namespace {

void Close(int* fd) {
  if (*fd >= 0) close(*fd);
  *fd = -1;
}

std::string Contents(int fd) {
  std::string text(static_cast<size_t>(std::max<off_t>(0, lseek(fd, 0, SEEK_END))), '\0');
  const ssize_t n = pread(fd, text.data(), text.size(), 0);
  text.resize(static_cast<size_t>(std::max<ssize_t>(0, n)));
  return text;
}

}  // namespace

Subprocess::Subprocess(const std::vector<std::string>& command, const std::string& package,
                       Output output)
    : name_(command.at(0)), kind_(output) {
  // A socket instead of a pipe: writing to a closed one can be an error without the signal.
  int ends[2] = {-1, -1}, stream[2] = {-1, -1};
  const bool connected = socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0 &&
                         (output == Output::kMemory || pipe2(stream, O_CLOEXEC) == 0);
  input_ = ends[0];
  output_ = output == Output::kStream ? stream[0] : memfd_create("stdout", MFD_CLOEXEC);
  errors_ = memfd_create("stderr", MFD_CLOEXEC);
  int problem = connected && output_ >= 0 && errors_ >= 0 ? 0 : errno;
  if (problem == 0) {
    std::vector<char*> arguments;
    arguments.reserve(command.size() + 1);
    for (const std::string& argument : command)
      arguments.push_back(const_cast<char*>(argument.c_str()));
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, ends[1], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&files, stream[1] >= 0 ? stream[1] : output_, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&files, errors_, STDERR_FILENO);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    problem = posix_spawnp(&pid_, name_.c_str(), &files, &attributes, arguments.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
  }
  Close(&ends[1]);
  Close(&stream[1]);
  if (problem == 0) return;
  for (int* fd : {&input_, &output_, &errors_}) Close(fd);
  throw SimulatorFault("cannot start " + name_ + ": " + std::strerror(problem) +
                       (problem == ENOENT ? "; install the package " + package : ""));
}

Subprocess::~Subprocess() {
  CloseAndWait();
  Close(&output_);
  Close(&errors_);
}

bool Subprocess::Write(const void* data, size_t bytes) {
  const char* next = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t n = TEMP_FAILURE_RETRY(send(input_, next, bytes, MSG_NOSIGNAL));
    if (n < 0) return false;
    next += n;
    bytes -= static_cast<size_t>(n);
  }
  return true;
}

size_t Subprocess::Read(void* data, size_t bytes) {
  TD_CHECK(kind_ == Output::kStream, "a stream to read from");
  size_t done = 0;
  while (done < bytes) {
    const ssize_t n =
        TEMP_FAILURE_RETRY(read(output_, static_cast<char*>(data) + done, bytes - done));
    if (n <= 0) break;
    done += static_cast<size_t>(n);
  }
  return done;
}

std::string Subprocess::Finish() {
  TD_CHECK(pid_ > 0, "a program is finished once");
  const int status = CloseAndWait();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0)
    return output_ >= 0 ? Contents(output_) : std::string();
  const std::string end = WIFSIGNALED(status)
                              ? "was killed by signal " + std::to_string(WTERMSIG(status))
                              : "ended with exit status " + std::to_string(WEXITSTATUS(status));
  const std::string report = OneLineOf(Contents(errors_));
  throw SimulatorFault(name_ + " " + end + (report.empty() ? "" : ": " + report));
}

std::optional<std::string> Subprocess::FinishUnless(const std::function<bool()>& stop) {
  Close(&input_);
  siginfo_t ended{};
  while (waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         ended.si_pid == 0) {
    if (stop()) {
      kill(-pid_, SIGKILL);  // it leads a group of its own
      CloseAndWait();
      return std::nullopt;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return Finish();
}

void Subprocess::FinishWriting(const std::string& path) {
  try {
    Finish();
  } catch (const SimulatorFault& fault) {
    for (const int reason : {ENOSPC, EDQUOT, EFBIG})
      if (std::string(fault.what()).find(std::strerror(reason)) != std::string::npos)
        throw ConfigError(path, std::string("cannot be written: ") + std::strerror(reason));
    throw SimulatorFault(path + ": " + fault.what());
  }
}

int Subprocess::CloseAndWait() {
  Close(&input_);
  if (kind_ == Output::kStream) Close(&output_);  // it must not wait for a reader
  if (pid_ <= 0) return 0;
  int status = 0;
  if (TEMP_FAILURE_RETRY(waitpid(pid_, &status, 0)) < 0)
    status = 127 << 8;  // somebody else took the status: as good as a failure
  pid_ = -1;
  return status;
}

}  // namespace turbidock::system
