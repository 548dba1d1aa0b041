#include "control/riccati.h"

#include <Eigen/LU>

#include "sim/base/check.h"

namespace turbidock::control {
namespace {

using Eigen::MatrixXd;

// Each iteration doubles the horizon: 2^60 steps are for ever.
constexpr int kMaxDoublings = 60;
constexpr double kConverged = 1e-14;  // relative change; a few roundings

MatrixXd Symmetric(const MatrixXd& X) { return (X + X.transpose()) / 2; }

}  // namespace

MatrixXd SolveRiccati(const MatrixXd& A, const MatrixXd& B, const MatrixXd& Q, const MatrixXd& R) {
  const Eigen::Index n = A.rows();
  TD_CHECK(A.cols() == n && B.rows() == n && Q.rows() == n && Q.cols() == n &&
               R.rows() == B.cols() && R.cols() == B.cols(),
           "matrices of a Riccati equation must fit each other");
  MatrixXd A_k = A, X = Q;
  MatrixXd G = Symmetric(B * R.partialPivLu().solve(B.transpose()));
  for (int k = 0; k < kMaxDoublings; ++k) {
    const Eigen::PartialPivLU<MatrixXd> lu(MatrixXd::Identity(n, n) + G * X);
    const MatrixXd W_A = lu.solve(A_k);
    const MatrixXd next_G = Symmetric(G + A_k * lu.solve(G) * A_k.transpose());
    const MatrixXd added = Symmetric(A_k.transpose() * X * W_A);
    A_k = A_k * W_A;
    G = next_G;
    X += added;
    if (!X.allFinite()) break;
    // not the Frobenius norm, which overflows long before a diverging X does
    if (added.lpNorm<Eigen::Infinity>() <= kConverged * X.lpNorm<Eigen::Infinity>()) return X;
  }
  throw ConfigError("",
                    "the Riccati equation has no stabilising solution; the model cannot be "
                    "controlled or observed");
}

MatrixXd RegulatorGain(const MatrixXd& A, const MatrixXd& B, const MatrixXd& Q, const MatrixXd& R) {
  const MatrixXd X = SolveRiccati(A, B, Q, R);
  return (R + B.transpose() * X * B).partialPivLu().solve(B.transpose() * X * A);
}

SteadyKalman SteadyKalmanFilter(const MatrixXd& A, const MatrixXd& C, const MatrixXd& W,
                                const MatrixXd& V) {
  SteadyKalman filter;
  filter.prior = SolveRiccati(A.transpose(), C.transpose(), W, V);
  filter.innovation = C * filter.prior * C.transpose() + V;
  filter.gain = filter.prior * C.transpose() * filter.innovation.partialPivLu().inverse();
  return filter;
}

}  // namespace turbidock::control
