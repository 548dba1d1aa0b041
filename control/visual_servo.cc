#include "control/visual_servo.h"

#include <algorithm>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::control {

VisualServo::VisualServo(const VisualServoParams& params, const ClockParams& clock)
    : params_(params), clock_(clock) {
  CheckFields(params_, "");
}

AxisVolts VisualServo::Update(const PoseEstimate& estimate, const DesiredPose& desired) {
  TD_CHECK(estimate.X_HM.IsFinite(), "estimated pose must be finite");
  TD_CHECK(desired.IsFinite(), "desired pose must be finite");

  const Pose X_HM = estimate.X_HM.Canonical();
  const Axes measured(X_HM.p.x(), X_HM.p.y(), X_HM.p.z(), X_HM.q.z());
  const Axes wanted(desired.x_m, desired.y_m, desired.z_m, std::sin(desired.yaw_rad / 2));
  UpdateRate(estimate.frame, measured);

  const Axes error = measured - wanted;
  auto volts = [&](int axis, double kp, double kd, double limit_v) {
    return std::clamp(kp * error[axis] + kd * rate_[axis], -limit_v, limit_v);
  };
  auto translation = [&](int axis, const AxisGains& gains) {
    return volts(axis, gains.kp_v_per_m, gains.kd_v_s_per_m, gains.limit_v);
  };
  return {.surge_v = translation(0, params_.surge),
          .sway_v = translation(1, params_.sway),
          .heave_v = translation(2, params_.heave),
          .yaw_v = volts(3, params_.yaw.kp_v, params_.yaw.kd_v_s, params_.yaw.limit_v)};
}

void VisualServo::UpdateRate(int64_t frame, const Axes& measured) {
  TD_CHECK(!last_frame_ || frame > *last_frame_, "frames must increase");
  const int64_t frames = last_frame_ ? frame - *last_frame_ : 0;
  const double frame_s = clock_.frame_s();
  if (!last_frame_ || static_cast<double>(frames - 1) * frame_s > params_.rate_restart_s) {
    rate_.setZero();
  } else {
    const double gap_s = static_cast<double>(frames) * frame_s;
    // exact first-order filter for any gap; a time constant of 0 gives 1
    const double a = -std::expm1(-gap_s / params_.rate_filter_s);
    rate_ += a * ((measured - last_) / gap_s - rate_);
  }
  last_frame_ = frame;
  last_ = measured;
}

}  // namespace turbidock::control
