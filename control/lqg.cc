#include "control/lqg.h"

#include <algorithm>

#include "sim/base/check.h"

namespace turbidock::control {
namespace {

// Levers that gains are designed for: the marker 0.2 to 1.8 m ahead of the point of turning.
const std::vector<double> kLevers_m = {0.2, 0.4, 0.6, 0.9, 1.3, 1.8};

}  // namespace

Lqg::Lqg(const LqgParams& params, const ClockParams& clock) : params_(params), clock_(clock) {
  CheckFields(params_, "");
  const auto complete = [this](LqgAxis axis) {
    axis.model.lag_s = params_.thruster_lag_s;
    axis.model.current_time_s = params_.current_time_s;
    axis.model.wave_period_s = params_.wave_period_s;
    axis.model.wave_damping = params_.wave_damping;
    axis.model.disturbance_rate = params_.unknown_acceleration;
    return axis;
  };
  const auto translation = [&](const LqgParams::Translation& p) {
    return complete({.model = {.inertia = p.mass_kg,
                               .damping = p.damping_newton_s_per_m,
                               .thrust_per_volt = p.thrust_newton_per_v,
                               .current_std = p.current_newton,
                               .wave_std = p.wave_newton},
                     .error = p.error_m,
                     .speed = p.speed_mps,
                     .effort_v = p.effort_v,
                     .noise = p.noise_m,
                     .limit_v = p.limit_v});
  };
  const LqgParams::Yaw& y = params_.yaw;
  const LqgAxis yaw = complete({.model = {.inertia = y.inertia_kg_m2,
                                          .damping = y.damping_newton_m_s,
                                          .thrust_per_volt = y.moment_newton_m_per_v,
                                          .current_std = y.current_newton_m,
                                          .wave_std = y.wave_newton_m},
                                .error = y.error_rad,
                                .speed = y.speed_rad_s,
                                .effort_v = y.effort_v,
                                .noise = y.noise_rad,
                                .limit_v = y.limit_v});
  const double dt_s = clock_.frame_s();
  const auto add = [this](LqgLoop loop, std::vector<Axis> axes) {
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(std::ssize(axes));
    parts_.push_back({std::move(loop), std::move(axes), zero, zero, zero, zero});
  };
  const auto design = [dt_s](const char* keys, const std::vector<LqgAxis>& axes,
                             const std::vector<double>& levers) {
    try {
      return LqgLoop(axes, levers, dt_s);
    } catch (const ConfigError& error) {
      throw ConfigError(keys, "there is no law for these values: " + error.problem());
    }
  };
  add(design("lqg.surge", {translation(params_.surge)}, {0}), {kSurge});
  add(design("lqg.heave", {translation(params_.heave)}, {0}), {kHeave});
  add(design("lqg.sway, lqg.yaw", {translation(params_.sway), yaw}, kLevers_m), {kSway, kYaw});
  // As far back as a filter looks that has not been updated for long.
  given_.resize(static_cast<size_t>(params_.latency_frames) +
                static_cast<size_t>(params_.restart_frames) + 2);
}

void Lqg::Part::Gather(const Axes& all, Eigen::VectorXd* some) const {
  for (size_t i = 0; i < axes.size(); ++i) (*some)[static_cast<Eigen::Index>(i)] = all[axes[i]];
}

void Lqg::Measure(const Axes& marker, Part* part) const {
  part->Gather(-marker, &part->position);
  for (size_t i = 0; i < part->axes.size(); ++i) {
    if (part->axes[i] != kYaw) continue;
    const auto at = static_cast<Eigen::Index>(i);
    const double now = part->loop.position(at);
    part->position[at] = now + WrapAngle(part->position[at] - now);
  }
}

double Lqg::lever_m() const { return params_.head_offset_m - parts_[0].loop.position(0); }

void Lqg::Observe(const Observation& seen) {
  TD_CHECK(!frame_ || seen.frame > *frame_, "frames must increase");
  if (!frame_) {
    Start(seen);
    return;
  }
  // A command made of the image of frame f acts latency_frames later.
  for (; *frame_ < seen.frame; ++*frame_) {
    const Axes volts = GivenAt(*frame_ - params_.latency_frames);
    const double lever = lever_m();
    for (Part& part : parts_) {
      part.Gather(volts, &part.volts);
      part.loop.Predict(part.volts, lever);
    }
  }
  const double lever = lever_m();
  double surprise = 0;
  for (Part& part : parts_) {
    Measure(seen.position, &part);
    surprise = std::max(surprise, part.loop.Surprise(part.position, lever));
  }
  if (surprise <= params_.gate_sigma) {
    for (Part& part : parts_) part.loop.Correct(part.position, lever);
    used_frame_ = seen.frame;
  } else if (seen.frame - used_frame_ >= params_.restart_frames) {
    Start(seen);
  }
}

void Lqg::Start(const Observation& seen) {
  frame_ = used_frame_ = seen.frame;
  for (Part& part : parts_) {
    part.Gather(-seen.position, &part.position);
    part.loop.Start(part.position);
  }
}

AxisVolts Lqg::Demand(const Reference& wanted) {
  TD_CHECK(frame_, "nothing has been observed");
  const double lever = lever_m();
  Axes demand;
  for (Part& part : parts_) {
    part.loop.StartAhead();
    for (int64_t f = *frame_ - params_.latency_frames; f < *frame_; ++f) {
      part.Gather(GivenAt(f), &part.volts);
      part.loop.Ahead(part.volts, lever);
    }
    Measure(wanted.position, &part);
    part.Gather(-wanted.rate, &part.speed);
    part.Gather(-wanted.acceleration, &part.acceleration);
    const Eigen::VectorXd& volts =
        part.loop.Demand(part.position, part.speed, part.acceleration, lever);
    for (size_t i = 0; i < part.axes.size(); ++i)
      demand[part.axes[i]] = volts[static_cast<Eigen::Index>(i)];
  }
  return ToAxisVolts(demand);
}

void Lqg::Given(int64_t frame, const AxisVolts& volts) {
  TD_CHECK(!last_given_ || frame > *last_given_, "frames must increase");
  if (!first_given_) first_given_ = frame;
  // Frames without a word: the last command stayed.
  const int64_t from = last_given_ ? *last_given_ + 1 : frame;
  const Axes before = last_given_ ? GivenAt(*last_given_) : Axes::Zero();
  for (int64_t f = std::max(from, frame - std::ssize(given_)); f < frame; ++f) *Slot(f) = before;
  *Slot(frame) = ToAxes(volts);
  last_given_ = frame;
}

Axes* Lqg::Slot(int64_t frame) {
  const int64_t n = std::ssize(given_);
  return &given_[static_cast<size_t>((frame % n + n) % n)];
}

Axes Lqg::GivenAt(int64_t frame) {
  if (!last_given_ || frame > *last_given_ || frame < *first_given_ ||
      frame <= *last_given_ - std::ssize(given_))
    return Axes::Zero();
  return *Slot(frame);
}

}  // namespace turbidock::control
