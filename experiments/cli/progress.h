#pragma once
// How long work shows itself on stderr: one line that is redrawn on a terminal, plain lines
// elsewhere.

#include <string>

namespace turbidock::experiments::cli {

class Progress {
 public:
  // Quiet shows nothing at all.
  explicit Progress(bool quiet);
  ~Progress();  // clears the bar

  // Redraws the bar: a share in [0, 1] and some words. Does nothing off a terminal, and little when
  // called too often.
  void Show(double share, const std::string& words);
  // A line that stays.
  void Say(const std::string& line);
  // The same, but not on a terminal, where the bar shows it.
  void SayOffTerminal(const std::string& line);

 private:
  void Clear();

  bool quiet_, terminal_;
  bool shown_ = false;
  double last_share_ = -1;
};

}  // namespace turbidock::experiments::cli
