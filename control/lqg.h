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
#include "control/vehicle_model.h"
#include "sim/base/clock.h"
#include "sim/base/fields.h"

namespace turbidock::control {

struct LqgParams {
  // The more of it, the less the controller stands on its model: the loop's margins grow towards
  // those of a controller that is told the whole state (loop transfer recovery, Doyle and Stein
  // 1979).
  static constexpr const char* kUnknown =
      "LQG filter: root spectral density of the acceleration that nothing else explains, per root "
      "of Hz";
  // The model is the vehicle's nominal data: rigid and added mass, damping linearised about the
  // speed below, thrusters' lag, camera head.
  struct Translation {
    double drift_mps = 0.05;      // relative to the water, in the task
    double error_m = 0.01;        // the controller takes this error, ...
    double speed_mps = 0.1;       // ... this speed ...
    double effort_share = 0.273;  // ... and this deviation from the steady force for equally bad
    double noise_m = 0.001;       // a few times the estimator's in clear water
    double current_mps2 = 0.08;
    double wave_mps2 = 0.08;
    double unknown_mps2 = 0.01;  // guess
    double limit_share = 1;

    static void Fields(auto& self, auto&& field) {
      field("drift_mps", self.drift_mps, InRange(0, 10),
            "LQG model: speed through the water about which drag is linearised");
      field("error_m", self.error_m, Above(0),
            "LQG cost: error of position that weighs as much as effort_share");
      field("speed_mps", self.speed_mps, Above(0),
            "LQG cost: speed that weighs as much as effort_share");
      field("effort_share", self.effort_share, InRange(1e-4, 100),
            "LQG cost: deviation from the force that holds against current and waves, as a share "
            "of the vehicle's largest force");
      field("noise_m", self.noise_m, Above(0),
            "LQG filter: standard deviation of the estimated position");
      field("current_mps2", self.current_mps2, Above(0),
            "LQG filter: standard deviation of the acceleration by the current's force");
      field("wave_mps2", self.wave_mps2, AtLeast(0),
            "LQG filter: standard deviation of the acceleration by the waves' force; 0: none");
      field("unknown_mps2", self.unknown_mps2, AtLeast(0), kUnknown);
      field("limit_share", self.limit_share, InRange(0, 1),
            "LQG: largest demand, as a share of the vehicle's largest force, either way");
    }
  };
  struct Yaw {
    double drift_rad_s = 0.1;
    double error_rad = 0.05;
    double speed_rad_s = 0.2;
    double effort_share = 0.288;
    double noise_rad = 0.008;
    double current_rad_s2 = 0.18;
    double wave_rad_s2 = 0;
    double unknown_rad_s2 = 0.01;  // guess
    double limit_share = 0.72;

    static void Fields(auto& self, auto&& field) {
      field("drift_rad_s", self.drift_rad_s, InRange(0, 10),
            "LQG model: turn rate about which drag is linearised");
      field("error_rad", self.error_rad, Above(0),
            "LQG cost: error of the heading that weighs as much as effort_share");
      field("speed_rad_s", self.speed_rad_s, Above(0),
            "LQG cost: turn rate that weighs as much as effort_share");
      field("effort_share", self.effort_share, InRange(1e-4, 100),
            "LQG cost: deviation from the moment that holds against current and waves, as a share "
            "of the vehicle's largest moment");
      field("noise_rad", self.noise_rad, Above(0),
            "LQG filter: standard deviation of the estimated heading");
      field("current_rad_s2", self.current_rad_s2, Above(0),
            "LQG filter: standard deviation of the angular acceleration by the current");
      field("wave_rad_s2", self.wave_rad_s2, AtLeast(0),
            "LQG filter: standard deviation of the angular acceleration by the waves; 0: none");
      field("unknown_rad_s2", self.unknown_rad_s2, AtLeast(0), kUnknown);
      field("limit_share", self.limit_share, InRange(0, 1),
            "LQG: largest demand, as a share of the vehicle's largest moment, either way");
    }
  };

  Translation surge{.noise_m = 0.003, .current_mps2 = 0.095, .wave_mps2 = 0};
  Translation sway{.drift_mps = 0.1};
  Translation heave{.current_mps2 = 0.042};
  Yaw yaw;
  int latency_frames = 1;
  double current_time_s = 60;
  double wave_period_s = 2.5;
  double wave_damping = 0.05;
  double gate_sigma = 10;  // the model is not the vehicle
  int restart_frames = 6;
  SetpointParams setpoint;
  ForceAllocationParams allocation;

  static void Fields(auto& self, auto&& field) {
    field("surge", self.surge, Finite(), "LQG of surge: the marker's x in the camera head");
    field("sway", self.sway, Finite(), "LQG of sway: the marker's y in the camera head");
    field("heave", self.heave, Finite(), "LQG of heave: the marker's z in the camera head");
    field("yaw", self.yaw, Finite(), "LQG of yaw: the marker's heading in the camera head");
    field("latency_frames", self.latency_frames, InRange(0, 30),
          "LQG model: number of frames from an image to the command made of it");
    field("current_time_s", self.current_time_s, InRange(0.1, 1e4),
          "LQG filter: time in which the current's correlation falls to 1/e");
    field("wave_period_s", self.wave_period_s, InRange(0.2, 60), "LQG filter: period of the waves");
    field(
        "wave_damping", self.wave_damping, InRange(0.001, 2),
        "LQG filter: ratio of damping of the waves' model, which says how broad their spectrum is");
    field("gate_sigma", self.gate_sigma, Above(0),
          "LQG filter: number of standard deviations off the prediction beyond which an estimate "
          "is not used");
    field("restart_frames", self.restart_frames, InRange(1, 10000),
          "LQG filter: number of frames in a row without a usable estimate after which the filter "
          "starts anew");
    field("setpoint", self.setpoint, Finite(),
          "motion of the desired pose that the controller follows");
    field("allocation", self.allocation, Finite(),
          "allocation of the axes' demand to the thrusters");
  }
};

// Surge and heave each by itself; sway and yaw together, because a turn by a degree moves the
// marker in the camera head by as much as a centimetre aside: where the sway thruster cannot hold
// against the waves, the vehicle turns to keep the pole on the hole. Model and gains: LqgLoop. The
// filter runs at the image's time and is predicted over the latency with the forces given since.
// It hears what the thrusters were given, so nothing winds up when they saturate. The current is
// estimated fast enough to answer a wave; without estimates, prediction goes on with its mean of
// the last seconds.
class Lqg final : public Controller {
 public:
  using Params = LqgParams;
  Lqg(const LqgParams& params, const VehicleModel& vehicle,
      const ClockParams& clock);  // checked: ConfigError

  void Observe(const Observation& seen) override;
  Axes Demand(const Reference& wanted) override;
  std::optional<Axes> Predict(int64_t frame) override;
  void OnCommandApplied(int64_t frame, const Axes& given) override;

 private:
  // A loop and its axes; what goes in and out of it, gathered from all axes.
  struct Part {
    LqgLoop loop;
    std::vector<Axis> axes;
    Eigen::VectorXd position, speed, acceleration, force;

    void Gather(const Axes& all, Eigen::VectorXd* some) const;
  };

  // Positions of the vehicle for the part's axes, the heading next to the filter's.
  void Measure(const Axes& marker, Part* part) const;
  double lever_m() const;
  void Start(const Observation& seen);
  void MoveOn(int64_t frame);  // the state
  void LearnCurrent();
  Axes* Slot(int64_t frame);
  Axes GivenAt(int64_t frame);  // zero where nothing is known

  LqgParams params_;
  double head_ahead_m_;
  ClockParams clock_;
  std::vector<Part> parts_;       // surge, heave, sway with yaw
  std::optional<int64_t> frame_;  // of the state
  int64_t used_frame_ = 0;        // of the last estimate that was used
  // A mean of the filter's, by axis: of all of it at first, then of the last seconds.
  Axes usual_current_ = Axes::Zero();
  int64_t currents_ = 0;
  // The latest forces, by the frame of the image they were made of: slot frame % size.
  std::vector<Axes> given_;
  std::optional<int64_t> first_given_, last_given_;
};

}  // namespace turbidock::control
