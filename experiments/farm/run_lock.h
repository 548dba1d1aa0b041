#pragma once
// One writer at a time.

#include <string>

namespace turbidock::farm {

// Holds FILE.lock, which ends with the process however that ends. Not inherited by workers.
class RunLock {
 public:
  // ConfigError when another process holds it or the file cannot be made.
  explicit RunLock(const std::string& file);
  ~RunLock();  // removes the lock file
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;

 private:
  std::string path_;
  int fd_ = -1;
};

// Whether a process holds the file's lock now.
bool IsLocked(const std::string& file);

}  // namespace turbidock::farm
