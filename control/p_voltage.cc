#include "control/p_voltage.h"

#include <algorithm>
#include <cmath>

namespace turbidock::control {
namespace {

double Limit(double volts, double limit_v) { return std::clamp(volts, -limit_v, limit_v); }

}  // namespace

PVoltage::PVoltage(const PVoltageParams& params) : params_(params) { CheckFields(params_, ""); }

void PVoltage::Observe(const Observation& seen) { position_ = seen.position; }

Axes PVoltage::Demand(const Reference& wanted) {
  const auto translation = [&](Axis axis, const PVoltageParams::Translation& gains) {
    return Limit(gains.kp_v_per_m * (position_[axis] - wanted.position[axis]), gains.limit_v);
  };
  const double error_eps3 = std::sin(position_[kYaw] / 2) - std::sin(wanted.position[kYaw] / 2);
  return {translation(kSurge, params_.surge), translation(kSway, params_.sway),
          translation(kHeave, params_.heave),
          Limit(params_.yaw.kp_v * error_eps3, params_.yaw.limit_v)};
}

}  // namespace turbidock::control
