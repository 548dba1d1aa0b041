#include "sim/vehicle/thrusters.h"

#include <algorithm>
#include <cmath>

namespace turbidock::vehicle {
namespace {

// Value at x of the polyline through (xs, ys), held constant beyond its ends.
double Interpolate(const std::vector<double>& xs, const std::vector<double>& ys, double x) {
  if (x <= xs.front()) return ys.front();
  if (x >= xs.back()) return ys.back();
  const size_t i = std::upper_bound(xs.begin(), xs.end(), x) - xs.begin();
  const double share = (x - xs[i - 1]) / (xs[i] - xs[i - 1]);
  return ys[i - 1] + share * (ys[i] - ys[i - 1]);
}

// Solution after dt of y' = (target - y) / tau with |y'| <= rate. A rate of 0 means no limit.
double LimitedLag(double y, double target, double tau_s, double rate, double dt_s) {
  const double error = target - y;
  if (rate > 0 && std::abs(error) > rate * tau_s) {
    // The limit holds until the error has come down to rate * tau.
    const double limited_s = (std::abs(error) - rate * tau_s) / rate;
    if (limited_s >= dt_s) return y + std::copysign(rate * dt_s, error);
    y = target - std::copysign(rate * tau_s, error);
    dt_s -= limited_s;
  }
  if (tau_s == 0) return target;
  return target + (y - target) * std::exp(-dt_s / tau_s);
}

}  // namespace

void ThrusterParams::Check(const std::string& path) const {
  const std::string key = JoinKey(path, "table_volts");
  if (table_volts.size() != table_thrust_newton.size())
    throw ConfigError(key, "has " + std::to_string(table_volts.size()) + " values but there are " +
                               std::to_string(table_thrust_newton.size()) + " thrusts");
  if (table_volts.empty()) return;
  if (table_volts.size() < 2) throw ConfigError(key, "needs at least two points");
  for (size_t i = 1; i < table_volts.size(); ++i) {
    if (table_volts[i] <= table_volts[i - 1]) throw ConfigError(key, "must increase");
    if (table_thrust_newton[i] < table_thrust_newton[i - 1])
      throw ConfigError(JoinKey(path, "table_thrust_newton"), "must not fall as the voltage rises");
  }
  const double at_neutral = Interpolate(table_volts, table_thrust_newton, kNeutralVolts);
  if (at_neutral != 0)
    throw ConfigError(
        key, "gives " + FormatNumber(at_neutral) + " N at the neutral voltage, must give none");
}

double StaticThrust(const ThrusterParams& params, double volts) {
  volts = std::clamp(volts, 0.0, kMaxVolts);
  if (!params.table_volts.empty())
    return Interpolate(params.table_volts, params.table_thrust_newton, volts);
  const double beyond = std::abs(volts - kNeutralVolts) - params.dead_band_volts;
  if (beyond <= 0) return 0;
  const double share = beyond / (kNeutralVolts - params.dead_band_volts);
  const double size = params.max_thrust_newton * std::pow(share, params.curve_exponent);
  return volts > kNeutralVolts ? size : -params.reverse_ratio * size;
}

void Thrusters::Reset() {
  lagged_newton_.fill(0);
  thrust_newton_.fill(0);
}

const ThrusterForces& Thrusters::Step(const ThrusterCommand& command,
                                      const ThrusterForces& inflow_mps, double dt_s,
                                      const ThrusterFactors& factors) {
  for (int i = 0; i < kThrusterCount; ++i) {
    const double volts = factors[i] < 0 ? 2 * kNeutralVolts - command.volts[i] : command.volts[i];
    const double target = StaticThrust(params_, volts);
    lagged_newton_[i] =
        LimitedLag(lagged_newton_[i], target, params_.lag_s, params_.rate_limit_newton_per_s, dt_s);
    // Running into its own jet's direction unloads the propeller; flow from behind gains nothing.
    const double advance_mps = std::max(0.0, std::copysign(1.0, lagged_newton_[i]) * inflow_mps[i]);
    const double left = std::max(0.0, 1 - params_.inflow_loss_s_per_m * advance_mps);
    thrust_newton_[i] = params_.effectiveness[i] * left * lagged_newton_[i] * std::abs(factors[i]);
  }
  return thrust_newton_;
}

}  // namespace turbidock::vehicle
