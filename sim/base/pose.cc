#include "sim/base/pose.h"

#include <numbers>

namespace turbidock {

Pose Pose::FromVectorPart(const Eigen::Vector3d& p, const Eigen::Vector3d& eps) {
  const double squared = eps.squaredNorm();
  if (squared >= 1) {
    const Eigen::Vector3d axis = eps / std::sqrt(squared);
    return {Eigen::Quaterniond(0, axis.x(), axis.y(), axis.z()), p};
  }
  return {Eigen::Quaterniond(std::sqrt(1 - squared), eps.x(), eps.y(), eps.z()), p};
}

Pose Pose::Canonical() const {
  Eigen::Quaterniond unit = q.normalized();
  if (unit.w() < 0) unit.coeffs() = -unit.coeffs();
  return {unit, p};
}

double YawOf(const Eigen::Quaterniond& q) {
  return std::atan2(2 * (q.w() * q.z() + q.x() * q.y()), 1 - 2 * (q.y() * q.y() + q.z() * q.z()));
}

double WrapAngle(double rad) { return std::remainder(rad, 2 * std::numbers::pi); }

Eigen::Quaterniond FromYawPitchRoll(double yaw_rad, double pitch_rad, double roll_rad) {
  return Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX());
}

double AngleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::Quaterniond d = a.conjugate() * b;
  return 2 * std::atan2(d.vec().norm(), std::abs(d.w()));
}

}  // namespace turbidock
