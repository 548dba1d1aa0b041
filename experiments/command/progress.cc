#include "experiments/command/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>

#include "experiments/batch/batch_report.h"
#include "experiments/system/plain_text.h"

namespace turbidock::command {
namespace {

constexpr int kBarWidth = 30;
constexpr double kRedraw_s = 0.2;
constexpr double kKept_s = 1;  // what is done by then was so before

// Written by the signal handler, which may touch nothing else.
volatile std::sig_atomic_t stop_signal = 0;

void OnSignal(int signal) {
  stop_signal = signal;
  std::signal(signal, SIG_DFL);
}

}  // namespace

std::string Duration(double seconds) {
  const auto s = std::llround(seconds);
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{}:{:02} min", s / 60, s % 60);
  return fmt::format("{}:{:02} h", s / 3600, s / 60 % 60);
}

void Pace::Add(double time_s, int64_t done) {
  if (done > samples_.back().done) samples_.push_back({time_s, done});
  while (samples_.size() > 1 && samples_[1].time_s <= std::max(kKept_s, samples_.back().time_s / 2))
    samples_.pop_front();
}

std::string Pace::Left(int64_t least, int64_t most) const {
  const auto& [since_s, before] = samples_.front();
  const auto& [until_s, done] = samples_.back();
  if (samples_.size() < 2 || done >= most) return "";
  const double part_s = (until_s - since_s) / static_cast<double>(done - before);
  std::string low = Duration(part_s * static_cast<double>(least - done));
  const std::string high = Duration(part_s * static_cast<double>(most - done));
  if (since_s <= kKept_s || done >= least) return "at most " + high + " left";
  if (low == high) return high + " left";
  if (const std::string unit = low.substr(low.find(' ')); high.ends_with(unit))
    low.resize(low.size() - unit.size());
  return low + " to " + high + " left";
}

Progress::Progress(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() { Clear(); }

void Progress::ShowOrSay(double share, const std::string& words, double every_s) {
  const auto now = Clock::now();
  const double since_s = std::chrono::duration<double>(now - last_line_).count();
  if (quiet_ || since_s < (terminal_ ? kRedraw_s : every_s)) return;
  last_line_ = now;
  if (!terminal_) return Say(fmt::format("{:3.0f} %  {}", 100 * share, words));
  const int filled = static_cast<int>(std::clamp(share, 0.0, 1.0) * kBarWidth);
  std::string bar;
  for (int i = 0; i < kBarWidth; ++i) bar += i < filled ? "█" : "░";
  std::fprintf(stderr, "\r\033[K%s %3.0f %%  %s", bar.c_str(), 100 * share,
               system::OneLineOf(words).c_str());
  std::fflush(stderr);
  shown_ = true;
}

void Progress::ShowDone(int64_t done, int64_t least, int64_t most, const std::string& what,
                        double every_s) {
  if (!start_) start_ = Clock::now();
  pace_.Add(std::chrono::duration<double>(Clock::now() - *start_).count(), done);
  const std::string left = pace_.Left(least, most);
  ShowOrSay(static_cast<double>(done) / static_cast<double>(least),
            fmt::format("{} {}{}{}", batch::DoneText(done, least, most), what,
                        left.empty() ? "" : ", ", left),
            every_s);
}

void Progress::Say(const std::string& line) {
  if (quiet_) return;
  Clear();
  std::fprintf(stderr, "%s\n", system::Printable(line).c_str());
}

void Progress::Print(const std::string& result) {
  Clear();
  std::fputs((system::Printable(result) + "\n").c_str(), stdout);
}

void Progress::Clear() {
  if (shown_) std::fputs("\r\033[K", stderr);
  shown_ = false;
}

std::function<bool()> CatchStopSignals() {
  std::signal(SIGINT, OnSignal);
  std::signal(SIGTERM, OnSignal);
  return [] { return stop_signal != 0; };
}

int StopSignal() { return stop_signal; }

}  // namespace turbidock::command
