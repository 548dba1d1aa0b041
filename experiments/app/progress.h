#pragma once
// How long work shows itself on stderr: one line that is redrawn on a terminal, plain lines
// elsewhere.

#include <chrono>
#include <string>

namespace turbidock::app {

// "12 s", "3:05 min", "1:20 h".
std::string Duration(double seconds);
// What is left of work that began then, when `done` of `of` equal parts have been done.
std::string TimeToGo(std::chrono::steady_clock::time_point start, int done, int of);

class Progress {
 public:
  // Quiet shows nothing at all.
  explicit Progress(bool quiet);
  ~Progress();  // clears the bar

  // Redraws the bar: a share in [0, 1] and some words. Does nothing off a terminal, and little when
  // called too often.
  void Show(double share, const std::string& words);
  // The same for hours of work: off a terminal, a plain line at most every `every_s`.
  void ShowOrSay(double share, const std::string& words, double every_s);
  // A line that stays.
  void Say(const std::string& line);
  // The same, but not on a terminal, where the bar shows it.
  void SayOffTerminal(const std::string& line);

 private:
  void Clear();

  bool quiet_, terminal_;
  bool shown_ = false;
  double last_share_ = -1;
  std::chrono::steady_clock::time_point last_line_ = std::chrono::steady_clock::now();
};

}  // namespace turbidock::app
