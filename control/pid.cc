#include "control/pid.h"

#include <algorithm>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::control {
namespace {

constexpr double kNearest_m = 0.2;  // nearer markers are aimed at as if they were here

}  // namespace

Pid::Pid(const PidParams& params, const VehicleModel& vehicle, const ClockParams& clock)
    : params_(params), clock_(clock) {
  CheckFields(params_, "");
  const ForceAllocation allocation(params_.allocation, vehicle);
  const auto gains = [&](Axis axis, const auto& g) -> Gains {
    const double inertia = vehicle.inertia[axis];
    return {.kp = inertia * g.kp_per_s2,
            .ki = inertia * g.ki_per_s3,
            .kd = inertia * g.kd_per_s,
            .least = g.limit_share * allocation.most_back()[axis],
            .most = g.limit_share * allocation.most()[axis]};
  };
  gains_ = {gains(kSurge, params_.surge), gains(kSway, params_.sway), gains(kHeave, params_.heave),
            gains(kYaw, params_.yaw)};
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

Axes Pid::Demand(const Reference& wanted) {
  TD_CHECK(last_frame_, "nothing has been observed");
  Pending now{.error = Difference(position_, wanted.position), .wanted = Axes::Zero()};
  Axes error_rate = rate_ - wanted.rate;
  const double aim_per_m = params_.yaw.aim / std::max(position_[kSurge], kNearest_m);
  now.error[kYaw] += aim_per_m * now.error[kSway];
  error_rate[kYaw] += aim_per_m * error_rate[kSway];
  Axes limited;
  for (int i = 0; i < kAxisCount; ++i) {
    const Gains& g = gains_[static_cast<size_t>(i)];
    now.wanted[i] = g.kp * now.error[i] + g.kd * error_rate[i] + integral_[i];
    limited[i] = std::clamp(now.wanted[i], g.least, g.most);
  }
  pending_ = now;
  return limited;
}

void Pid::OnCommandApplied(int64_t, const Axes& given) {
  if (!pending_) return;
  const Axes missing = given - pending_->wanted;
  // no more than all that is missing, whatever the frame rate
  const double back = std::min(1.0, clock_.frame_s() / params_.anti_windup_s);
  for (int i = 0; i < kAxisCount; ++i) {
    const double ki = gains_[static_cast<size_t>(i)].ki;
    if (ki > 0) integral_[i] += ki * clock_.frame_s() * pending_->error[i] + back * missing[i];
  }
  pending_.reset();
}

}  // namespace turbidock::control
