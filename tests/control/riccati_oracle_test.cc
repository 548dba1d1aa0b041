// The Riccati solver and what is designed with it, against closed forms.

#include "control/riccati.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

#include "control/axis_model.h"
#include "sim/base/check.h"
#include "sim/base/random.h"

namespace turbidock::control {
namespace {

using Eigen::MatrixXd;

MatrixXd Scalar(double x) { return MatrixXd::Constant(1, 1, x); }

// For scalars the equation is b^2 x^2 - (b^2 q - r (1 - a^2)) x - q r = 0; its positive root.
TEST(Riccati, ScalarCasesInClosedForm) {
  for (const double a : {0.0, 0.3, 0.999, 1.0, 1.5, -2.0})
    for (const double b : {0.01, 1.0, 7.0})
      for (const double q : {1e-3, 1.0, 50.0})
        for (const double r : {1e-2, 1.0, 20.0}) {
          const double p = b * b * q - r * (1 - a * a);
          const double s = std::sqrt(p * p + 4 * b * b * q * r);
          const double x = p > 0 ? (p + s) / (2 * b * b) : 2 * q * r / (s - p);  // no cancellation
          const double solved = SolveRiccati(Scalar(a), Scalar(b), Scalar(q), Scalar(r))(0, 0);
          EXPECT_NEAR(solved, x, 1e-12 * x) << a << ' ' << b << ' ' << q << ' ' << r;
          EXPECT_NEAR(RegulatorGain(Scalar(a), Scalar(b), Scalar(q), Scalar(r))(0, 0),
                      a * b * x / (r + b * b * x), 1e-12 * (1 + std::abs(a / b)));
        }
}

// The golden ratio: a = b = q = r = 1.
TEST(Riccati, AnIntegratorWithUnitCostsHasTheGoldenRatio) {
  EXPECT_NEAR(SolveRiccati(Scalar(1), Scalar(1), Scalar(1), Scalar(1))(0, 0),
              (1 + std::sqrt(5.0)) / 2, 1e-14);
}

TEST(Riccati, FulfilsTheEquationAndStabilises) {
  Rng rng = SeedTree(5).Stream("riccati");
  const auto random = [&](Eigen::Index rows, Eigen::Index cols) {
    MatrixXd X(rows, cols);
    for (double& x : X.reshaped()) x = rng.Normal();
    return X;
  };
  for (int n = 1; n <= 12; ++n) {
    const MatrixXd A = random(n, n), B = random(n, 2), H = random(n, n), G = random(2, 2);
    const MatrixXd Q = H * H.transpose(), R = G * G.transpose() + MatrixXd::Identity(2, 2);
    const MatrixXd X = SolveRiccati(A, B, Q, R);
    const MatrixXd K = RegulatorGain(A, B, Q, R);
    const MatrixXd residual = A.transpose() * X * A - A.transpose() * X * B * K + Q - X;
    EXPECT_LT(residual.norm(), 1e-8 * X.norm()) << n;
    EXPECT_LT((A - B * K).eigenvalues().cwiseAbs().maxCoeff(), 1) << n;
  }
}

// Costs in other units: X scales with Q and R.
TEST(Riccati, ScalesWithItsCosts) {
  MatrixXd A = MatrixXd::Identity(2, 2), B = MatrixXd::Zero(2, 1);
  A(0, 1) = B(1, 0) = 0.03;
  A(1, 1) = 0.97;
  const MatrixXd Q = MatrixXd::Identity(2, 2), R = Scalar(0.1);
  const MatrixXd X = SolveRiccati(A, B, Q, R);
  for (const double unit : {1e-9, 1e-4, 1e4, 1e9})
    EXPECT_LT((SolveRiccati(A, B, unit * Q, unit * R) / unit - X).norm(), 1e-10 * X.norm()) << unit;
}

// The other route: the equation iterated as the recursion over a finite horizon.
TEST(Riccati, IsTheLimitOfTheFiniteHorizon) {
  const DiscreteModel model =
      Discretise(MakeLinearModel({{.inertia = 25, .damping = 24, .wave_std = 2}}), 1 / 30.0);
  MatrixXd Q = MatrixXd::Zero(6, 6);
  Q(kPosition, kPosition) = 1e4;
  Q(kSpeed, kSpeed) = 100;
  const MatrixXd R = Scalar(3);
  MatrixXd X = Q;
  for (int k = 0; k < 20000; ++k) {
    const MatrixXd B_X = model.B.transpose() * X;
    X = Q + model.A.transpose() * X * model.A -
        model.A.transpose() * B_X.transpose() * (R + B_X * model.B).inverse() * B_X * model.A;
    X = (X + X.transpose()) / 2;
  }
  const MatrixXd solved = SolveRiccati(model.A, model.B, Q, R);
  EXPECT_LT((solved - X).norm(), 1e-7 * X.norm());
}

// Position and speed driven by white acceleration, position measured: the steady gains alpha and
// beta follow from the tracking index alone (Kalata 1984, IEEE TAES 20:174).
TEST(Kalman, ConstantVelocityFilterHasKalatasGains) {
  for (const double index : {0.01, 0.1, 0.5, 2.0}) {
    constexpr double kStep_s = 0.1, kNoise = 0.3;
    const double acceleration = index * kNoise / (kStep_s * kStep_s);
    MatrixXd A(2, 2), C(1, 2), g(2, 1);
    A << 1, kStep_s, 0, 1;
    C << 1, 0;
    g << kStep_s * kStep_s / 2, kStep_s;
    const SteadyKalman filter = SteadyKalmanFilter(
        A, C, acceleration * acceleration * g * g.transpose(), Scalar(kNoise * kNoise));
    const double r = (4 + index - std::sqrt(8 * index + index * index)) / 4;
    const double alpha = 1 - r * r, beta = 2 * (2 - alpha) - 4 * std::sqrt(1 - alpha);
    EXPECT_NEAR(filter.gain(0, 0), alpha, 1e-9) << index;
    EXPECT_NEAR(filter.gain(1, 0), beta / kStep_s, 1e-8) << index;
    EXPECT_NEAR(filter.innovation(0, 0), kNoise * kNoise / (1 - alpha), 1e-9) << index;
  }
}

TEST(Riccati, WhatCannotBeControlledIsSaid) {
  // an unstable state without an input
  EXPECT_THROW(SolveRiccati(Scalar(1.1), Scalar(0), Scalar(1), Scalar(1)), ConfigError);
}

TEST(AxisModel, OneAxisInClosedForm) {
  // Without damping and with a thruster as slow as that: speed and position under a constant force.
  const AxisModel axis{.inertia = 4, .damping = 0, .lag_s = 1e9, .current_time_s = 1e12};
  const DiscreteModel model = Discretise(MakeLinearModel({axis}), 0.5);
  EXPECT_NEAR(model.A(kPosition, kSpeed), 0.5, 1e-12);
  EXPECT_NEAR(model.A(kSpeed, kCurrent), 0.5 / 4, 1e-12);
  EXPECT_NEAR(model.A(kPosition, kCurrent), 0.5 * 0.5 / 2 / 4, 1e-12);
  // Damping and lag: exponentials.
  const AxisModel damped{.inertia = 2, .damping = 3, .lag_s = 0.2};
  const DiscreteModel slow = Discretise(MakeLinearModel({damped}), 0.1);
  EXPECT_NEAR(slow.A(kSpeed, kSpeed), std::exp(-3 * 0.1 / 2), 1e-12);
  EXPECT_NEAR(slow.A(kThrust, kThrust), std::exp(-0.1 / 0.2), 1e-12);
  EXPECT_NEAR(slow.B(kThrust, 0), 1 - std::exp(-0.1 / 0.2), 1e-12);
}

TEST(AxisModel, NoiseGivesTheProcessesTheirVariances) {
  const AxisModel axis{.current_std = 1.7,
                       .current_time_s = 8,
                       .wave_std = 2.5,
                       .wave_period_s = 2.5,
                       .wave_damping = 0.15};
  const DiscreteModel model = Discretise(MakeLinearModel({axis}), 1 / 30.0);
  // stationary: P = A P A' + W of the disturbances alone
  const MatrixXd A = model.A.bottomRightCorner(3, 3), W = model.W.bottomRightCorner(3, 3);
  MatrixXd P = W;
  for (int k = 0; k < 20000; ++k) P = A * P * A.transpose() + W;
  EXPECT_NEAR(P(0, 0), 1.7 * 1.7, 1e-6);
  EXPECT_NEAR(P(1, 1), 2.5 * 2.5, 1e-6);
  EXPECT_NEAR(P(1, 2), 0, 1e-6);
}

}  // namespace
}  // namespace turbidock::control
