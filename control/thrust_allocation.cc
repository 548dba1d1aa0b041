#include "control/thrust_allocation.h"

#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::control {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::array kPublishedThrusters = {"surge_left", "surge_right", "sway", "heave"};
constexpr std::array kAxisNames = {"surge", "sway", "heave", "yaw"};
// What is kept first where there is not enough for all.
constexpr std::array kPriority = {kYaw, kHeave, kSway, kSurge};

// Force and moment about B's origin of a unit of thrust of each: surge, sway, heave, roll, pitch,
// yaw by row.
MatrixXd Wrenches(const std::vector<ThrusterModel>& thrusters) {
  MatrixXd wrenches(6, std::ssize(thrusters));
  for (Eigen::Index i = 0; i < wrenches.cols(); ++i) {
    const ThrusterModel& t = thrusters[static_cast<size_t>(i)];
    wrenches.col(i) << t.axis_B, t.p_BT.cross(t.axis_B);
  }
  return wrenches;
}

MatrixXd PseudoInverse(const MatrixXd& A) {
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition;
  decomposition.setThreshold(1e-9);
  return decomposition.compute(A).pseudoInverse();
}

// Thrust of each for a unit of demand on each axis (n x 4), and of a levelling moment (n x 2; 0
// where there is none to give), for thrusters of these strengths; 0 of those without any.
struct Sharing {
  MatrixXd per_demand, per_level;
};
Sharing SharingOf(const std::vector<ThrusterModel>& thrusters, const VectorXd& strength) {
  // Columns in shares of full thrust; roll and pitch apart.
  const MatrixXd all = Wrenches(thrusters) * strength.asDiagonal();
  MatrixXd wanted(kAxisCount, all.cols()), unwanted(2, all.cols());
  wanted << all.topRows(3), all.row(5);
  unwanted << all.middleRows(3, 2);
  MatrixXd shares = PseudoInverse(wanted);
  // What changes nothing on the four axes is free to level the vehicle.
  const MatrixXd free = MatrixXd::Identity(all.cols(), all.cols()) - shares * wanted;
  // Angles of six digits leave a millionth of a moment: that is none.
  MatrixXd moments_left = unwanted * free;
  for (Eigen::Index i = 0; i < 2; ++i)
    if (moments_left.row(i).norm() < 1e-3 * unwanted.row(i).norm()) moments_left.row(i).setZero();
  MatrixXd level = free * PseudoInverse(moments_left);
  shares -= level * unwanted * shares;
  const MatrixXd moments = unwanted * level;
  for (Eigen::Index axis = 0; axis < 2; ++axis)
    if (!moments.col(axis).isApprox(VectorXd::Unit(2, axis), 1e-6)) level.col(axis).setZero();
  return {strength.asDiagonal() * shares, strength.asDiagonal() * level};
}

// Largest share of `step` (by thruster) that keeps start + share * step within the limits.
template <class Step>
double LargestShare(const PerThruster& start, const Step& step, const PerThruster& least,
                    const PerThruster& most) {
  double share = 1;
  for (size_t i = 0; i < start.size(); ++i) {
    const double by = step[static_cast<Eigen::Index>(i)];
    if (by > 0) share = std::min(share, std::max(0.0, most[i] - start[i]) / by);
    if (by < 0) share = std::min(share, std::min(0.0, least[i] - start[i]) / by);
  }
  return share;
}

double Clamp(double x, double bound) { return std::clamp(x, -bound, bound); }

// The compensation takes its share of the range before the axes do.
double Bound(const VoltsAllocationParams& params) {
  return std::min(kNeutralVolts, kMaxVolts - kNeutralVolts) - params.dead_band_v;
}

}  // namespace

ForceAllocation::ForceAllocation(const ForceAllocationParams& params, const VehicleModel& vehicle,
                                 bool may_lack_axes)
    : params_(params), thrusters_(vehicle.thrusters) {
  CheckFields(params_, "allocation");
  const auto count = std::ssize(thrusters_);
  TD_CHECK(count <= kMaxThrusters, "at most 16 thrusters");
  VectorXd sound(count), left(count);
  PerThruster sound_least, sound_most;
  for (Eigen::Index i = 0; i < count; ++i) {
    const ThrusterModel& t = thrusters_[static_cast<size_t>(i)];
    sound_least.push_back(t.curve.FullReverse());
    sound_most.push_back(t.curve.FullForward());
    least_newton_.push_back(t.effectiveness * t.curve.FullReverse());
    most_newton_.push_back(t.effectiveness * t.curve.FullForward());
    sound[i] = (t.curve.FullForward() - t.curve.FullReverse()) / 2;
    left[i] = t.effectiveness * sound[i];
  }
  const MatrixXd wrenches = Wrenches(thrusters_);
  const MatrixXd of_sound = SharingOf(thrusters_, sound).per_demand;
  const Sharing of_left = SharingOf(thrusters_, left);
  thrust_per_demand_ = of_left.per_demand;
  thrust_per_level_ = of_left.per_level;
  constexpr std::array<Eigen::Index, kAxisCount> kRows = {0, 1, 2, 5};
  const PerThruster still(thrusters_.size(), 0.0);
  for (Eigen::Index axis = 0; axis < kAxisCount; ++axis) {
    const auto at = static_cast<size_t>(axis);
    const auto reached = [&](const MatrixXd& thrust) {
      return std::abs(wrenches.row(kRows[at]).dot(thrust.col(axis)) - 1) < 1e-6;
    };
    if (!reached(of_sound) && !may_lack_axes)
      throw ConfigError("the vehicle's thrusters cannot push along " + std::string(kAxisNames[at]) +
                        " by itself, which docking needs");
    reached_[at] = reached(thrust_per_demand_);
    if (!reached(of_sound)) continue;
    // A long step, of which as much is possible as the first limit allows.
    const double long_step = 1e6;
    most_[axis] =
        long_step * LargestShare(still, long_step * of_sound.col(axis), sound_least, sound_most);
    most_back_[axis] =
        -long_step * LargestShare(still, -long_step * of_sound.col(axis), sound_least, sound_most);
  }
}

Allocated ForceAllocation::Share(const Axes& demand, const RollPitch& level) const {
  TD_CHECK(demand.allFinite() && level.allFinite(), "a demand must be finite");
  Allocated allocated;
  PerThruster thrust(thrusters_.size(), 0.0);
  const auto add = [&](const auto& step) {
    const double share = LargestShare(thrust, step, least_newton_, most_newton_);
    for (size_t i = 0; i < thrust.size(); ++i)
      thrust[i] += share * step[static_cast<Eigen::Index>(i)];
    return share;
  };
  if (!level.isZero(0)) add(thrust_per_level_ * level);
  for (const Axis axis : kPriority)
    if (reached_[axis])
      allocated.given[axis] = add(demand[axis] * thrust_per_demand_.col(axis)) * demand[axis];
  allocated.command = CommandOf(thrust);
  return allocated;
}

ThrusterCommand ForceAllocation::CommandOf(const PerThruster& thrust_newton) const {
  ThrusterCommand command;
  for (size_t i = 0; i < thrust_newton.size(); ++i)
    command.volts.push_back(Volts(i, thrust_newton[i]));
  return command;
}

Axes ForceAllocation::GivenBy(const ThrusterCommand& command) const {
  VectorXd thrust(std::ssize(thrusters_));
  for (size_t i = 0; i < thrusters_.size(); ++i)
    thrust[static_cast<Eigen::Index>(i)] =
        thrusters_[i].effectiveness * thrusters_[i].curve.Thrust(command.volts[i]);
  const VectorXd wrench = Wrenches(thrusters_) * thrust;
  return {wrench[0], wrench[1], wrench[2], wrench[5]};
}

double ForceAllocation::Volts(size_t thruster, double thrust_newton) const {
  const auto& [name, p_BT, axis_B, curve, effectiveness] = thrusters_[thruster];
  if (effectiveness == 0) return kNeutralVolts;
  const double wanted = thrust_newton / effectiveness;
  const double ramp = params_.ramp_share * (wanted > 0 ? curve.FullForward() : curve.FullReverse());
  if (std::abs(wanted) >= std::abs(ramp)) return curve.Volts(wanted);
  return kNeutralVolts + wanted / ramp * (curve.Volts(ramp) - kNeutralVolts);
}

// ------------------------------------------------------------------------------------------------

AxisVolts Attainable(const VoltsAllocationParams& params, const AxisVolts& axes) {
  TD_CHECK(axes.IsFinite(), "axis voltages must be finite");
  const double bound = Bound(params);
  const double yaw = Clamp(axes.yaw_v, bound);
  return {.surge_v = Clamp(axes.surge_v, bound - std::abs(yaw)),
          .sway_v = Clamp(axes.sway_v, bound),
          .heave_v = Clamp(axes.heave_v, bound),
          .yaw_v = yaw};
}

ThrusterCommand Allocate(const VoltsAllocationParams& params, const AxisVolts& axes) {
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

VoltsAllocation::VoltsAllocation(const VoltsAllocationParams& params, const VehicleModel& vehicle)
    : params_(params) {
  CheckFields(params_, "allocation");
  std::string names;
  bool are_published = vehicle.thrusters.size() == kPublishedThrusters.size();
  for (size_t i = 0; i < vehicle.thrusters.size(); ++i) {
    const std::string& name = vehicle.thrusters[i].name;
    names += (i > 0 ? ", " : "") + name;
    are_published = are_published && name == kPublishedThrusters[i];
  }
  if (!are_published)
    throw ConfigError("control.use",
                      fmt::format("p_voltage asks for the voltages of the published vehicle's "
                                  "thrusters ({}); this one has {}. pid and lqg ask for forces",
                                  fmt::join(kPublishedThrusters, ", "), names));
}

Allocated VoltsAllocation::Share(const Axes& demand, const RollPitch&) const {
  const AxisVolts part = Attainable(params_, ToAxisVolts(demand));
  return {.given = ToAxes(part), .command = Allocate(params_, part)};
}

}  // namespace turbidock::control
