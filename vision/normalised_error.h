#pragma once
// How far an estimate is off the truth by what it claims itself.

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <optional>

#include "sim/base/pose_estimate.h"

namespace turbidock::vision {

// The squared error of a detected estimate by its covariance: chi-squared of six degrees of freedom
// where the covariance is right, 6 on average. Nothing where the estimate claims nothing.
inline std::optional<double> NormalisedError2(const PoseEstimate& estimate, const Pose& true_X_HM) {
  if (!estimate.detected || !estimate.covariance) return std::nullopt;
  const Eigen::AngleAxisd turn(estimate.X_HM.q * true_X_HM.q.conjugate());
  Eigen::Matrix<double, 6, 1> error;
  error << estimate.X_HM.p - true_X_HM.p, turn.angle() * turn.axis();
  return error.dot(estimate.covariance->ldlt().solve(error));
}

// What it is below in 99.73 %, as is within three standard deviations what has one dimension.
inline constexpr double kThreeSigma2 = 20.06;

}  // namespace turbidock::vision
