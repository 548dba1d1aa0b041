#include "control/thrust_allocation.h"

#include <algorithm>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::control {
namespace {

double Clamp(double x, double bound) { return std::clamp(x, -bound, bound); }

// The compensation takes its share of the range before the axes do.
double Bound(const AllocationParams& params) {
  return std::min(kNeutralVolts, kMaxVolts - kNeutralVolts) - params.dead_band_v;
}

}  // namespace

AxisVolts Attainable(const AllocationParams& params, const AxisVolts& axes) {
  TD_CHECK(axes.IsFinite(), "axis voltages must be finite");
  const double bound = Bound(params);
  const double yaw = Clamp(axes.yaw_v, bound);
  return {.surge_v = Clamp(axes.surge_v, bound - std::abs(yaw)),
          .sway_v = Clamp(axes.sway_v, bound),
          .heave_v = Clamp(axes.heave_v, bound),
          .yaw_v = yaw};
}

ThrusterCommand Allocate(const AllocationParams& params, const AxisVolts& axes) {
  const AxisVolts part = Attainable(params, axes);
  const double bound = Bound(params);
  const auto inverse_curve = [&](double demand) {
    return params.dead_band_v + bound * std::pow(demand / bound, 1 / params.curve_exponent);
  };
  const auto volts = [&](double demand) {
    const double size = std::abs(demand);
    const double voltage = size < params.ramp_v
                               ? size / params.ramp_v * inverse_curve(params.ramp_v)
                               : inverse_curve(size);
    return std::clamp(kNeutralVolts + std::copysign(voltage, demand), 0.0, kMaxVolts);
  };
  return {{volts(part.surge_v - part.yaw_v), volts(part.surge_v + part.yaw_v), volts(part.sway_v),
           volts(part.heave_v)}};
}

}  // namespace turbidock::control
