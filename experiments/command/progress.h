#pragma once
// How long work shows itself on stderr, one line that is redrawn on a terminal, plain lines
// elsewhere; and how it is stopped.

#include <chrono>
#include <functional>
#include <limits>
#include <string>

namespace turbidock::command {

// "12 s", "3:05 min", "1:20 h".
std::string Duration(double seconds);

class Progress {
 public:
  // Quiet shows nothing at all.
  explicit Progress(bool quiet);
  ~Progress();  // clears the bar

  // Redraws the bar: a share in [0, 1] and some words; not when called too often. Off a terminal it
  // is a plain line at most every `every_s`.
  void ShowOrSay(double share, const std::string& words, double every_s);
  // The same without plain lines.
  void Show(double share, const std::string& words) {
    ShowOrSay(share, words, std::numeric_limits<double>::infinity());
  }
  // The same of equal parts, of which the first was begun when this was made: "3 of 12 cells, 40 s
  // to go".
  void ShowDone(int done, int of, const std::string& what, double every_s);
  // A line that stays.
  void Say(const std::string& line);

 private:
  void Clear();

  using Clock = std::chrono::steady_clock;

  bool quiet_, terminal_;
  bool shown_ = false;
  Clock::time_point start_ = Clock::now(), last_line_ = start_;
};

// Ctrl-C and kill end the program at once, as any other, but for work that has something to save:
// from here on SIGINT and SIGTERM only ask the program to stop; whether they did is what is
// returned. A second one does not wait.
std::function<bool()> CatchStopSignals();

// The signal that asked the program to stop, or 0.
int StopSignal();

}  // namespace turbidock::command
