#include "sim/vehicle/thrusters.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace turbidock::vehicle {
namespace {

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

double SignedPower(double value, double power) {
  return power == 1 ? value : std::copysign(std::pow(std::abs(value), power), value);
}

}  // namespace

std::string Listed(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

std::vector<ThrusterKind> ThrusterParams::Of(const std::vector<std::string>& names,
                                             const std::string& path) const {
  if (names.empty()) return {};
  if (!effectiveness.empty() && effectiveness.size() != names.size())
    throw ConfigError(JoinKey(path, "effectiveness"),
                      "has " + std::to_string(effectiveness.size()) + " values, but there are " +
                          std::to_string(names.size()) + " thrusters: " + Listed(names));
  std::vector<ThrusterKind> kinds(names.size(), *this);
  std::vector<bool> given(names.size());
  for (size_t i = 0; i < individual.size(); ++i) {
    const std::string key = JoinKey(path, "individual[" + std::to_string(i) + "].thruster");
    const auto at = std::find(names.begin(), names.end(), individual[i].thruster);
    if (at == names.end())
      throw ConfigError(key, "'" + individual[i].thruster + "' is no thruster of the vehicle (" +
                                 Listed(names) + ")");
    const size_t thruster = at - names.begin();
    if (given[thruster]) throw ConfigError(key, "'" + individual[i].thruster + "' is given twice");
    given[thruster] = true;
    kinds[thruster] = individual[i];
  }
  for (const ThrusterKind& kind : kinds)
    if (kind.lag_power != 1 && kind.rate_limit_newton_per_s > 0)
      throw ConfigError(JoinKey(path, "lag_power"),
                        "must be 1 where the thrust's rate_limit_newton_per_s is above 0");
  return kinds;
}

PerThruster ThrusterParams::Effectiveness(size_t thrusters) const {
  if (effectiveness.empty()) return PerThruster(thrusters, 1.0);
  return {effectiveness.begin(), effectiveness.end()};
}

Thrusters::Thrusters(std::vector<ThrusterKind> kinds, const PerThruster& effectiveness)
    : kinds_(std::move(kinds)), effectiveness_(effectiveness) {
  TD_CHECK(kinds_.size() <= kMaxThrusters && effectiveness_.size() == kinds_.size(),
           "an effectiveness for each thruster");
  for (const ThrusterKind& kind : kinds_)
    longest_dead_time_s_ = std::max(longest_dead_time_s_, kind.dead_time_s);
  Reset();
}

void Thrusters::Reset() {
  now_s_ = 0;
  sent_.clear();
  lagged_.assign(kinds_.size(), 0);
  lagged_newton_.assign(kinds_.size(), 0);
  thrust_newton_.assign(kinds_.size(), 0);
}

PerThruster Thrusters::Heard(const PerThruster& volts, double dt_s) {
  if (longest_dead_time_s_ == 0) return volts;
  if (sent_.empty() || sent_.back().volts != volts) sent_.push_back({now_s_, volts});
  constexpr double kRounding_s = 1e-9;  // of a sum of steps
  const auto until = [&](double dead_time_s) { return now_s_ - dead_time_s + kRounding_s; };
  while (sent_.size() > 1 && sent_[1].at_s <= until(longest_dead_time_s_)) sent_.pop_front();
  PerThruster heard(kinds_.size(), kNeutralVolts);
  for (size_t i = 0; i < kinds_.size(); ++i)
    for (const Sent& sent : sent_)
      if (sent.at_s <= until(kinds_[i].dead_time_s)) heard[i] = sent.volts[i];
  now_s_ += dt_s;
  return heard;
}

const ThrusterForces& Thrusters::Step(const ThrusterCommand& command, const PerThruster& inflow_mps,
                                      double dt_s, const ThrusterFactors& factors) {
  TD_CHECK(command.volts.empty() || command.volts.size() == kinds_.size(),
           "a voltage for each thruster");
  const PerThruster heard = Heard(
      command.volts.empty() ? PerThruster(kinds_.size(), kNeutralVolts) : command.volts, dt_s);
  for (size_t i = 0; i < kinds_.size(); ++i) {
    const ThrusterKind& kind = kinds_[i];
    const double factor = factors.empty() ? 1 : factors[i];
    const double volts = factor < 0 ? 2 * kNeutralVolts - heard[i] : heard[i];
    const double target = SignedPower(kind.Thrust(volts), 1 / kind.lag_power);
    lagged_[i] = LimitedLag(lagged_[i], target, kind.lag_s, kind.rate_limit_newton_per_s, dt_s);
    lagged_newton_[i] = SignedPower(lagged_[i], kind.lag_power);
    // Running into its own jet's direction unloads the propeller; flow from behind gains nothing.
    const double advance_mps = std::max(0.0, std::copysign(1.0, lagged_newton_[i]) * inflow_mps[i]);
    const double left = std::max(0.0, 1 - kind.inflow_loss_s_per_m * advance_mps);
    thrust_newton_[i] = effectiveness_[i] * left * lagged_newton_[i] * std::abs(factor);
  }
  return thrust_newton_;
}

}  // namespace turbidock::vehicle
