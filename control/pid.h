#pragma once
// Proportional, integral and derivative control of every axis.

#include <array>
#include <cstdint>
#include <optional>

#include "control/controller.h"
#include "control/pose_filter.h"
#include "control/setpoint.h"
#include "control/thrust_allocation.h"
#include "sim/base/clock.h"
#include "sim/base/fields.h"

namespace turbidock::control {

struct PidParams {
  struct Translation {
    double kp_v_per_m = 16;
    double ki_v_per_m_s = 0;
    double kd_v_s_per_m = 20;
    double limit_v = 2.5;

    static void Fields(auto& self, auto&& field) {
      field("kp_v_per_m", self.kp_v_per_m, InRange(0, 1000), "voltage per metre of error");
      field("ki_v_per_m_s", self.ki_v_per_m_s, InRange(0, 1000),
            "voltage gained in a second per metre of error");
      field("kd_v_s_per_m", self.kd_v_s_per_m, InRange(0, 1000),
            "voltage per metre a second of the error's rate");
      field("limit_v", self.limit_v, InRange(0, 2.5), "largest deviation from neutral");
    }
  };
  struct Yaw {
    double kp_v_per_rad = 0.9;
    double ki_v_per_rad_s = 0;
    double kd_v_s_per_rad = 1.25;
    double limit_v = 2.5;
    double aim = 0;

    static void Fields(auto& self, auto&& field) {
      field("kp_v_per_rad", self.kp_v_per_rad, InRange(0, 1000), "voltage per radian of error");
      field("ki_v_per_rad_s", self.ki_v_per_rad_s, InRange(0, 1000),
            "voltage gained in a second per radian of error");
      field("kd_v_s_per_rad", self.kd_v_s_per_rad, InRange(0, 1000),
            "voltage per radian a second of the error's rate");
      field("limit_v", self.limit_v, InRange(0, 2.5), "largest deviation from neutral");
      field("aim", self.aim, InRange(0, 1),
            "share of the angle to a marker aside that counts as error of the heading: 1 turns to "
            "where the wanted place is, faster than sway can go there");
    }
  };

  Translation surge{.kp_v_per_m = 5, .kd_v_s_per_m = 6};
  Translation sway, heave;
  Yaw yaw;
  double rate_filter_s = 0.08;  // the estimate's noise against the phase it costs
  double rate_restart_s = 0.3;  // guess: as long as the filter remembers
  double anti_windup_s = 0.5;   // guess: faster than the integrals, slower than the noise
  PoseFilterParams pose_filter;
  SetpointParams setpoint;
  AllocationParams allocation;

  static void Fields(auto& self, auto&& field) {
    field("surge", self.surge, Finite(), "marker's x in the camera head");
    field("sway", self.sway, Finite(), "marker's y in the camera head");
    field("heave", self.heave, Finite(), "marker's z in the camera head");
    field("yaw", self.yaw, Finite(), "marker's heading in the camera head");
    field("rate_filter_s", self.rate_filter_s, InRange(0, 10),
          "time constant of the first-order filter on the estimate's rate, without a pose filter; "
          "0 for none");
    field("rate_restart_s", self.rate_restart_s, InRange(0, 10),
          "frames without an estimate for longer than this start the rate anew at zero");
    field("anti_windup_s", self.anti_windup_s, InRange(0.01, 100),
          "time in which an integral gives back what the thrusters could not give");
    field("pose_filter", self.pose_filter, Finite(), "between estimate and law");
    field("setpoint", self.setpoint, Finite(), "how the desired pose moves");
    field("allocation", self.allocation, Finite(),
          "from axes to thrusters; feeds the dead band forward");
  }
};

// With e = seen less wanted:
//
//   volts = kp e + kd e' + I,     I' = ki e + (given - volts) / anti_windup_s
//
// limited to +-limit; the error of the heading also has yaw.aim times the angle e_y / x. The second
// term of I' is back-calculation (Astrom and Hagglund 2006, section 3.5): the integral follows what
// the thrusters really gave, so that it does not wind up behind a limit. The rate of what is seen
// comes from the pose filter if there is one, else it is the first-order filtered difference
// quotient. A moved target does not kick: the wanted rate is the setpoint's, never a difference.
// Without control the integral stands still.
class Pid final : public Controller {
 public:
  Pid(const PidParams& params, const ClockParams& clock);  // checked: ConfigError

  void Observe(const Observation& seen) override;
  AxisVolts Demand(const Reference& wanted) override;
  void Given(int64_t frame, const AxisVolts& volts) override;

 private:
  struct Gains {
    double kp, ki, kd, limit_v;
  };

  PidParams params_;
  ClockParams clock_;
  std::array<Gains, kAxisCount> gains_;
  std::optional<int64_t> last_frame_;
  Axes position_ = Axes::Zero();
  Axes rate_ = Axes::Zero();
  Axes integral_v_ = Axes::Zero();
  // Of the last demand, until it is known what was given.
  struct Pending {
    Axes error, wanted_v;
  };
  std::optional<Pending> pending_;
};

}  // namespace turbidock::control
