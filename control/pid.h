#pragma once
// Proportional, integral and derivative control of every axis.

#include <array>
#include <cstdint>
#include <optional>

#include "control/controller.h"
#include "control/pose_filter.h"
#include "control/setpoint.h"
#include "control/thrust_allocation.h"
#include "control/vehicle_model.h"
#include "sim/base/clock.h"
#include "sim/base/fields.h"

namespace turbidock::control {

struct PidParams {
  // Accelerations, so that gains fit any vehicle: the force is the nominal inertia times them.
  struct Translation {
    double kp_per_s2 = 1.4;
    double ki_per_s3 = 0;
    double kd_per_s = 1.7;
    double limit_share = 1;

    static void Fields(auto& self, auto&& field) {
      field("kp_per_s2", self.kp_per_s2, InRange(0, 1000),
            "proportional gain: acceleration per metre of error");
      field("ki_per_s3", self.ki_per_s3, InRange(0, 1000),
            "integral gain: acceleration gained in a second per metre of error");
      field("kd_per_s", self.kd_per_s, InRange(0, 1000),
            "derivative gain: acceleration per m/s of the error's rate");
      field("limit_share", self.limit_share, InRange(0, 1),
            "PID: largest demand, as a share of the vehicle's largest force, either way");
    }
  };
  struct Yaw {
    double kp_per_s2 = 1.4;
    double ki_per_s3 = 0;
    double kd_per_s = 1.9;
    double limit_share = 1;
    double aim = 0;

    static void Fields(auto& self, auto&& field) {
      field("kp_per_s2", self.kp_per_s2, InRange(0, 1000),
            "proportional gain of the yaw: angular acceleration per radian of error");
      field(
          "ki_per_s3", self.ki_per_s3, InRange(0, 1000),
          "integral gain of the yaw: angular acceleration gained in a second per radian of error");
      field("kd_per_s", self.kd_per_s, InRange(0, 1000),
            "derivative gain of the yaw: angular acceleration per rad/s of the error's rate");
      field("limit_share", self.limit_share, InRange(0, 1),
            "PID: largest demand, as a share of the vehicle's largest moment, either way");
      field("aim", self.aim, InRange(0, 1),
            "share of the angle to a marker aside that counts as an error of the heading: 1 turns "
            "to where the desired place is, faster than sway can go there");
    }
  };

  Translation surge{.kp_per_s2 = 1, .kd_per_s = 1.2};
  Translation sway, heave;
  Yaw yaw;
  double rate_filter_s = 0.08;  // the estimate's noise against the phase it costs
  double rate_restart_s = 0.3;  // guess: as long as the filter remembers
  double anti_windup_s = 0.5;   // guess: faster than the integrals, slower than the noise
  PoseFilterParams pose_filter;
  SetpointParams setpoint;
  ForceAllocationParams allocation;

  static void Fields(auto& self, auto&& field) {
    field("surge", self.surge, Finite(), "PID of surge: the marker's x in the camera head");
    field("sway", self.sway, Finite(), "PID of sway: the marker's y in the camera head");
    field("heave", self.heave, Finite(), "PID of heave: the marker's z in the camera head");
    field("yaw", self.yaw, Finite(), "PID of yaw: the marker's heading in the camera head");
    field("rate_filter_s", self.rate_filter_s, InRange(0, 10),
          "PID: time constant of the first-order filter on the estimate's rate, without a pose "
          "filter; 0 for none");
    field("rate_restart_s", self.rate_restart_s, InRange(0, 10),
          "PID: time without an estimate after which the estimate's rate starts anew at zero");
    field("anti_windup_s", self.anti_windup_s, InRange(0.01, 100),
          "PID: time in which an integral gives back what the thrusters could not give");
    field("pose_filter", self.pose_filter, Finite(), "filter between estimate and controller");
    field("setpoint", self.setpoint, Finite(),
          "motion of the desired pose that the controller follows");
    field("allocation", self.allocation, Finite(),
          "allocation of the axes' demand to the thrusters");
  }
};

// With e = seen less wanted:
//
//   a = kp e + kd e' + I,     I' = ki e + (given - a) / anti_windup_s
//
// and the force is the nominal inertia times a, limited (given: what was, over the inertia); the
// error of the heading also has yaw.aim times the angle e_y / x. The second term of I' is
// back-calculation (Astrom and Hagglund 2006, section 3.5): the integral follows what the thrusters
// really gave, so that it does not wind up behind a limit. The rate of what is seen comes from the
// pose filter if there is one, else it is the first-order filtered difference quotient. A moved
// target does not kick: the wanted rate is the setpoint's, never a difference. Without control the
// integral stands still.
class Pid final : public Controller {
 public:
  using Params = PidParams;
  Pid(const PidParams& params, const VehicleModel& vehicle,
      const ClockParams& clock);  // checked: ConfigError

  void Observe(const Observation& seen) override;
  Axes Demand(const Reference& wanted) override;
  void OnCommandApplied(int64_t frame, const Axes& given) override;

 private:
  // In force per error, its integral and its rate.
  struct Gains {
    double kp = 0, ki = 0, kd = 0, least = 0, most = 0;
  };

  PidParams params_;
  ClockParams clock_;
  std::array<Gains, kAxisCount> gains_;
  std::optional<int64_t> last_frame_;
  Axes position_ = Axes::Zero();
  Axes rate_ = Axes::Zero();
  Axes integral_ = Axes::Zero();  // a force
  // Of the last demand, until it is known what was given.
  struct Pending {
    Axes error, wanted;
  };
  std::optional<Pending> pending_;
};

}  // namespace turbidock::control
