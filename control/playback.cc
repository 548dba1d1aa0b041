#include "control/playback.h"

#include <algorithm>

#include "sim/base/check.h"

namespace turbidock::control {

void PlaybackParams::CheckInUse(const std::string& path) const {
  if (file.empty())
    throw ConfigError(JoinKey(path, "file"), "is empty: control.use = playback needs the commands");
}

Playback::Playback(std::vector<Row> rows, size_t thrusters)
    : rows_(std::move(rows)), off_(ThrusterCommand::Neutral(thrusters)) {
  TD_CHECK(!rows_.empty(), "a command to play");
  const double last_s = rows_.back().time_s;
  end_s_ = rows_.size() > 1 ? 2 * last_s - rows_[rows_.size() - 2].time_s : last_s;
}

const ThrusterCommand& Playback::At(double time_s) const {
  // Times of ticks and of rows are sums of fractions: forgive their rounding.
  constexpr double kRounding_s = 1e-9;
  const double now_s = time_s + kRounding_s;
  if (now_s < rows_.front().time_s || (rows_.size() > 1 && now_s >= end_s_)) return off_;
  const auto after = std::ranges::upper_bound(rows_, now_s, {}, &Row::time_s);
  return std::prev(after)->command;
}

std::vector<Playback::Part> Playback::Within(double begin_s, double end_s) const {
  std::vector<Part> parts = {{1, &At(begin_s)}};
  const auto change = [&](double from_s, const ThrusterCommand& to) {
    const double left = (end_s - from_s) / (end_s - begin_s);
    parts.back().share -= left;
    parts.push_back({left, &to});
  };
  auto row = std::ranges::upper_bound(rows_, begin_s, {}, &Row::time_s);
  for (; row != rows_.end() && row->time_s < end_s; ++row) change(row->time_s, row->command);
  if (rows_.size() > 1 && begin_s < end_s_ && end_s_ < end_s) change(end_s_, off_);
  return parts;
}

double VoltsOfPulse(double pulse_us) {
  constexpr double kNeutral_us = 1500, kFull_us = 400;
  return kNeutralVolts + kNeutralVolts * (pulse_us - kNeutral_us) / kFull_us;
}

}  // namespace turbidock::control
