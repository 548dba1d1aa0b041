#include "control/setpoint.h"

#include <algorithm>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::control {

Setpoint::Setpoint(const SetpointParams& params, const ClockParams& clock)
    : params_(params), clock_(clock) {
  CheckFields(params_, "");
}

const Reference& Setpoint::Lead(int64_t frame, const Axes& desired, const Axes& seen) {
  TD_CHECK(!last_frame_ || frame > *last_frame_, "frames must increase");
  if (!params_.enabled) {
    reference_ = {.position = desired};
  } else if (!last_frame_) {
    reference_ = {.position = seen};
  } else {
    // the heading by the shorter way round
    const Axes goal = reference_.position + Difference(desired, reference_.position);
    for (int64_t f = *last_frame_; f < frame; ++f)
      for (int axis = 0; axis < kAxisCount; ++axis) Step(axis, goal[axis]);
    reference_.position[kYaw] = WrapAngle(reference_.position[kYaw]);
  }
  last_frame_ = frame;
  return reference_;
}

void Setpoint::Step(int axis, double goal) {
  const double dt_s = clock_.frame_s();
  const double most_change = params_.acceleration[axis] * dt_s;
  double& position = reference_.position[axis];
  double& rate = reference_.rate[axis];
  const double left = goal - position;
  // the last step: one that ends at the goal at rest within the limits
  if (std::abs(left) <= most_change * dt_s && std::abs(rate) <= 2 * most_change) {
    reference_.acceleration[axis] = -rate / dt_s;
    position = goal;
    rate = 0;
    return;
  }
  // The speed from which it can still stop in whole steps: v^2 + v a dt = 2 a |left|.
  const double a_dt = most_change;
  const double stop =
      (std::sqrt(a_dt * a_dt + 8 * params_.acceleration[axis] * std::abs(left)) - a_dt) / 2;
  const double wanted = std::copysign(std::min(params_.speed[axis], stop), left);
  const double change = std::clamp(wanted - rate, -most_change, most_change);
  reference_.acceleration[axis] = change / dt_s;
  rate += change;
  position += rate * dt_s;
}

}  // namespace turbidock::control
