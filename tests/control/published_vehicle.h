#pragma once
// The published vehicle as its controller knows it, typed a second time.

#include "control/vehicle_model.h"

namespace turbidock::control {

inline VehicleModel PublishedVehicle() {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  return {.thrusters = {{.name = "surge_left", .p_BT = {-0.13, 0.10, 0}, .axis_B = x},
                        {.name = "surge_right", .p_BT = {-0.13, -0.10, 0}, .axis_B = x},
                        {.name = "sway", .p_BT = {0, 0, 0}, .axis_B = {0, 1, 0}},
                        {.name = "heave", .p_BT = {0, 0, 0}, .axis_B = {0, 0, 1}}},
          .inertia = {21, 25, 24, 0.28},
          .linear_damping = {12, 7, 13, 0.8},
          .quadratic_damping = {55, 145, 76, 0.5},
          .thruster_lag_s = 0.08,
          .head_ahead_m = 0.19};
}

}  // namespace turbidock::control
