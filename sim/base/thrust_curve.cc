#include "sim/base/thrust_curve.h"

#include <algorithm>
#include <cmath>

namespace turbidock {
namespace {

// Value at x of the polyline through (xs, ys), held constant beyond its ends.
double Interpolate(const std::vector<double>& xs, const std::vector<double>& ys, double x) {
  if (x <= xs.front()) return ys.front();
  if (x >= xs.back()) return ys.back();
  const size_t i = std::upper_bound(xs.begin(), xs.end(), x) - xs.begin();
  const double share = (x - xs[i - 1]) / (xs[i] - xs[i - 1]);
  return ys[i - 1] + share * (ys[i] - ys[i - 1]);
}

// Where the never falling polyline through (xs, ys) comes to y > 0 (from below, for the first time)
// or to y < 0 (from above, likewise); the end of xs where it does not.
double Reach(const std::vector<double>& xs, const std::vector<double>& ys, double y) {
  if (y >= ys.back()) y = ys.back();
  if (y <= ys.front()) y = ys.front();
  const auto at =
      y > 0 ? std::lower_bound(ys.begin(), ys.end(), y) : std::upper_bound(ys.begin(), ys.end(), y);
  if (at == ys.begin()) return xs.front();
  if (at == ys.end()) return xs.back();
  const size_t i = at - ys.begin();
  return xs[i - 1] + (y - ys[i - 1]) / (ys[i] - ys[i - 1]) * (xs[i] - xs[i - 1]);
}

}  // namespace

void ThrustCurve::Check(const std::string& path) const {
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

double ThrustCurve::Thrust(double volts) const {
  volts = std::clamp(volts, 0.0, kMaxVolts);
  if (!table_volts.empty()) return Interpolate(table_volts, table_thrust_newton, volts);
  const double beyond = std::abs(volts - kNeutralVolts) - dead_band_volts;
  if (beyond <= 0) return 0;
  const double share = beyond / (kNeutralVolts - dead_band_volts);
  const double size = max_thrust_newton * std::pow(share, curve_exponent);
  return volts > kNeutralVolts ? size : -reverse_ratio * size;
}

double ThrustCurve::Volts(double thrust_newton) const {
  if (thrust_newton == 0) return kNeutralVolts;
  if (!table_volts.empty())
    return std::clamp(Reach(table_volts, table_thrust_newton, thrust_newton), 0.0, kMaxVolts);
  const double most = thrust_newton > 0 ? FullForward() : FullReverse();
  if (most == 0) return kNeutralVolts;
  const double share = std::min(1.0, thrust_newton / most);
  const double beyond = (kNeutralVolts - dead_band_volts) * std::pow(share, 1 / curve_exponent);
  return kNeutralVolts + std::copysign(dead_band_volts + beyond, thrust_newton);
}

}  // namespace turbidock
