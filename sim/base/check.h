#pragma once
// Errors come in three tiers:
//  1. a broken invariant or misuse of the code: TD_CHECK, always on, prints and aborts;
//  2. bad input (a file, a key, a command line): throw ConfigError, caught only in main, exit code
//  2;
//  3. what happens at sea (lost marker, timeout, collision): a value with an enum and a sentence.

#include <stdexcept>
#include <string>

namespace turbidock {

// Bad input. `key` is the dotted path of the offending value, empty if there is none; `what()` is
// the complete sentence for the user.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(const std::string& message) : std::runtime_error(message) {}
  ConfigError(std::string key, const std::string& problem)
      : std::runtime_error(key.empty() ? problem : key + ": " + problem),
        key_(std::move(key)),
        problem_(problem) {}

  const std::string& key() const { return key_; }
  const std::string& problem() const { return problem_; }

 private:
  std::string key_, problem_;
};

// The simulator or the renderer cannot run on this machine (no OSMesa, no framebuffer). Exit
// code 4.
class SimulatorFault : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

namespace internal {
[[noreturn]] void CheckFailed(const char* file, int line, const char* condition,
                              const std::string& message);
}  // namespace internal

}  // namespace turbidock

// Aborts with place, condition and message when `condition` is false. For programming errors only.
#define TD_CHECK(condition, message)                                                 \
  do {                                                                               \
    if (!(condition)) [[unlikely]]                                                   \
      ::turbidock::internal::CheckFailed(__FILE__, __LINE__, #condition, (message)); \
  } while (false)
