#pragma once
// The linear model of the vehicle that the linear-quadratic controller is designed on.

#include <Eigen/Core>
#include <vector>

namespace turbidock::control {

// One axis; everything in SI units of the axis: kg, N and m, or kg m^2, N m and rad.
struct AxisModel {
  double inertia = 1;          // with the added mass
  double damping = 0;          // force per speed, linearised
  double lag_s = 0.1;          // of the thrusters, first order
  double current_std = 1;      // force of the current, a Gauss-Markov process
  double current_time_s = 60;  // its time constant
  double wave_std = 0;         // force of the waves, a resonance driven by white noise; 0: none
  double wave_period_s = 2.5;
  double wave_damping = 0.1;    // ratio: how broad the resonance is
  double disturbance_rate = 0;  // white acceleration, per root of Hz: what the model does not know
};

// States of an axis: position and speed of the vehicle along it, thrust, force of the current,
// force of the waves and its rate. Input: the force that is asked for, constant over a step.
// Measured: position.
enum AxisState { kPosition, kSpeed, kThrust, kCurrent, kWave, kWaveRate };
inline constexpr int kAxisStates = 6;

// Several axes one after the other in one state: x' = F x + G u + noise of intensity S.
struct LinearModel {
  Eigen::MatrixXd F, G, S;
};
// Axes that do not know of each other.
LinearModel MakeLinearModel(const std::vector<AxisModel>& axes);

// x+ = A x + B u + w over one step, w with covariance W.
struct DiscreteModel {
  Eigen::MatrixXd A, B, W;
};
// Exact for an input that is constant over the step; W by Van Loan's (1978) exponential.
DiscreteModel Discretise(const LinearModel& model, double dt_s);

}  // namespace turbidock::control
