#pragma once
// The published visual servo: proportional control of the thruster voltages by the estimated pose.

#include <cstdint>
#include <optional>

#include "control/axis_volts.h"
#include "control/desired_pose.h"
#include "sim/base/clock.h"
#include "sim/base/fields.h"
#include "sim/base/pose_estimate.h"

namespace turbidock::control {

// Gains of an axis of translation. Published gains carry no unit and cannot be used; 20 V/m is 20
// to 80 N/m on thrusters of 1 to 4 N/V, the stiffness derived for a 15 kg vehicle with its added
// mass.
struct AxisGains {
  double kp_v_per_m = 20;
  double kd_v_s_per_m = 0;  // 0: the published law
  double limit_v = 2.5;     // 2.5: all there is, as published

  static void Fields(auto& self, auto&& field) {
    field("kp_v_per_m", self.kp_v_per_m, InRange(0, 1000), "voltage per metre of error");
    field("kd_v_s_per_m", self.kd_v_s_per_m, InRange(0, 1000),
          "voltage per speed of the estimate; 0 as published");
    field("limit_v", self.limit_v, InRange(0, 2.5), "largest deviation from neutral");
  }
};

// Gains of the heading, whose error is that of eps3 (half the angle in rad when small).
struct YawGains {
  double kp_v = 2;    // guess: 1 V/rad is about 0.6 N m/rad with two thrusters 0.1 m off the axis
  double kd_v_s = 0;  // 0: the published law
  double limit_v = 2.5;

  static void Fields(auto& self, auto&& field) {
    field("kp_v", self.kp_v, InRange(0, 1000), "voltage per unit of eps3");
    field("kd_v_s", self.kd_v_s, InRange(0, 1000),
          "voltage per unit of eps3 in a second; 0 as published");
    field("limit_v", self.limit_v, InRange(0, 2.5), "largest deviation from neutral");
  }
};

struct VisualServoParams {
  // guess: at full voltage the vehicle arrives too fast for a law with kd = 0 to stop it
  AxisGains surge{.limit_v = 1};
  AxisGains sway, heave;
  YawGains yaw;
  double rate_filter_s = 0.2;   // guess: the estimate's noise against the phase it costs
  double rate_restart_s = 0.3;  // guess: as long as the filter remembers

  static void Fields(auto& self, auto&& field) {
    field("surge", self.surge, Finite(), "marker's x in the camera head");
    field("sway", self.sway, Finite(), "marker's y in the camera head");
    field("heave", self.heave, Finite(), "marker's z in the camera head");
    field("yaw", self.yaw, Finite(), "marker's eps3 in the camera head");
    field("rate_filter_s", self.rate_filter_s, InRange(0, 10),
          "time constant of the first-order filter on the estimate's rate; 0 for none");
    field("rate_restart_s", self.rate_restart_s, InRange(0, 10),
          "frames without control for longer than this start the rate anew at zero");
  }
};

// The law, with e = estimated minus desired pose of the marker M in the camera head H:
//
//   surge = kp e_x + kd x'      sway = kp e_y + kd y'
//   heave = kp e_z + kd z'      yaw = kp e_eps3 + kd eps3'
//
// each limited to +-limit. All signs are plus: a marker farther, further left, higher or turned
// counter-clockwise means: go forward, left, up, turn counter-clockwise. The desired eps3 is
// sin(yaw / 2). The prime is a filtered rate of the estimate (never of the desired pose, so that a
// moved target does not kick). The published law, v = kp (error) + 2.5 V, is kd = 0; on a vehicle
// with little drag it is nearly undamped, and any other kd is a departure from it. The neutral 2.5
// V is added by Allocate.
class VisualServo {
 public:
  VisualServo(const VisualServoParams& params, const ClockParams& clock);

  // Voltages for this frame. Frames must increase; where some are missing, rates are means over the
  // gap. Call only with an estimate to be trusted.
  AxisVolts Update(const PoseEstimate& estimate, const DesiredPose& desired);

  // Forgets the past: the next rate is zero. Gaps of more than rate_restart_s do this by
  // themselves.
  void Reset() { last_frame_.reset(); }

 private:
  // x, y, z of M in H and eps3, or their rates per second.
  using Axes = Eigen::Vector4d;

  void UpdateRate(int64_t frame, const Axes& measured);

  VisualServoParams params_;
  ClockParams clock_;
  std::optional<int64_t> last_frame_;
  Axes last_ = Axes::Zero();
  Axes rate_ = Axes::Zero();  // filtered
};

}  // namespace turbidock::control
