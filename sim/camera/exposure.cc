#include "sim/camera/exposure.h"

#include <algorithm>
#include <cmath>

namespace turbidock::camera {
namespace {

Eigen::Array3d Mean(std::span<const Eigen::Array3f> radiance_w_m2_sr) {
  Eigen::Array3d sum = Eigen::Array3d::Zero();
  for (const Eigen::Array3f& place : radiance_w_m2_sr) sum += place.cast<double>();
  return sum / static_cast<double>(std::max<size_t>(radiance_w_m2_sr.size(), 1));
}

// The gain at which the images' mean is `level`, as shares of full scale, at most `most`. Clipping
// makes that mean a concave function of the gain: from the gain that would do without it, each step
// leads nearer and none too far.
double GainFor(double level, std::span<const Eigen::Array3f> radiance_w_m2_sr,
               const Eigen::Array3d& per_radiance, double most) {
  constexpr int kSteps = 30;
  constexpr double kNear = 1e-6;
  const double unclipped = (Mean(radiance_w_m2_sr) * per_radiance).mean();
  if (unclipped * most <= level) return most;
  double gain = level / unclipped;
  for (int i = 0; i < kSteps && gain < most; ++i) {
    const Eigen::Array3f scale = (gain * per_radiance).cast<float>();
    double lost = 0;
    for (const Eigen::Array3f& place : radiance_w_m2_sr)
      lost += double{(place * scale - 1).max(0).mean()};
    const double held = gain * unclipped - lost / static_cast<double>(radiance_w_m2_sr.size());
    if (held > level * (1 - kNear)) break;
    gain *= level / held;
  }
  return std::min(gain, most);
}

}  // namespace

AutoExposure::AutoExposure(const SensorParams& sensor, double interval_s)
    : params_(sensor),
      share_(sensor.auto_time_s > 0 ? 1 - std::exp(-interval_s / sensor.auto_time_s) : 1) {}

// White balance by channel, then gain.
Eigen::Array4d AutoExposure::CalledFor(std::span<const Eigen::Array3f> radiance_w_m2_sr) const {
  Eigen::Array3d balance = params_.white_balance;
  const Eigen::Array3d mean = Mean(radiance_w_m2_sr) * balance;
  const double limit = params_.auto_white_balance_limit;
  if (mean.minCoeff() > 0) balance *= (mean[1] / mean).max(1 / limit).min(limit);
  double gain = params_.gain;
  if (params_.auto_level > 0)
    gain = GainFor(params_.auto_level, radiance_w_m2_sr,
                   balance / params_.full_scale_radiance_w_m2_sr, gain);
  Eigen::Array4d called_for;
  called_for << balance, gain;
  return called_for;
}

Amplification AutoExposure::For(std::span<const Eigen::Array3f> radiance_w_m2_sr) {
  if (!on()) return {params_.gain, params_.white_balance};
  const Eigen::Array4d called_for = CalledFor(radiance_w_m2_sr).log();
  log_ = settled_ ? log_ + share_ * (called_for - log_) : called_for;
  settled_ = true;
  const Eigen::Array4d now = log_.exp();
  return {now[3], now.head<3>()};
}

}  // namespace turbidock::camera
