#pragma once
// Between estimator and controller: a Kalman filter of a vehicle that keeps its speed.

#include <array>
#include <cstdint>
#include <optional>

#include "control/controller.h"
#include "sim/base/clock.h"
#include "sim/base/fields.h"

namespace turbidock::control {

struct PoseFilterParams {
  bool enabled = false;  // published: none
  // guesses: a few times the estimator's scatter in clear water; what thrusters and waves do to the
  // vehicle
  Eigen::Vector4d noise{0.002, 0.0006, 0.0006, 0.008};
  Eigen::Vector4d acceleration{0.2, 0.2, 0.2, 0.4};
  double latency_s = 0.0333;  // one frame
  double gate_sigma = 5;
  int restart_frames = 6;

  static void Fields(auto& self, auto&& field) {
    field("enabled", self.enabled, Finite(),
          "whether a filter of pose and rate is between estimator and controller");
    field("noise", self.noise, Above(0),
          "pose filter: standard deviation of the estimate's x, y, z [m] and yaw [rad]; the "
          "estimate's own where it claims more");
    field("acceleration", self.acceleration, Above(0),
          "pose filter: standard deviation of the acceleration, taken as new in every frame, of x, "
          "y, z [m/s^2] and yaw [rad/s^2]");
    field("latency_s", self.latency_s, InRange(0, 1),
          "pose filter: time from the image to the command, over which the filtered pose is "
          "predicted");
    field("gate_sigma", self.gate_sigma, Above(0),
          "pose filter: number of standard deviations off the prediction beyond which an estimate "
          "is not used");
    field("restart_frames", self.restart_frames, InRange(1, 1000),
          "pose filter: number of frames in a row without an estimate, or with one that gate_sigma "
          "refuses, after which the filter starts anew");
  }
};

// Each axis by itself: position and speed, driven by an acceleration that is constant over a frame
// and independent of the last (Bar-Shalom, Li and Kirubarajan 2001, section 6.3.2).
class PoseFilter {
 public:
  PoseFilter(const PoseFilterParams& params, const ClockParams& clock);  // checked: ConfigError

  // The observation with what the filter knows: position at the image's time plus latency, and
  // rate. Nothing when an axis is off the prediction: an outlier. Not enabled, it is passed on as
  // it is. Frames must increase.
  std::optional<Observation> Update(const Observation& seen);

 private:
  struct AxisState {
    double position = 0, rate = 0;
    double pp = 0, pr = 0, rr = 0;  // covariance
  };

  double NoiseVariance(const Observation& seen, int axis) const;
  void Start(const Observation& seen);
  void Predict(double acceleration_std, AxisState* state) const;

  PoseFilterParams params_;
  ClockParams clock_;
  std::optional<int64_t> last_frame_;
  int rejected_ = 0;  // in a row
  std::array<AxisState, kAxisCount> states_;
};

}  // namespace turbidock::control
