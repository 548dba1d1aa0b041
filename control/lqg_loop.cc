#include "control/lqg_loop.h"

#include <algorithm>
#include <cmath>

#include "control/riccati.h"
#include "sim/base/check.h"

namespace turbidock::control {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

LqgLoop::LqgLoop(const std::vector<LqgAxis>& axes, const std::vector<double>& levers, double dt_s)
    : axes_(axes) {
  TD_CHECK(!axes.empty() && axes.size() <= 2 && !levers.empty(), "one axis or two, and a lever");
  TD_CHECK(std::is_sorted(levers.begin(), levers.end()), "levers must increase");
  const auto count = static_cast<Index>(axes.size()), n = kAxisStates * count;
  state_ = ahead_ = low_ = high_ = VectorXd::Zero(n);
  innovation_ = force_ = VectorXd::Zero(count);
  gains_.reserve(levers.size());
  for (const double lever : levers) gains_.push_back(Design(lever, dt_s));
}

LqgLoop::Gains LqgLoop::Design(double lever, double dt_s) const {
  const auto count = static_cast<Index>(axes_.size()), n = kAxisStates * count;
  std::vector<AxisModel> models;
  for (const LqgAxis& axis : axes_) models.push_back(axis.model);
  LinearModel model = MakeLinearModel(models);
  if (count == 2) model.F(kPosition, kAxisStates + kSpeed) = lever;
  const DiscreteModel discrete = Discretise(model, dt_s);

  // Effort is counted from the force that stands still: u = u' - E x.
  MatrixXd E = MatrixXd::Zero(count, n), C = MatrixXd::Zero(count, n);
  MatrixXd Q = MatrixXd::Zero(n, n), R = MatrixXd::Zero(count, count);
  MatrixXd V = MatrixXd::Zero(count, count);
  for (Index i = 0; i < count; ++i) {
    const LqgAxis& axis = axes_[static_cast<size_t>(i)];
    const Index at = kAxisStates * i;
    E(i, at + kCurrent) = E(i, at + kWave) = 1;
    E(i, at + kWaveRate) = axis.model.lag_s;
    C(i, at + kPosition) = 1;
    Q(at + kPosition, at + kPosition) = 1 / (axis.error * axis.error);
    Q(at + kSpeed, at + kSpeed) = 1 / (axis.speed * axis.speed);
    R(i, i) = 1 / (axis.effort * axis.effort);
    V(i, i) = axis.noise * axis.noise;
  }
  const SteadyKalman filter = SteadyKalmanFilter(discrete.A, C, discrete.W, V);
  return {.lever = lever,
          .A = discrete.A,
          .B = discrete.B,
          .regulator = RegulatorGain(discrete.A - discrete.B * E, discrete.B, Q, R) + E,
          .kalman = filter.gain,
          .innovation_std = filter.innovation.diagonal().cwiseSqrt()};
}

LqgLoop::Between LqgLoop::At(double lever) const {
  const auto above = std::find_if(gains_.begin(), gains_.end(),
                                  [&](const Gains& gains) { return gains.lever >= lever; });
  if (above == gains_.begin()) return {&gains_.front(), &gains_.front(), 0};
  if (above == gains_.end()) return {&gains_.back(), &gains_.back(), 0};
  const Gains& low = *(above - 1);
  return {&low, &*above, (lever - low.lever) / (above->lever - low.lever)};
}

void LqgLoop::Start(const VectorXd& position) {
  for (Index i = 0; i < position.size(); ++i) {
    auto axis = state_.segment<kAxisStates>(kAxisStates * i);
    const double current = axis[kCurrent];
    axis.setZero();
    axis[kPosition] = position[i];
    axis[kCurrent] = current;
  }
}

void LqgLoop::Step(const VectorXd& force, double lever, VectorXd* state) {
  // exact: the lever enters the transition linearly
  const Between at = At(lever);
  low_.noalias() = at.low->A * *state;
  low_.noalias() += at.low->B * force;
  if (at.share > 0) {
    high_.noalias() = at.high->A * *state;
    high_.noalias() += at.high->B * force;
    low_ += at.share * (high_ - low_);
  }
  state->swap(low_);
}

void LqgLoop::Predict(const VectorXd& force, double lever) { Step(force, lever, &state_); }

void LqgLoop::Ahead(const VectorXd& force, double lever) { Step(force, lever, &ahead_); }

double LqgLoop::Surprise(const VectorXd& position, double lever) {
  const Gains& gains = *At(lever).low;
  double most = 0;
  for (Index i = 0; i < position.size(); ++i)
    most = std::max(most, std::abs(position[i] - this->position(i)) / gains.innovation_std[i]);
  return most;
}

void LqgLoop::Correct(const VectorXd& position, double lever) {
  const Between at = At(lever);
  for (Index i = 0; i < position.size(); ++i) innovation_[i] = position[i] - this->position(i);
  low_.noalias() = at.low->kalman * innovation_;
  high_.noalias() = at.high->kalman * innovation_;
  state_ += low_ + at.share * (high_ - low_);
}

const VectorXd& LqgLoop::Demand(const VectorXd& position, const VectorXd& speed,
                                const VectorXd& acceleration, double lever) {
  const Between at = At(lever);
  const Index count = position.size();
  // What is left of the state once the wanted motion is taken away.
  for (Index i = 0; i < count; ++i) {
    const AxisModel& m = axes_[static_cast<size_t>(i)].model;
    const bool turned = i == 0 && count == 2;
    const double own_speed = speed[i] - (turned ? lever * speed[1] : 0);
    const double own_acceleration = acceleration[i] - (turned ? lever * acceleration[1] : 0);
    const double thrust = m.inertia * own_acceleration + m.damping * own_speed;
    auto axis = ahead_.segment<kAxisStates>(kAxisStates * i);
    axis[kPosition] -= position[i];
    axis[kSpeed] -= own_speed;
    axis[kThrust] -= thrust;
    innovation_[i] = thrust;
  }
  low_.head(count).noalias() = at.low->regulator * ahead_;
  high_.head(count).noalias() = at.high->regulator * ahead_;
  for (Index i = 0; i < count; ++i) {
    const LqgAxis& axis = axes_[static_cast<size_t>(i)];
    force_[i] = std::clamp(innovation_[i] - low_[i] - at.share * (high_[i] - low_[i]), axis.least,
                           axis.most);
  }
  return force_;
}

}  // namespace turbidock::control
