#include "control/playback.h"

#include <algorithm>

#include "sim/base/check.h"

namespace turbidock::control {

void PlaybackParams::CheckInUse(const std::string& path) const {
  if (file.empty())
    throw ConfigError(JoinKey(path, "file"), "is empty: controller = playback needs the commands");
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

double VoltsOfPulse(double pulse_us) {
  constexpr double kNeutral_us = 1500, kFull_us = 400;
  return kNeutralVolts + kNeutralVolts * (pulse_us - kNeutral_us) / kFull_us;
}

}  // namespace turbidock::control
