#include "sim/camera/exposure.h"

#include <algorithm>
#include <cmath>

namespace turbidock::camera {

AutoExposure::AutoExposure(const SensorParams& sensor, double frame_s)
    : params_(sensor),
      share_(sensor.auto_time_s > 0 ? 1 - std::exp(-frame_s / sensor.auto_time_s) : 1) {}

double AutoExposure::GainFor(double mean_radiance_w_m2_sr) {
  if (!on()) return params_.gain;
  const double bright = params_.auto_level * params_.full_scale_radiance_w_m2_sr;
  const double called_for =
      mean_radiance_w_m2_sr * params_.gain > bright ? bright / mean_radiance_w_m2_sr : params_.gain;
  gain_ = gain_ > 0 ? gain_ * std::pow(called_for / gain_, share_) : called_for;
  return gain_;
}

}  // namespace turbidock::camera
