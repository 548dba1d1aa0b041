#pragma once
// Automatic gain and white balance: one set for both cameras, from places all over their images.

#include <Eigen/Core>
#include <span>

#include "sim/camera/sensor_params.h"

namespace turbidock::camera {

// What signal and noise are multiplied by: channel k by gain white_balance[k].
struct Amplification {
  double gain = 1;
  Eigen::Vector3d white_balance{1, 1, 1};
};

// Off unless the sensor has an auto_level or an auto_white_balance_limit above 1. What the scene
// calls for is followed with a first order lag of auto_time_s in its logarithm. The gain never
// exceeds the sensor's own: in a dark scene it stays there, a camera at its limit. What is brighter
// than full scale is metered as full scale, for it is clipped before. Red and blue are balanced to
// green's mean, by a factor within the limit either way.
class AutoExposure {
 public:
  AutoExposure() = default;
  // `interval_s` from one metering to the next.
  AutoExposure(const SensorParams& sensor, double interval_s);

  bool on() const { return params_.auto_level > 0 || params_.auto_white_balance_limit > 1; }
  // That of images with this radiance, by channel, at places all over both views. The cameras have
  // been on for a while: the first is settled.
  Amplification For(std::span<const Eigen::Array3f> radiance_w_m2_sr);

 private:
  Eigen::Array4d CalledFor(std::span<const Eigen::Array3f> radiance_w_m2_sr) const;

  SensorParams params_;
  double share_ = 1;  // of the way to go, from one metering to the next
  bool settled_ = false;
  Eigen::Array4d log_ = Eigen::Array4d::Zero();  // of the latest white balance, and gain
};

}  // namespace turbidock::camera
