#pragma once
// Rigid poses, twists and wrenches: small value types. Conventions: sim/base/frames.h.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace turbidock {

// Pose X_AB of frame B in frame A: p_AQ = X_AB * p_BQ.
struct Pose {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();  // q_AB, unit
  Eigen::Vector3d p = Eigen::Vector3d::Zero();            // p_AB, metres

  static Pose Translation(double x_m, double y_m, double z_m) {
    return {Eigen::Quaterniond::Identity(), {x_m, y_m, z_m}};
  }
  // From p and (eps1, eps2, eps3), the vector part of q; the scalar part is the non-negative root.
  // A vector part longer than 1 is scaled to length 1 (a half turn).
  static Pose FromVectorPart(const Eigen::Vector3d& p, const Eigen::Vector3d& eps);

  Eigen::Matrix3d R() const { return q.toRotationMatrix(); }
  Pose Inverse() const { return {q.conjugate(), -(q.conjugate() * p)}; }
  // The same pose with q normalised and w >= 0: the form that is logged, compared and hashed.
  Pose Canonical() const;
  bool IsFinite() const { return q.coeffs().allFinite() && p.allFinite(); }
};

inline Pose operator*(const Pose& X_AB, const Pose& X_BC) {
  return {X_AB.q * X_BC.q, X_AB.q * X_BC.p + X_AB.p};
}
inline Eigen::Vector3d operator*(const Pose& X_AB, const Eigen::Vector3d& p_BQ) {
  return X_AB.q * p_BQ + X_AB.p;
}

// Angular and linear velocity of one frame in another, expressed as the name of the variable says.
struct Twist {
  Eigen::Vector3d w = Eigen::Vector3d::Zero();  // rad/s
  Eigen::Vector3d v = Eigen::Vector3d::Zero();  // m/s
};

// Torque and force on a body, taken at the body's origin unless the name says otherwise.
struct Wrench {
  Eigen::Vector3d tau = Eigen::Vector3d::Zero();  // N m
  Eigen::Vector3d f = Eigen::Vector3d::Zero();    // N
};

// Heading, rad in (-pi, pi]: rotation about z of the z-y-x (yaw, pitch, roll) factorisation.
double YawOf(const Eigen::Quaterniond& q);

// The same angle in [-pi, pi].
double WrapAngle(double rad);

// Rotation from yaw, pitch, roll (z-y-x), radians.
Eigen::Quaterniond FromYawPitchRoll(double yaw_rad, double pitch_rad, double roll_rad);

// Angle of the rotation that takes a to b, rad in [0, pi].
double AngleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

}  // namespace turbidock
