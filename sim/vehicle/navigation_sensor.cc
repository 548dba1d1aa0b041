#include "sim/vehicle/navigation_sensor.h"

#include <cmath>

#include "sim/base/check.h"

namespace turbidock::vehicle {

NavigationParams NavigationParams::Of(NavigationPreset preset) {
  NavigationParams params;
  params.preset = preset;
  switch (preset) {
    case NavigationPreset::kDvl:
    case NavigationPreset::kNever:
      break;
    case NavigationPreset::kUsbl:
      params.position_bias_std_m = 0.3;    // guess: a degree of the transceiver's heading at 20 m
      params.position_walk_m = 0.005;      // guess
      params.travel_error_std = 0;         // it counts no way
      params.position_noise_std_m = 0.05;  // LinkQuest at 20 m, and SeaTrac's decimetres
      params.rate_hz = 1;                  // guess: 0.5 to 2
      params.dropout_share = 0.1;          // guess: the station's own shadow and echoes
      params.dropout_s = 3;                // guess
      break;
    case NavigationPreset::kDeadReckoning:
      params.position_bias_std_m = 0.2;      // guess
      params.position_drift_std_mps = 0.01;  // guess: half of a slack tide
      params.position_walk_m = 0.01;         // guess
      params.travel_error_std = 0.1;         // guess: drag is known to a few tenths, see facts
      params.dropout_share = 0;              // it needs nothing from outside
      params.heading_bias_std_rad = 0.087;   // guess: 5 degrees
      params.position_noise_std_m = 0.005;
      break;
    case NavigationPreset::kPilot:
      params.position_bias_std_m = 0.1;  // guess: as good as the published starts
      params.position_walk_m = 0.01;     // guess
      params.travel_error_std = 0;
      params.position_noise_std_m = 0.05;  // guess
      params.rate_hz = 2;                  // guess: a look twice a second
      params.dropout_share = 0;
      params.depth_bias_std_m = 0.05;       // guess
      params.depth_noise_std_m = 0.02;      // guess
      params.heading_bias_std_rad = 0.087;  // guess: 5 degrees
      params.heading_noise_std_rad = 0.02;  // guess
      break;
  }
  return params;
}

NavigationSensor::NavigationSensor(const NavigationParams& params, const Rng& rng)
    : params_(params), rng_(rng) {
  CheckFields(params_, "navigation");
  bias_m_ = params_.position_bias_std_m * TwoNormals();
  drift_mps_ = params_.position_drift_std_mps * TwoNormals();
  travel_error_ = params_.travel_error_std * TwoNormals();
  const Eigen::Vector2d depth_and_heading = TwoNormals();
  depth_bias_m_ = params_.depth_bias_std_m * depth_and_heading.x();
  heading_error_rad_ = params_.heading_bias_std_rad * depth_and_heading.y();
  dropped_out_ = rng_.Uniform() < params_.dropout_share;
}

Eigen::Vector2d NavigationSensor::TwoNormals() {
  const double first = rng_.Normal();
  return {first, rng_.Normal()};
}

// The errors that grow, up to a time and a place.
void NavigationSensor::Move(double time_s, const Eigen::Vector2d& true_xy_m) {
  const double step_s = last_s_ ? time_s - *last_s_ : 0;
  TD_CHECK(!last_s_ || step_s > 0, "times must increase");
  if (!last_s_) {
    first_s_ = next_fix_s_ = time_s;
    last_xy_m_ = true_xy_m;
  }
  const Eigen::Vector2d way_m = true_xy_m - last_xy_m_;
  lag_m_ += travel_error_.x() * way_m + travel_error_.y() * Eigen::Vector2d(-way_m.y(), way_m.x());
  walk_m_ += params_.position_walk_m * std::sqrt(step_s) * TwoNormals();
  heading_error_rad_ += params_.heading_walk_rad * std::sqrt(step_s) * rng_.Normal();
  // Two states with exponential stays, of means dropout_s and what gives the share: the chance to
  // be in one of them tends to its share at the sum of their rates.
  const double share = params_.dropout_share;
  const double memory = std::exp(-step_s / (params_.dropout_s * (1 - share)));
  dropped_out_ = rng_.Uniform() < share + ((dropped_out_ ? 1 : 0) - share) * memory;
  last_s_ = time_s;
  last_xy_m_ = true_xy_m;
}

std::optional<NavigationReading> NavigationSensor::Read(double time_s, const Pose& true_X_MH) {
  const Eigen::Vector2d true_xy_m = true_X_MH.p.head<2>();
  Move(time_s, true_xy_m);
  const Eigen::Vector2d noise = TwoNormals(), noise_zh = TwoNormals();
  if (params_.preset == NavigationPreset::kNever) return std::nullopt;

  NavigationReading reading{.z_std_m = params_.depth_noise_std_m,
                            .heading_std_rad = params_.heading_noise_std_rad,
                            .fix_std_m = params_.position_noise_std_m};
  reading.z_m = true_X_MH.p.z() + depth_bias_m_ + params_.depth_noise_std_m * noise_zh.x();
  reading.heading_rad = WrapAngle(YawOf(true_X_MH.q) + heading_error_rad_ +
                                  params_.heading_noise_std_rad * noise_zh.y());
  // Times are sums of fractions: forgive their rounding.
  constexpr double kRounding_s = 1e-9;
  if (time_s < next_fix_s_ - kRounding_s) return reading;
  next_fix_s_ += 1 / params_.rate_hz;
  if (next_fix_s_ <= time_s) next_fix_s_ = time_s;  // more fixes than readings
  if (!dropped_out_)
    reading.fix_xy_m = true_xy_m + bias_m_ + drift_mps_ * (time_s - *first_s_) + lag_m_ + walk_m_ +
                       params_.position_noise_std_m * noise;
  return reading;
}

}  // namespace turbidock::vehicle
