#include "control/navigator.h"

#include <cmath>

#include "sim/base/check.h"

namespace turbidock::control {
namespace {

constexpr double kLearningTime_s = 0.5;  // guess: longer than the estimator's noise lasts

}  // namespace

AlphaBeta SteadyGains(double noise, double acceleration, double gap_s) {
  const double index = acceleration * gap_s * gap_s / noise;
  const double r = (4 + index - std::sqrt(index * (8 + index))) / 4;
  return {.alpha = 1 - r * r, .beta = 2 * (1 - r) * (1 - r)};
}

Navigator::Navigator(const NavigatorParams& params, const ClockParams& clock)
    : params_(params), clock_(clock) {
  CheckFields(params_, "");
}

void Navigator::Update(int64_t frame, const std::optional<NavigationReading>& reading) {
  TD_CHECK(!frame_ || frame > *frame_, "frames must increase");
  const double step_s = frame_ ? static_cast<double>(frame - *frame_) * clock_.frame_s() : 0;
  for (Track& track : tracks_) track.position += step_s * track.rate;
  tracks_[kYaw].position = WrapAngle(tracks_[kYaw].position);
  frame_ = frame;
  if (!reading) return;
  if (reading->fix_xy_m) {
    Read(kSurge, reading->fix_xy_m->x(), reading->fix_std_m);
    Read(kSway, reading->fix_xy_m->y(), reading->fix_std_m);
  }
  Read(kHeave, reading->z_m, reading->z_std_m);
  Read(kYaw, reading->heading_rad, reading->heading_std_rad);
}

void Navigator::Read(Axis axis, double value, double noise) {
  Track& track = tracks_[static_cast<size_t>(axis)];
  const bool angle = axis == kYaw;
  const double gap_s =
      track.frame ? static_cast<double>(*frame_ - *track.frame) * clock_.frame_s() : 0;
  if (!track.frame || gap_s > params_.max_age_s) {
    track = {.position = value, .rate = 0, .frame = frame_};
    return;
  }
  const auto [alpha, beta] =
      SteadyGains(noise, angle ? params_.acceleration_rad_s2 : params_.acceleration_mps2, gap_s);
  const double difference = value - track.position;
  const double innovation = angle ? WrapAngle(difference) : difference;
  track.position += alpha * innovation;
  track.rate += beta / gap_s * innovation;
  track.frame = frame_;
}

void Navigator::Correct(const AxesPose& marker_in_head) {
  const std::optional<Navigated> now = pose();
  if (!now) return;
  const AxesPose off = Inverse(marker_in_head) - now->pose_MH;
  const double share = -std::expm1(-clock_.frame_s() / kLearningTime_s);
  correction_.x_m += share * off.x_m;
  correction_.y_m += share * off.y_m;
  correction_.z_m += share * off.z_m;
  correction_.yaw_rad = WrapAngle(correction_.yaw_rad + share * off.yaw_rad);
}

std::optional<Navigated> Navigator::pose() const {
  const std::optional<int64_t>& fix = tracks_[kSurge].frame;
  if (!fix || static_cast<double>(*frame_ - *fix) * clock_.frame_s() > params_.max_age_s)
    return std::nullopt;
  Navigated now;
  for (int i = 0; i < kAxisCount; ++i) now.rate_M[i] = tracks_[static_cast<size_t>(i)].rate;
  now.pose_MH = {.x_m = tracks_[kSurge].position + correction_.x_m,
                 .y_m = tracks_[kSway].position + correction_.y_m,
                 .z_m = tracks_[kHeave].position + correction_.z_m,
                 .yaw_rad = WrapAngle(tracks_[kYaw].position + correction_.yaw_rad)};
  return now;
}

}  // namespace turbidock::control
