#include "sim/vehicle/attitude_sensor.h"

#include <cmath>

namespace turbidock::vehicle {
namespace {

Eigen::Vector2d TwoNormals(Rng* rng) {
  const double first = rng->Normal();
  return {first, rng->Normal()};
}

}  // namespace

AttitudeSensor::AttitudeSensor(const AttitudeSensorParams& params, Rng rng)
    : params_(params), rng_(rng), bias_rad_(params.bias_std_rad * TwoNormals(&rng_)) {
  CheckFields(params, "navigation.attitude_sensor");
}

Attitude AttitudeSensor::Read(const Pose& X_WB, const Twist& V_WB_B) {
  // z-y-x: R = Rz Ry Rx, so the lowest row is (-sin pitch, cos pitch sin roll, cos pitch cos roll).
  const Eigen::RowVector3d down = X_WB.R().row(2);
  const Eigen::Vector2d roll_pitch_rad(std::atan2(down.y(), down.z()),
                                       std::atan2(-down.x(), down.tail<2>().norm()));
  const Eigen::Vector2d angle_noise = TwoNormals(&rng_), rate_noise = TwoNormals(&rng_);
  return {.roll_pitch_rad = roll_pitch_rad + bias_rad_ + params_.noise_std_rad * angle_noise,
          .rate_rad_s = V_WB_B.w.head<2>() + params_.rate_noise_std_rad_s * rate_noise};
}

}  // namespace turbidock::vehicle
