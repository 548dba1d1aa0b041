#pragma once
// Linear-quadratic control on a model of the vehicle, with a Kalman filter that also estimates what
// current and waves do to it.

#include <cstdint>
#include <optional>
#include <vector>

#include "control/controller.h"
#include "control/lqg_loop.h"
#include "control/setpoint.h"
#include "control/thrust_allocation.h"
#include "sim/base/clock.h"
#include "sim/base/fields.h"

namespace turbidock::control {

struct LqgParams {
  // What the vehicle is taken for: rigid plus added mass, damping linearised about the relative
  // speeds of the task (0.05 m/s ahead, 0.1 m/s across), and force per volt of compensated demand:
  // 4.9 N at 2.31 V. Sources: assets/gains.yaml.
  struct Translation {
    double mass_kg = 25;
    double damping_newton_s_per_m = 36;
    double thrust_newton_per_v = 2.12;
    double error_m = 0.01;   // the law takes this error, ...
    double speed_mps = 0.1;  // ... this speed ...
    double effort_v = 0.6;   // ... and this deviation from the steady voltage for equally bad
    double noise_m = 0.001;  // a few times the estimator's in clear water
    double current_newton = 2;
    double wave_newton = 2;
    double limit_v = 2.5;

    static void Fields(auto& self, auto&& field) {
      field("mass_kg", self.mass_kg, Above(0), "model: mass with the added mass");
      field("damping_newton_s_per_m", self.damping_newton_s_per_m, AtLeast(0),
            "model: drag per speed, linearised");
      field("thrust_newton_per_v", self.thrust_newton_per_v, Above(0),
            "model: force per volt of demand");
      field("error_m", self.error_m, Above(0), "cost: error that weighs as much as effort_v");
      field("speed_mps", self.speed_mps, Above(0), "cost: speed that weighs as much");
      field("effort_v", self.effort_v, Above(0),
            "cost: deviation from the voltage that holds against current and waves");
      field("noise_m", self.noise_m, Above(0), "filter: standard deviation of the estimate");
      field("current_newton", self.current_newton, Above(0),
            "filter: standard deviation of the current's force");
      field("wave_newton", self.wave_newton, AtLeast(0),
            "filter: standard deviation of the waves' force; 0: none");
      field("limit_v", self.limit_v, InRange(0, 2.5), "largest deviation from neutral");
    }
  };
  struct Yaw {
    double inertia_kg_m2 = 0.28;
    double damping_newton_m_s = 0.9;
    double moment_newton_m_per_v = 0.424;
    double error_rad = 0.05;
    double speed_rad_s = 0.2;
    double effort_v = 0.6;
    double noise_rad = 0.008;
    double current_newton_m = 0.05;
    double wave_newton_m = 0;
    double limit_v = 1.5;

    static void Fields(auto& self, auto&& field) {
      field("inertia_kg_m2", self.inertia_kg_m2, Above(0), "model: inertia with the added one");
      field("damping_newton_m_s", self.damping_newton_m_s, AtLeast(0),
            "model: damping per rate, linearised");
      field("moment_newton_m_per_v", self.moment_newton_m_per_v, Above(0),
            "model: moment per volt of demand");
      field("error_rad", self.error_rad, Above(0), "cost: error that weighs as much as effort_v");
      field("speed_rad_s", self.speed_rad_s, Above(0), "cost: rate that weighs as much");
      field("effort_v", self.effort_v, Above(0),
            "cost: deviation from the voltage that holds against current and waves");
      field("noise_rad", self.noise_rad, Above(0), "filter: standard deviation of the estimate");
      field("current_newton_m", self.current_newton_m, Above(0),
            "filter: standard deviation of the current's moment");
      field("wave_newton_m", self.wave_newton_m, AtLeast(0),
            "filter: standard deviation of the waves' moment; 0: none");
      field("limit_v", self.limit_v, InRange(0, 2.5), "largest deviation from neutral");
    }
  };

  Translation surge{.mass_kg = 21,
                    .damping_newton_s_per_m = 17.5,
                    .thrust_newton_per_v = 4.24,
                    .noise_m = 0.003,
                    .wave_newton = 0};
  Translation sway;
  Translation heave{.mass_kg = 24, .damping_newton_s_per_m = 20.6, .current_newton = 1};
  Yaw yaw;
  double head_offset_m = 0.19;  // of models/vehicle.xml
  double thruster_lag_s = 0.08;
  int latency_frames = 1;
  double current_time_s = 60;
  double wave_period_s = 2.5;
  double wave_damping = 0.05;
  double unknown_acceleration = 0.01;  // guess
  double gate_sigma = 10;              // the model is not the vehicle
  int restart_frames = 6;
  SetpointParams setpoint;
  AllocationParams allocation;

  static void Fields(auto& self, auto&& field) {
    field("surge", self.surge, Finite(), "marker's x in the camera head");
    field("sway", self.sway, Finite(), "marker's y in the camera head");
    field("heave", self.heave, Finite(), "marker's z in the camera head");
    field("yaw", self.yaw, Finite(), "marker's heading in the camera head");
    field("head_offset_m", self.head_offset_m, InRange(-2, 2),
          "model: the camera head ahead of the point about which the vehicle turns");
    field("thruster_lag_s", self.thruster_lag_s, InRange(0.001, 10), "model: of the thrusters");
    field("latency_frames", self.latency_frames, InRange(0, 30),
          "model: frames from an image to the command made of it");
    field("current_time_s", self.current_time_s, InRange(0.1, 1e4),
          "filter: time in which the current's correlation falls to 1/e");
    field("wave_period_s", self.wave_period_s, InRange(0.2, 60), "filter: of the waves");
    field("wave_damping", self.wave_damping, InRange(0.001, 2),
          "filter: ratio that says how broad the waves' spectrum is");
    field("unknown_acceleration", self.unknown_acceleration, AtLeast(0),
          "filter: white acceleration that no other part explains, per root of Hz");
    field("gate_sigma", self.gate_sigma, Above(0),
          "estimates off the prediction by more than this many standard deviations are not used");
    field("restart_frames", self.restart_frames, InRange(1, 10000),
          "as many frames in a row without a usable estimate start the filter anew");
    field("setpoint", self.setpoint, Finite(), "how the desired pose moves");
    field("allocation", self.allocation, Finite(), "from axes to thrusters");
  }
};

// Surge and heave each by itself; sway and yaw together, because a turn by a degree moves the
// marker in the camera head by as much as a centimetre aside: where the sway thruster cannot hold
// against the waves, the vehicle turns to keep the pole on the hole. Model and gains: LqgLoop. The
// filter runs at the image's time and is predicted over the latency with the voltages given since.
// It hears what the thrusters were given, so nothing winds up when they saturate.
class Lqg final : public Controller {
 public:
  Lqg(const LqgParams& params, const ClockParams& clock);  // checked: ConfigError

  void Observe(const Observation& seen) override;
  AxisVolts Demand(const Reference& wanted) override;
  void Given(int64_t frame, const AxisVolts& volts) override;

 private:
  // A loop and its axes; what goes in and out of it, gathered from all axes.
  struct Part {
    LqgLoop loop;
    std::vector<Axis> axes;
    Eigen::VectorXd position, speed, acceleration, volts;

    void Gather(const Axes& all, Eigen::VectorXd* some) const;
  };

  // Positions of the vehicle for the part's axes, the heading next to the filter's.
  void Measure(const Axes& marker, Part* part) const;
  double lever_m() const;
  void Start(const Observation& seen);
  Axes* Slot(int64_t frame);
  Axes GivenAt(int64_t frame);  // zero where nothing is known

  LqgParams params_;
  ClockParams clock_;
  std::vector<Part> parts_;       // surge, heave, sway with yaw
  std::optional<int64_t> frame_;  // of the state
  int64_t used_frame_ = 0;        // of the last estimate that was used
  // The latest voltages, by the frame of the image they were made of: slot frame % size.
  std::vector<Axes> given_;
  std::optional<int64_t> first_given_, last_given_;
};

}  // namespace turbidock::control
