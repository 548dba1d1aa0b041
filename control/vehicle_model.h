#pragma once
// The vehicle as its controller knows it.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "control/axes.h"
#include "sim/base/image_times.h"
#include "sim/base/thrust_curve.h"

namespace turbidock::control {

// A thruster, in the vehicle's body frame B (x forward, y left, z up).
struct ThrusterModel {
  std::string name;
  Eigen::Vector3d p_BT = Eigen::Vector3d::Zero();     // where it pushes [m]
  Eigen::Vector3d axis_B = Eigen::Vector3d::UnitX();  // where to, unit length
  ThrustCurve curve{};
  double effectiveness = 1;  // 0: failed, not to be counted on
};

// Nominal data: what its builder knows of it, not what it is in a trial.
struct VehicleModel {
  std::vector<ThrusterModel> thrusters;
  // By axis, rigid body and added mass together, about B's origin: kg and kg m^2.
  Axes inertia = Axes::Ones();
  Eigen::Vector2d roll_pitch_inertia = Eigen::Vector2d::Ones();  // likewise, kg m^2
  Axes linear_damping = Axes::Zero();                            // N s/m and N m s
  Axes quadratic_damping = Axes::Zero();                         // N s^2/m^2 and N m s^2
  double thruster_lag_s = 0.1;                                   // the slowest of them
  double head_ahead_m = 0;  // the camera head's x in B, about whose origin it turns
  ImageTimes images{};

  // Damping linearised about a speed on each axis.
  Axes DampingAt(const Axes& speed) const {
    return linear_damping + 2 * (quadratic_damping.array() * speed.array()).matrix();
  }
};

}  // namespace turbidock::control
