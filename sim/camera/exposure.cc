#include "sim/camera/exposure.h"

#include <algorithm>
#include <cmath>

namespace turbidock::camera {

AutoExposure::AutoExposure(const SensorParams& sensor, double interval_s)
    : params_(sensor),
      share_(sensor.auto_time_s > 0 ? 1 - std::exp(-interval_s / sensor.auto_time_s) : 1) {}

// White balance by channel, then gain.
Eigen::Array4d AutoExposure::CalledFor(const Eigen::Array3d& mean_radiance_w_m2_sr) const {
  Eigen::Array3d balance = params_.white_balance;
  const Eigen::Array3d mean = mean_radiance_w_m2_sr * balance;
  const double limit = params_.auto_white_balance_limit;
  if (mean.minCoeff() > 0) balance *= (mean[1] / mean).max(1 / limit).min(limit);
  const double bright = params_.auto_level * params_.full_scale_radiance_w_m2_sr;
  const double balanced_mean = (mean_radiance_w_m2_sr * balance).mean();
  const bool lower = bright > 0 && balanced_mean * params_.gain > bright;
  Eigen::Array4d called_for;
  called_for << balance, lower ? bright / balanced_mean : params_.gain;
  return called_for;
}

Amplification AutoExposure::For(const Eigen::Array3d& mean_radiance_w_m2_sr) {
  if (!on()) return {params_.gain, params_.white_balance};
  const Eigen::Array4d called_for = CalledFor(mean_radiance_w_m2_sr).log();
  log_ = settled_ ? log_ + share_ * (called_for - log_) : called_for;
  settled_ = true;
  const Eigen::Array4d now = log_.exp();
  return {now[3], now.head<3>()};
}

}  // namespace turbidock::camera
