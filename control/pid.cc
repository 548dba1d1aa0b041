#include "control/pid.h"

#include <algorithm>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::control {
namespace {

constexpr double kNearest_m = 0.2;  // nearer markers are aimed at as if they were here

}  // namespace

Pid::Pid(const PidParams& params, const ClockParams& clock) : params_(params), clock_(clock) {
  CheckFields(params_, "");
  const auto translation = [](const PidParams::Translation& g) -> Gains {
    return {g.kp_v_per_m, g.ki_v_per_m_s, g.kd_v_s_per_m, g.limit_v};
  };
  const PidParams::Yaw& yaw = params_.yaw;
  gains_ = {translation(params_.surge), translation(params_.sway), translation(params_.heave),
            Gains{yaw.kp_v_per_rad, yaw.ki_v_per_rad_s, yaw.kd_v_s_per_rad, yaw.limit_v}};
}

void Pid::Observe(const Observation& seen) {
  TD_CHECK(!last_frame_ || seen.frame > *last_frame_, "frames must increase");
  const int64_t frames = last_frame_ ? seen.frame - *last_frame_ : 0;
  const double frame_s = clock_.frame_s();
  if (seen.rate) {
    rate_ = *seen.rate;
  } else if (!last_frame_ || static_cast<double>(frames - 1) * frame_s > params_.rate_restart_s) {
    rate_.setZero();
  } else {
    const double gap_s = static_cast<double>(frames) * frame_s;
    // exact first-order filter for any gap; a time constant of 0 gives 1
    const double a = -std::expm1(-gap_s / params_.rate_filter_s);
    rate_ += a * (Difference(seen.position, position_) / gap_s - rate_);
  }
  last_frame_ = seen.frame;
  position_ = seen.position;
}

AxisVolts Pid::Demand(const Reference& wanted) {
  TD_CHECK(last_frame_, "nothing has been observed");
  Pending now{.error = Difference(position_, wanted.position), .wanted_v = Axes::Zero()};
  Axes error_rate = rate_ - wanted.rate;
  const double aim_per_m = params_.yaw.aim / std::max(position_[kSurge], kNearest_m);
  now.error[kYaw] += aim_per_m * now.error[kSway];
  error_rate[kYaw] += aim_per_m * error_rate[kSway];
  Axes limited_v;
  for (int i = 0; i < kAxisCount; ++i) {
    const Gains& g = gains_[static_cast<size_t>(i)];
    now.wanted_v[i] = g.kp * now.error[i] + g.kd * error_rate[i] + integral_v_[i];
    limited_v[i] = std::clamp(now.wanted_v[i], -g.limit_v, g.limit_v);
  }
  pending_ = now;
  return ToAxisVolts(limited_v);
}

void Pid::Given(int64_t, const AxisVolts& volts) {
  if (!pending_) return;
  const Axes missing_v = ToAxes(volts) - pending_->wanted_v;
  // no more than all that is missing, whatever the frame rate
  const double back = std::min(1.0, clock_.frame_s() / params_.anti_windup_s);
  for (int i = 0; i < kAxisCount; ++i) {
    const double ki = gains_[static_cast<size_t>(i)].ki;
    if (ki > 0) integral_v_[i] += ki * clock_.frame_s() * pending_->error[i] + back * missing_v[i];
  }
  pending_.reset();
}

}  // namespace turbidock::control
