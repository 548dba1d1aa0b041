#pragma once
// Keeps a vehicle level that can roll and pitch by its own thrust: docking wants four axes, and its
// cameras and its pole want the horizon.

#include <Eigen/Core>

#include "control/vehicle_model.h"
#include "sim/base/attitude.h"
#include "sim/base/fields.h"

namespace turbidock::control {

// As ArduSub's stabilised mode does for such vehicles, about as fast as their thrusters allow:
// 2 rad/s, critically damped (guess).
struct LevellingParams {
  bool enabled = true;
  double kp_per_s2 = 4;
  double kd_per_s = 4;

  static void Fields(auto& self, auto&& field) {
    field("enabled", self.enabled, Finite(),
          "whether a vehicle whose thrusters roll and pitch it is levelled by them; others level "
          "by their weight alone");
    field("kp_per_s2", self.kp_per_s2, InRange(0, 100),
          "levelling: angular acceleration per radian of roll or pitch (proportional gain)");
    field("kd_per_s", self.kd_per_s, InRange(0, 100),
          "levelling: angular acceleration per rad/s of roll or pitch rate (derivative gain)");
  }
};

// Moments about B's x and y axes [N m].
using RollPitch = Eigen::Vector2d;

// tau = -I (kp angle + kd rate), zero when it is off.
RollPitch LevellingMoment(const LevellingParams& params, const VehicleModel& vehicle,
                          const Attitude& attitude);

}  // namespace turbidock::control
