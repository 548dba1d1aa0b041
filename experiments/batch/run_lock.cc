#include "experiments/batch/run_lock.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "sim/base/check.h"

namespace turbidock::batch {
namespace {

// A lock of the open file description: it ends when the last process that has the file open does.
// Unlike flock's, it works on network file systems and can be asked for without taking it. It is on
// a byte far behind those that SQLite locks.
struct flock FarByte() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = off_t{1} << 62;
  lock.l_len = 1;
  return lock;
}

}  // namespace

RunLock::RunLock(const std::string& file)
    : fd_(open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
  if (fd_ < 0) throw ConfigError(file + ": cannot be written: " + std::strerror(errno));
  struct flock lock = FarByte();
  if (fcntl(fd_, F_OFD_SETLK, &lock) == 0) return;
  const int problem = errno;
  close(fd_);
  throw ConfigError(file + (problem == EAGAIN || problem == EACCES
                                ? ": another run is writing to this file"
                                : std::string(": cannot be locked: ") + std::strerror(problem)));
}

RunLock::~RunLock() { close(fd_); }

bool IsLocked(const std::string& file) {
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return false;
  struct flock lock = FarByte();
  const bool locked = fcntl(fd, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  close(fd);
  return locked;
}

}  // namespace turbidock::batch
