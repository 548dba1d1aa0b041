#include "control/lqg.h"

#include <algorithm>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::control {
namespace {

// Levers that gains are designed for: the marker 0.2 to 1.8 m ahead of the point of turning.
const std::vector<double> kLevers_m = {0.2, 0.4, 0.6, 0.9, 1.3, 1.8};

// The model divides by the thrusters' lag.
constexpr double kShortestLag_s = 0.001;

// Guess: two waves, and less than servoing takes.
constexpr double kUsualTime_s = 5;

}  // namespace

Lqg::Lqg(const LqgParams& params, const VehicleModel& vehicle, const ClockParams& clock)
    : params_(params), head_ahead_m_(vehicle.head_ahead_m), clock_(clock) {
  CheckFields(params_, "");
  const ForceAllocation allocation(params_.allocation, vehicle);
  const Axes damping = vehicle.DampingAt({params_.surge.drift_mps, params_.sway.drift_mps,
                                          params_.heave.drift_mps, params_.yaw.drift_rad_s});
  // What translations and yaw have in common.
  const auto of = [&](Axis axis, const auto& p) {
    const double inertia = vehicle.inertia[axis];
    LqgAxis of_axis;
    of_axis.model = {.inertia = inertia,
                     .damping = damping[axis],
                     .lag_s = std::max(vehicle.thruster_lag_s, kShortestLag_s),
                     .current_time_s = params_.current_time_s,
                     .wave_period_s = params_.wave_period_s,
                     .wave_damping = params_.wave_damping};
    of_axis.effort = p.effort_share * allocation.authority()[axis];
    of_axis.least = p.limit_share * allocation.most_back()[axis];
    of_axis.most = p.limit_share * allocation.most()[axis];
    return of_axis;
  };
  const auto translation = [&](Axis axis, const LqgParams::Translation& p) {
    LqgAxis of_axis = of(axis, p);
    of_axis.model.current_std = of_axis.model.inertia * p.current_mps2;
    of_axis.model.wave_std = of_axis.model.inertia * p.wave_mps2;
    of_axis.model.disturbance_rate = p.unknown_mps2;
    of_axis.error = p.error_m;
    of_axis.speed = p.speed_mps;
    of_axis.noise = p.noise_m;
    return of_axis;
  };
  const LqgParams::Yaw& y = params_.yaw;
  LqgAxis yaw = of(kYaw, y);
  yaw.model.current_std = yaw.model.inertia * y.current_rad_s2;
  yaw.model.wave_std = yaw.model.inertia * y.wave_rad_s2;
  yaw.model.disturbance_rate = y.unknown_rad_s2;
  yaw.error = y.error_rad;
  yaw.speed = y.speed_rad_s;
  yaw.noise = y.noise_rad;
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
      throw ConfigError(keys, "there is no controller for these values: " + error.problem());
    }
  };
  add(design("control.lqg.surge", {translation(kSurge, params_.surge)}, {0}), {kSurge});
  add(design("control.lqg.heave", {translation(kHeave, params_.heave)}, {0}), {kHeave});
  add(design("control.lqg.sway, control.lqg.yaw", {translation(kSway, params_.sway), yaw},
             kLevers_m),
      {kSway, kYaw});
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

double Lqg::lever_m() const { return head_ahead_m_ - parts_[0].loop.position(0); }

void Lqg::Observe(const Observation& seen) {
  TD_CHECK(!frame_ || seen.frame > *frame_, "frames must increase");
  if (!frame_) {
    Start(seen);
    return;
  }
  MoveOn(seen.frame);
  const double lever = lever_m();
  double surprise = 0;
  for (Part& part : parts_) {
    Measure(seen.position, &part);
    surprise = std::max(surprise, part.loop.Surprise(part.position, lever));
  }
  if (surprise <= params_.gate_sigma) {
    for (Part& part : parts_) part.loop.Correct(part.position, lever);
    used_frame_ = seen.frame;
    LearnCurrent();
  } else if (seen.frame - used_frame_ >= params_.restart_frames) {
    Start(seen);
  }
}

void Lqg::MoveOn(int64_t frame) {
  // A command made of the image of frame f acts latency_frames later.
  for (; *frame_ < frame; ++*frame_) {
    const Axes given = GivenAt(*frame_ - params_.latency_frames);
    const double lever = lever_m();
    for (Part& part : parts_) {
      part.Gather(given, &part.force);
      part.loop.Predict(part.force, lever);
    }
  }
}

void Lqg::LearnCurrent() {
  const double share = std::max(1.0 / static_cast<double>(++currents_),
                                -std::expm1(-clock_.frame_s() / kUsualTime_s));
  for (const Part& part : parts_)
    for (size_t i = 0; i < part.axes.size(); ++i) {
      double& usual = usual_current_[part.axes[i]];
      usual += share * (part.loop.current(static_cast<Eigen::Index>(i)) - usual);
    }
}

std::optional<Axes> Lqg::Predict(int64_t frame) {
  if (!frame_) return std::nullopt;
  for (Part& part : parts_)
    for (size_t i = 0; i < part.axes.size(); ++i)
      part.loop.SetCurrent(static_cast<Eigen::Index>(i), usual_current_[part.axes[i]]);
  MoveOn(frame);
  Axes marker;
  for (const Part& part : parts_)
    for (size_t i = 0; i < part.axes.size(); ++i)
      marker[part.axes[i]] = -part.loop.position(static_cast<Eigen::Index>(i));
  marker[kYaw] = WrapAngle(marker[kYaw]);
  return marker;
}

void Lqg::Start(const Observation& seen) {
  frame_ = used_frame_ = seen.frame;
  for (Part& part : parts_) {
    part.Gather(-seen.position, &part.position);
    part.loop.Start(part.position);
  }
}

Axes Lqg::Demand(const Reference& wanted) {
  TD_CHECK(frame_, "nothing has been observed");
  const double lever = lever_m();
  Axes demand;
  for (Part& part : parts_) {
    part.loop.StartAhead();
    for (int64_t f = *frame_ - params_.latency_frames; f < *frame_; ++f) {
      part.Gather(GivenAt(f), &part.force);
      part.loop.Ahead(part.force, lever);
    }
    Measure(wanted.position, &part);
    part.Gather(-wanted.rate, &part.speed);
    part.Gather(-wanted.acceleration, &part.acceleration);
    const Eigen::VectorXd& force =
        part.loop.Demand(part.position, part.speed, part.acceleration, lever);
    for (size_t i = 0; i < part.axes.size(); ++i)
      demand[part.axes[i]] = force[static_cast<Eigen::Index>(i)];
  }
  return demand;
}

void Lqg::OnCommandApplied(int64_t frame, const Axes& given) {
  TD_CHECK(!last_given_ || frame > *last_given_, "frames must increase");
  if (!first_given_) first_given_ = frame;
  // Frames without a word: the last command stayed.
  const int64_t from = last_given_ ? *last_given_ + 1 : frame;
  const Axes before = last_given_ ? GivenAt(*last_given_) : Axes::Zero();
  for (int64_t f = std::max(from, frame - std::ssize(given_)); f < frame; ++f) *Slot(f) = before;
  *Slot(frame) = given;
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
