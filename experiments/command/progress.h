#pragma once
// How long work shows itself on stderr, one line that is redrawn on a terminal, plain lines
// elsewhere; and how it is stopped.

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <optional>
#include <string>

namespace turbidock::command {

// "12 s", "3:05 min", "1:20 h".
std::string Duration(double seconds);

// How long what is left of equal parts takes, which several workers do: by the pace of the latter
// half of the time.
class Pace {
 public:
  // So many are done after so long. Those of the first second were kept, not done.
  void Add(double time_s, int64_t done);
  // "2:00 to 13:40 min left", "2:00 min left" of `least` to `most` parts, of which some are done.
  // "at most 13:40 min left" once that may be all, and until workers that began together have come
  // to their second part: what they have under way does not count. Empty as long as none is done.
  std::string Left(int64_t least, int64_t most) const;

 private:
  struct Sample {
    double time_s;
    int64_t done;
  };
  std::deque<Sample> samples_ = {{0, 0}};
};

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
  // The same of equal parts; what is done when it is first called was so before. There will be from
  // `least`, as far as is known, to `most`: "37 of 142 (at most 870) trials, 2:00 to 13:40 min
  // left".
  void ShowDone(int64_t done, int64_t least, int64_t most, const std::string& what, double every_s);
  void ShowDone(int64_t done, int64_t of, const std::string& what, double every_s) {
    ShowDone(done, of, of, what, every_s);
  }
  // A line that stays.
  void Say(const std::string& line);
  // A result, on stdout, quiet or not.
  void Print(const std::string& result);

 private:
  void Clear();

  using Clock = std::chrono::steady_clock;

  bool quiet_, terminal_;
  bool shown_ = false;
  Clock::time_point last_line_ = Clock::now();
  std::optional<Clock::time_point> start_;  // of the parts, once what was kept is known
  Pace pace_;
};

// Ctrl-C and kill end the program at once, as any other, but for work that has something to save:
// from here on SIGINT and SIGTERM only ask the program to stop; whether they did is what is
// returned. A second one does not wait.
std::function<bool()> CatchStopSignals();

// The signal that asked the program to stop, or 0.
int StopSignal();

}  // namespace turbidock::command
