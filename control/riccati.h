#pragma once
// The discrete algebraic Riccati equation, for regulators and (by duality) for Kalman filters.

#include <Eigen/Core>

namespace turbidock::control {

// The stabilising solution X >= 0 of
//
//   X = A' X A - A' X B (R + B' X B)^-1 B' X A + Q
//
// by the structure-preserving doubling algorithm (Chu, Fan, Lin and Wang 2004, Int. J. Control
// 77:767), which converges quadratically. Q is symmetric, positive semi-definite, R positive
// definite; (A, B) must be stabilisable and (A, Q) detectable. ConfigError when it does not
// converge.
Eigen::MatrixXd SolveRiccati(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                             const Eigen::MatrixXd& Q, const Eigen::MatrixXd& R);

// The gain K of the regulator u = -K x that minimises the sum of x' Q x + u' R u.
Eigen::MatrixXd RegulatorGain(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                              const Eigen::MatrixXd& Q, const Eigen::MatrixXd& R);

// The Kalman filter of x+ = A x + w, y = C x + v with covariances W and V, once it has settled.
struct SteadyKalman {
  Eigen::MatrixXd gain;        // x <- x + gain (y - C x)
  Eigen::MatrixXd prior;       // covariance before the measurement
  Eigen::MatrixXd innovation;  // covariance of y - C x
};
SteadyKalman SteadyKalmanFilter(const Eigen::MatrixXd& A, const Eigen::MatrixXd& C,
                                const Eigen::MatrixXd& W, const Eigen::MatrixXd& V);

}  // namespace turbidock::control
