#include "control/approach.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sim/base/check.h"

namespace turbidock::control {

void ApproachParams::Check(const std::string& path) const {
  if (mode == ApproachMode::kNavigation && !(nearest_x_m < staging_x_m))
    throw ConfigError(JoinKey(path, "nearest_x_m"),
                      fmt::format("{} must be nearer than staging_x_m ({})",
                                  FormatNumber(nearest_x_m), FormatNumber(staging_x_m)));
}

double ApproachParams::closest_x_m() const { return NearestX_m(*this, std::max(1, box_steps) - 1); }

double NearestX_m(const ApproachParams& params, int round) {
  if (params.box_steps == 0) return params.nearest_x_m;
  return params.nearest_x_m - params.closer_m * (round % params.box_steps);
}

Eigen::Vector2d BoxCorner(const ApproachParams& params, int round, int leg) {
  TD_CHECK(leg >= 0 && leg < kBoxLegs && params.box_steps > 0, "a leg of a box");
  // Right is the negative y.
  constexpr std::array<std::array<int, 2>, kBoxLegs> kCorners = {
      {{-1, 0}, {-1, 1}, {1, 1}, {1, -1}, {-1, -1}, {0, 0}}};
  const double half_m = params.box_step_m * (1 + round % params.box_steps);
  const auto& [right, up] = kCorners[static_cast<size_t>(leg)];
  return {half_m * right, half_m * params.box_height_share * up};
}

Approach::Approach(const ApproachParams& params, const AxesPose& axis_HM, const ClockParams& clock)
    : params_(params), axis_HM_(axis_HM), clock_(clock) {
  CheckFields(params_, "");
}

void Approach::Begin() {
  begun_ = held_ = false;
  last_frame_.reset();
}

const AxesPose& Approach::Update(int64_t frame, const AxesPose& now_MH) {
  TD_CHECK(!last_frame_ || frame > *last_frame_, "frames must increase");
  if (!begun_) {
    begun_ = true;
    Enter(params_.mode == ApproachMode::kPilot ? Leg::kAxis : Leg::kStaging, now_MH);
  } else if (last_frame_ && !held_) {
    leg_frames_ += frame - *last_frame_;
  }
  held_ = false;
  last_frame_ = frame;
  wanted_MH_ = Goal();
  if (Arrived(now_MH)) {
    Next(now_MH);
    wanted_MH_ = Goal();
  }
  return wanted_MH_;
}

const AxesPose& Approach::Hold(int64_t frame, const AxesPose& now_MH) {
  if (!held_) wanted_MH_ = now_MH;
  held_ = true;
  last_frame_ = frame;
  return wanted_MH_;
}

void Approach::Enter(Leg leg, const AxesPose& now_MH) {
  leg_ = leg;
  leg_frames_ = 0;
  from_x_m_ = std::max(nearest_x_m(), Inverse(now_MH).x_m);
  if (params_.mode == ApproachMode::kNavigation) from_x_m_ = params_.staging_x_m;
}

AxesPose Approach::OnAxis(double x_m) const {
  return Inverse({x_m, axis_HM_.y_m, axis_HM_.z_m, axis_HM_.yaw_rad});
}

AxesPose Approach::Goal() const {
  AxesPose goal = OnAxis(nearest_x_m());
  switch (leg_) {
    case Leg::kStaging:
      return OnAxis(params_.staging_x_m);
    case Leg::kAxis:
      return OnAxis(std::max(nearest_x_m(), from_x_m_ - params_.advance_mps * leg_s()));
    case Leg::kSweep:
      goal.yaw_rad +=
          params_.sweep_rad * std::sin(2 * std::numbers::pi * leg_s() / params_.sweep_period_s);
      return goal;
    case Leg::kBox: {
      const Eigen::Vector2d corner = BoxCorner(params_, round_, corner_);
      goal.y_m += corner.x();
      goal.z_m += corner.y();
      return goal;
    }
  }
  TD_CHECK(false, "unknown leg");
}

bool Approach::Arrived(const AxesPose& now_MH) const {
  if (leg_ == Leg::kSweep) return leg_s() >= params_.sweep_period_s;
  // The goal moves along the axis until then.
  const double moves_s = leg_ == Leg::kAxis ? (from_x_m_ - nearest_x_m()) / params_.advance_mps : 0;
  if (leg_s() < moves_s) return false;
  return (now_MH - wanted_MH_).distance_m() <= params_.arrived_m ||
         leg_s() - moves_s >= params_.leg_time_s;
}

void Approach::Next(const AxesPose& now_MH) {
  switch (leg_) {
    case Leg::kStaging:
      return Enter(Leg::kAxis, now_MH);
    case Leg::kAxis:
      return Enter(Leg::kSweep, now_MH);
    case Leg::kSweep:
      if (params_.mode == ApproachMode::kPilot) {
        ++round_;
        return Enter(Leg::kAxis, now_MH);
      }
      if (params_.box_steps == 0) return Enter(Leg::kStaging, now_MH);
      corner_ = 0;
      return Enter(Leg::kBox, now_MH);
    case Leg::kBox:
      if (++corner_ < kBoxLegs) return Enter(Leg::kBox, now_MH);
      ++round_;
      return Enter(Leg::kStaging, now_MH);
  }
}

std::string Approach::description() const {
  if (leg_ == Leg::kStaging)
    return round_ > 0 ? fmt::format("not found, back off to {:.1f} m", params_.staging_x_m)
                      : fmt::format("to {:.1f} m before the marker", params_.staging_x_m);
  return fmt::format("not found {:.1f} m before the marker", nearest_x_m());
}

Hand::Hand(const ApproachParams& params, const ClockParams& clock)
    : params_(params), clock_(clock) {}

Axes Hand::Move(int64_t frame, const Axes& wanted, const Axes& most) {
  const double since_s =
      moved_ ? static_cast<double>(frame - *moved_) * clock_.frame_s() : params_.hand_interval_s;
  // What was decided shows a reaction later, at the latest when the next movement is decided.
  if (moved_ && since_s >= std::min(params_.hand_delay_s, params_.hand_interval_s))
    given_ = decided_;
  if (since_s < params_.hand_interval_s) return given_;
  moved_ = frame;
  const Axes step = params_.hand_step_share * most;
  decided_ = wanted.cwiseQuotient(step).array().round().matrix().cwiseProduct(step);
  if (params_.hand_delay_s == 0) given_ = decided_;
  return given_;
}

}  // namespace turbidock::control
