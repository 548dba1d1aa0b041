#include "experiments/farm/run_lock.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "sim/base/check.h"

namespace turbidock::farm {
namespace {

bool IsSameFile(int fd, const std::string& path) {
  struct stat opened {};
  struct stat named {};
  return fstat(fd, &opened) == 0 && stat(path.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

// A lock of the open file description: it ends when the last process that has the file open does.
// Unlike flock's, it works on network file systems and can be asked for without taking it.
struct flock WholeFile() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

std::string Holder(int fd) {
  char text[64] = {};
  const ssize_t n = pread(fd, text, sizeof text - 1, 0);
  return n > 0 ? " (process " + std::string(text) + ")" : "";
}

// One lock for all of a file's names but hard links.
std::string LockOf(const std::string& file) {
  std::error_code error;
  const std::filesystem::path real = std::filesystem::weakly_canonical(file, error);
  return (error ? file : real.string()) + ".lock";
}

}  // namespace

RunLock::RunLock(const std::string& file) : path_(LockOf(file)) {
  for (;;) {
    fd_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd_ < 0) throw ConfigError(path_ + ": cannot be written: " + std::strerror(errno));
    struct flock lock = WholeFile();
    if (fcntl(fd_, F_OFD_SETLK, &lock) != 0) {
      const int problem = errno;
      const std::string holder = Holder(fd_);
      close(fd_);
      throw ConfigError(problem == EAGAIN || problem == EACCES
                            ? file + ": another run" + holder + " is writing to this file"
                            : path_ + ": cannot be locked: " + std::strerror(problem));
    }
    // Who held it before may have removed it between our two calls.
    if (IsSameFile(fd_, path_)) break;
    close(fd_);
  }
  const std::string pid = std::to_string(getpid());
  if (ftruncate(fd_, 0) != 0 || pwrite(fd_, pid.data(), pid.size(), 0) < 0) {
    // Without a number in it, it locks as well.
  }
}

bool IsLocked(const std::string& file) {
  const int fd = open(LockOf(file).c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return false;
  struct flock lock = WholeFile();
  const bool locked = fcntl(fd, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  close(fd);
  return locked;
}

RunLock::~RunLock() {
  unlink(path_.c_str());
  close(fd_);
}

}  // namespace turbidock::farm
