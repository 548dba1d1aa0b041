#pragma once
// The published visual servo: proportional control of the thruster voltages by the estimated pose.

#include "control/controller.h"
#include "control/pose_filter.h"
#include "control/setpoint.h"
#include "control/thrust_allocation.h"
#include "sim/base/fields.h"

namespace turbidock::control {

struct PVoltageParams {
  // Published gains carry no unit and cannot be used. 30 V/m is 64 N/m on a thruster of 2.1 N/V, in
  // the middle of those with which this vehicle docks in the sea at night (20 to 40 V/m).
  struct Translation {
    double kp_v_per_m = 30;
    double limit_v = 2.5;  // all there is, as published

    static void Fields(auto& self, auto&& field) {
      field("kp_v_per_m", self.kp_v_per_m, InRange(0, 1000),
            "proportional gain: voltage per metre of error of position");
      field("limit_v", self.limit_v, InRange(0, 2.5),
            "largest deviation of the demanded voltage from neutral");
    }
  };
  // The error of the heading is that of eps3, half the angle in rad when small.
  struct Yaw {
    double kp_v = 2;  // guess: 0.42 N m/rad with two thrusters 0.1 m off the axis
    double limit_v = 2.5;

    static void Fields(auto& self, auto&& field) {
      field("kp_v", self.kp_v, InRange(0, 1000),
            "proportional gain of the yaw: voltage per unit of error of eps3, the quaternion's z");
      field("limit_v", self.limit_v, InRange(0, 2.5),
            "largest deviation of the demanded yaw voltage from neutral");
    }
  };

  // guess: at full voltage the vehicle arrives too fast for an undamped controller to stop it; 0.5
  // V take it to 0.08 m/s
  Translation surge{.kp_v_per_m = 20, .limit_v = 0.5};
  Translation sway, heave;
  Yaw yaw;
  PoseFilterParams pose_filter;
  SetpointParams setpoint;
  VoltsAllocationParams allocation;  // published: no compensation

  static void Fields(auto& self, auto&& field) {
    field("surge", self.surge, Finite(), "p_voltage of surge: the marker's x in the camera head");
    field("sway", self.sway, Finite(), "p_voltage of sway: the marker's y in the camera head");
    field("heave", self.heave, Finite(), "p_voltage of heave: the marker's z in the camera head");
    field("yaw", self.yaw, Finite(), "p_voltage of yaw: the marker's eps3 in the camera head");
    field("pose_filter", self.pose_filter, Finite(),
          "filter between estimate and controller; off as published");
    field("setpoint", self.setpoint, Finite(),
          "motion of the desired pose that the controller follows; off as published");
    field("allocation", self.allocation, Finite(),
          "allocation of the axes' demand to the thrusters");
  }
};

// surge = kp (x - xd), sway = kp (y - yd), heave = kp (z - zd), yaw = kp (eps3 - eps3d), each
// limited to +-limit; eps3 is sin(heading / 2). The neutral 2.5 V is added by Allocate. On a
// vehicle with little drag this controller is nearly undamped.
class PVoltage final : public Controller {
 public:
  using Params = PVoltageParams;
  explicit PVoltage(const PVoltageParams& params);  // checked: ConfigError

  void Observe(const Observation& seen) override;
  Axes Demand(const Reference& wanted) override;  // volts
  void OnCommandApplied(int64_t, const Axes&) override {}

 private:
  PVoltageParams params_;
  Axes position_ = Axes::Zero();
};

}  // namespace turbidock::control
