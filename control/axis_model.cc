#include "control/axis_model.h"

#include <cmath>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>

#include "sim/base/check.h"

namespace turbidock::control {

using Eigen::MatrixXd;

LinearModel MakeLinearModel(const std::vector<AxisModel>& axes) {
  const auto count = static_cast<Eigen::Index>(axes.size());
  const Eigen::Index n = kAxisStates * count;
  LinearModel model{MatrixXd::Zero(n, n), MatrixXd::Zero(n, count), MatrixXd::Zero(n, n)};
  for (Eigen::Index axis = 0; axis < count; ++axis) {
    const AxisModel& m = axes[static_cast<size_t>(axis)];
    TD_CHECK(m.inertia > 0 && m.lag_s > 0 && m.current_time_s > 0 && m.wave_period_s > 0,
             "an axis must have inertia and time constants");
    const double omega = 2 * std::numbers::pi / m.wave_period_s;
    auto F = model.F.block<kAxisStates, kAxisStates>(kAxisStates * axis, kAxisStates * axis);
    F(kPosition, kSpeed) = 1;
    F(kSpeed, kSpeed) = -m.damping / m.inertia;
    F(kSpeed, kThrust) = F(kSpeed, kCurrent) = F(kSpeed, kWave) = 1 / m.inertia;
    F(kThrust, kThrust) = -1 / m.lag_s;
    F(kCurrent, kCurrent) = -1 / m.current_time_s;
    F(kWave, kWaveRate) = 1;
    F(kWaveRate, kWave) = -omega * omega;
    F(kWaveRate, kWaveRate) = -2 * m.wave_damping * omega;
    model.G(kAxisStates * axis + kThrust, axis) = 1 / m.lag_s;
    // Intensities that give the Gauss-Markov process and the resonance their variances.
    auto S = model.S.block<kAxisStates, kAxisStates>(kAxisStates * axis, kAxisStates * axis);
    S(kSpeed, kSpeed) = m.disturbance_rate * m.disturbance_rate;
    S(kCurrent, kCurrent) = 2 * m.current_std * m.current_std / m.current_time_s;
    S(kWaveRate, kWaveRate) = 4 * m.wave_damping * std::pow(omega, 3) * m.wave_std * m.wave_std;
  }
  return model;
}

DiscreteModel Discretise(const LinearModel& model, double dt_s) {
  TD_CHECK(dt_s > 0, "a step takes time");
  const Eigen::Index n = model.F.rows(), inputs = model.G.cols();
  MatrixXd with_input = MatrixXd::Zero(n + inputs, n + inputs);
  with_input.topLeftCorner(n, n) = model.F * dt_s;
  with_input.topRightCorner(n, inputs) = model.G * dt_s;
  const MatrixXd transition = with_input.exp();

  MatrixXd loan = MatrixXd::Zero(2 * n, 2 * n);
  loan.topLeftCorner(n, n) = -model.F * dt_s;
  loan.topRightCorner(n, n) = model.S * dt_s;
  loan.bottomRightCorner(n, n) = model.F.transpose() * dt_s;
  const MatrixXd loan_exp = loan.exp();

  DiscreteModel discrete;
  discrete.A = transition.topLeftCorner(n, n);
  discrete.B = transition.topRightCorner(n, inputs);
  const MatrixXd W = discrete.A * loan_exp.topRightCorner(n, n);
  discrete.W = (W + W.transpose()) / 2;
  return discrete;
}

}  // namespace turbidock::control
