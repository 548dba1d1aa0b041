#include "control/pose_filter.h"

#include <algorithm>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::control {

PoseFilter::PoseFilter(const PoseFilterParams& params, const ClockParams& clock)
    : params_(params), clock_(clock) {
  CheckFields(params_, "");
}

std::optional<Observation> PoseFilter::Update(const Observation& seen) {
  TD_CHECK(!last_frame_ || seen.frame > *last_frame_, "frames must increase");
  if (!params_.enabled) return seen;
  if (!last_frame_ || seen.frame - *last_frame_ > params_.restart_frames) {
    Start(seen);
  } else {
    for (; *last_frame_ < seen.frame; ++*last_frame_)
      for (int i = 0; i < kAxisCount; ++i)
        Predict(params_.acceleration[i], &states_[static_cast<size_t>(i)]);
    Axes innovation;
    bool outlier = false;
    for (int i = 0; i < kAxisCount; ++i) {
      const AxisState& s = states_[static_cast<size_t>(i)];
      innovation[i] = seen.position[i] - s.position;
      if (i == kYaw) innovation[i] = WrapAngle(innovation[i]);
      const double variance = s.pp + NoiseVariance(seen, i);
      outlier |= std::abs(innovation[i]) > params_.gate_sigma * std::sqrt(variance);
    }
    if (outlier && ++rejected_ < params_.restart_frames) return std::nullopt;
    if (outlier) {
      Start(seen);
    } else {
      rejected_ = 0;
      for (int i = 0; i < kAxisCount; ++i) {
        AxisState& s = states_[static_cast<size_t>(i)];
        const double variance = s.pp + NoiseVariance(seen, i);
        const double gain_p = s.pp / variance, gain_r = s.pr / variance;
        s.position += gain_p * innovation[i];
        s.rate += gain_r * innovation[i];
        s.rr -= gain_r * s.pr;
        s.pr -= gain_p * s.pr;
        s.pp -= gain_p * s.pp;
      }
    }
  }
  Observation filtered{.frame = seen.frame, .rate = Axes::Zero()};
  for (int i = 0; i < kAxisCount; ++i) {
    const AxisState& s = states_[static_cast<size_t>(i)];
    filtered.position[i] = s.position + params_.latency_s * s.rate;
    (*filtered.rate)[i] = s.rate;
  }
  filtered.position[kYaw] = WrapAngle(filtered.position[kYaw]);
  return filtered;
}

// Never less than the parameters': they hold what the estimator cannot know, such as waves.
double PoseFilter::NoiseVariance(const Observation& seen, int axis) const {
  const double own = params_.noise[axis] * params_.noise[axis];
  return seen.variance ? std::max(own, (*seen.variance)[axis]) : own;
}

void PoseFilter::Start(const Observation& seen) {
  last_frame_ = seen.frame;
  rejected_ = 0;
  for (int i = 0; i < kAxisCount; ++i) {
    // at rest, give or take what a second of acceleration makes
    const double speed = params_.acceleration[i];
    states_[static_cast<size_t>(i)] = {
        .position = seen.position[i], .pp = NoiseVariance(seen, i), .rr = speed * speed};
  }
}

void PoseFilter::Predict(double acceleration_std, AxisState* state) const {
  const double t = clock_.frame_s(), q = acceleration_std * acceleration_std;
  AxisState& s = *state;
  s.position += t * s.rate;
  s.pp += t * (2 * s.pr + t * s.rr) + q * t * t * t * t / 4;
  s.pr += t * s.rr + q * t * t * t / 2;
  s.rr += q * t * t;
}

}  // namespace turbidock::control
