#pragma once
// Another program that reads what we write, or writes what we read: ffmpeg, gnuplot.

#include <sys/types.h>

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace turbidock::system {

// A program started without a shell. What it prints is kept in memory, so it can never block on us
// and we never on it, unless its output is asked for as a stream. It is in a process group of its
// own: Ctrl-C ends the trial, which then closes the program's input and lets it finish its file.
class Subprocess {
 public:
  enum class Output {
    kMemory,  // kept until Finish
    kStream,  // to be read by Read while the program runs
  };

  // Starts command[0], looked up in PATH, with the other elements as its arguments. SimulatorFault
  // when that is not possible; the message names the Debian package `package`.
  Subprocess(const std::vector<std::string>& command, const std::string& package,
             Output output = Output::kMemory);
  // Closes the program's input and waits for it, whatever its end.
  ~Subprocess();
  Subprocess(const Subprocess&) = delete;
  Subprocess& operator=(const Subprocess&) = delete;

  // Writes everything to the program's standard input. False when it no longer reads (Finish then
  // says why); never raises SIGPIPE.
  bool Write(const void* data, size_t bytes);

  // Reads up to `bytes` of the program's output; fewer only at its end. For kStream.
  size_t Read(void* data, size_t bytes);

  // Closes the program's input, waits for its end and returns what it wrote to standard output. Any
  // end but exit status 0 is a SimulatorFault with the status and the last of standard error, in
  // one line.
  std::string Finish();
  // The same, but when `stop` asks for an end meanwhile the program and those that it started are
  // killed, and nothing is returned.
  std::optional<std::string> FinishUnless(const std::function<bool()>& stop);
  // The same for a program that writes the file `path`: ConfigError when the disk is full.
  void FinishWriting(const std::string& path);

 private:
  int CloseAndWait();  // the program's wait status

  std::string name_;
  Output kind_;
  pid_t pid_ = -1;
  int input_ = -1;                 // our end of the program's standard input
  int output_ = -1, errors_ = -1;  // memory files that take its standard output and error
};

}  // namespace turbidock::system
