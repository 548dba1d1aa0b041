#pragma once
// Automatic exposure: one gain for both cameras, which holds the mean of their images.

#include "sim/camera/sensor_params.h"

namespace turbidock::camera {

// Off unless the sensor has an auto_level. The gain follows what the scene calls for with a first
// order lag of auto_time_s in its logarithm, and never exceeds the sensor's own. In a dark scene it
// stays there: a camera at its limit.
class AutoExposure {
 public:
  AutoExposure() = default;
  // `frame_s` between images.
  AutoExposure(const SensorParams& sensor, double frame_s);

  bool on() const { return params_.auto_level > 0; }
  // The gain of the image whose mean radiance this is, over all pixels and channels of both views.
  // The cameras have been on for a while: the first is settled.
  double GainFor(double mean_radiance_w_m2_sr);

 private:
  SensorParams params_;
  double share_ = 1;  // of the way to go, in one frame
  double gain_ = 0;   // of the latest image; 0 before the first
};

}  // namespace turbidock::camera
