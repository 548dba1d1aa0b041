#pragma once
// One writer at a time.

#include <string>

namespace turbidock::batch {

// Holds a lock on a file, which it makes if there is none. It ends with the process however that
// ends, and is not inherited by workers.
class RunLock {
 public:
  // ConfigError when another process holds it or the file cannot be made.
  explicit RunLock(const std::string& file);
  ~RunLock();
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;

 private:
  int fd_ = -1;
};

// Whether a process holds the file's lock now.
bool IsLocked(const std::string& file);

}  // namespace turbidock::batch
