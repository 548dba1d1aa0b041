#include "control/docking_procedure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/base/check.h"
#include "sim/base/units.h"

namespace turbidock::control {
namespace {

// Less than this is no progress (guess: several times the estimator's noise).
constexpr double kProgress_m = 0.003;

double Mm(double m) { return units::MmFromM(m); }
double Deg(double rad) { return units::DegFromRad(rad); }

// Two balls alone reach an F that is reliable wherever the third is: an estimator that looks for
// their outlines must have said that it sees the marker, and have one answer.
bool IsBorneOut(const PoseEstimate& estimate) {
  return (estimate.detected || estimate.ball_support.empty()) && !estimate.second;
}

void Require(bool condition, const std::string& path, const char* key, const std::string& problem) {
  if (!condition) throw ConfigError(JoinKey(path, key), problem);
}

}  // namespace

void ProcedureParams::Check(const std::string& path) const {
  auto number = [](double x) { return FormatNumber(x); };
  Require(servo_x_m > docking_x_m, path, "servo_x_m",
          number(servo_x_m) + " must be beyond docking_x_m (" + number(docking_x_m) + ")");
  Require(docking_x_m <= docked_x_m, path, "docking_x_m",
          number(docking_x_m) + " must be at most docked_x_m (" + number(docked_x_m) +
              "), or it never docks");
  auto within = [&](const char* key, double limit, const char* bound_key, double bound) {
    Require(limit <= bound, path, key,
            number(limit) + " must be at most " + bound_key + " (" + number(bound) + ")");
  };
  within("enter_y_m", enter_y_m, "allowance_y_m", allowance_y_m);
  within("enter_z_m", enter_z_m, "allowance_z_m", allowance_z_m);
  within("enter_yaw_rad", enter_yaw_rad, "allowance_yaw_rad", allowance_yaw_rad);
  within("lost_fitness", lost_fitness, "found_fitness", found_fitness);
  within("lost_after_s", lost_after_s, "return_to_approach_s", return_to_approach_s);
  within("return_to_approach_s", return_to_approach_s, "give_up_s", give_up_s);
}

DockingProcedure::DockingProcedure(const ProcedureParams& params, const ClockParams& clock,
                                   const ApproachParams& approach)
    : params_(params),
      clock_(clock),
      approach_(approach,
                {params.servo_x_m, params.servo_y_m, params.servo_z_m, params.servo_yaw_rad},
                clock) {
  CheckFields(params_, "");
  CheckFields(clock_, "");
  directive_.desired = {params_.servo_x_m, params_.servo_y_m, params_.servo_z_m,
                        params_.servo_yaw_rad};
}

bool DockingProcedure::WouldGoBlind(const PoseEstimate& estimate) const {
  return directive_.stage == Stage::kDocking && !directive_.given_up &&
         (estimate.fitness < params_.lost_fitness || estimate.second) &&
         estimate.frame - seen_frame_ <= clock_.FramesFor(params_.blind_max_s);
}

const Directive& DockingProcedure::Update(const PoseEstimate& estimate, const Outlook& outlook) {
  TD_CHECK(estimate.X_HM.IsFinite() && std::isfinite(estimate.fitness), "estimate must be finite");
  TD_CHECK(!last_frame_ || estimate.frame > *last_frame_, "frames must increase");
  if (!last_frame_) {
    stage_frame_ = estimate.frame;
    seen_frame_ = estimate.frame - 1;
  }
  const int64_t step = last_frame_ ? estimate.frame - *last_frame_ : 0;
  last_frame_ = estimate.frame;

  Directive& d = directive_;
  d.transition.reset();
  d.control = false;
  d.guide = Guide::kVision;
  d.open_loop = {};
  d.best_fitness = std::max(d.best_fitness, estimate.fitness);
  // While it is steered by the marker, two answers are none.
  d.marker_seen =
      estimate.fitness >= params_.lost_fitness && (IsBeforeFound(d.stage) || !estimate.second);
  d.trusted =
      d.marker_seen && (!IsBeforeFound(d.stage) || estimate.fitness >= params_.found_fitness);
  const bool goes_blind = outlook.predicted_HM && WouldGoBlind(estimate);
  if (d.marker_seen) seen_frame_ = estimate.frame;
  d.frames_lost = estimate.frame - seen_frame_;
  if (d.given_up) return d;

  if (goes_blind) {
    d.control = true;
    d.guide = Guide::kPrediction;
    blind_frames_ += step;
    Dock(estimate.frame, *outlook.predicted_HM);
    return d;
  }
  if (!d.marker_seen) {
    BridgeLoss(estimate, outlook);
    return d;
  }
  d.control = !IsBeforeFound(d.stage);
  switch (d.stage) {
    case Stage::kApproach:
    case Stage::kSearch:
      Find(estimate, outlook);
      break;
    case Stage::kVisualServoing:
      Servo(estimate);
      break;
    case Stage::kDocking:
      ramp_frames_ += step;
      Dock(estimate.frame, AxesPose::Of(estimate.X_HM));
      break;
    case Stage::kDocked:
      Stay(estimate);
      break;
    case Stage::kUndocking:
      ramp_frames_ += step;
      Undock(estimate);
      break;
  }
  return d;
}

void DockingProcedure::Find(const PoseEstimate& estimate, const Outlook& outlook) {
  if (estimate.fitness < params_.found_fitness) {
    held_ = 0;
    SearchOn(estimate.frame, outlook);
    return;
  }
  ++held_;
  if (!HeldFor(params_.found_hold_s) || !IsBorneOut(estimate)) {
    if (approach_.on() && outlook.navigated_MH)
      SteerByNavigation(Inverse(approach_.Hold(estimate.frame, *outlook.navigated_MH)));
    return;
  }
  was_found_ = true;
  Enter(Stage::kVisualServoing, estimate.frame,
        fmt::format(
            "marker found: F >= {:.2f} in {} successive estimates, now F = {:.3f} at x = {:.0f} mm",
            params_.found_fitness, held_, estimate.fitness, Mm(estimate.X_HM.p.x())));
  directive_.control = true;
}

// While the marker is still to be found.
void DockingProcedure::SearchOn(int64_t frame, const Outlook& outlook) {
  if (!approach_.on() || !outlook.navigated_MH) {
    directive_.open_loop = SearchVolts(frame);
    return;
  }
  const AxesPose wanted_MH = approach_.Update(frame, *outlook.navigated_MH);
  const Stage stage = approach_.searching() ? Stage::kSearch : Stage::kApproach;
  if (stage != directive_.stage) Enter(stage, frame, approach_.description());
  SteerByNavigation(Inverse(wanted_MH));
}

void DockingProcedure::SteerByNavigation(const AxesPose& wanted_HM) {
  directive_.control = true;
  directive_.guide = Guide::kNavigation;
  directive_.desired = wanted_HM;
}

void DockingProcedure::Servo(const PoseEstimate& estimate) {
  const AxesPose e = AxesPose::Of(estimate.X_HM) - directive_.desired;
  const bool stable = std::abs(e.x_m) < params_.enter_x_m && std::abs(e.y_m) < params_.enter_y_m &&
                      std::abs(e.z_m) < params_.enter_z_m &&
                      std::abs(e.yaw_rad) < params_.enter_yaw_rad;
  held_ = stable ? held_ + 1 : 0;
  if (!HeldFor(params_.enter_hold_s)) return;
  Enter(
      Stage::kDocking, estimate.frame,
      fmt::format("stable in {} successive estimates: errors x {:+.1f} mm, y {:+.1f} mm, z {:+.1f} "
                  "mm, yaw {:+.1f}°, allowed {:.0f}, {:.0f}, {:.0f} mm and {:.1f}°",
                  held_, Mm(e.x_m), Mm(e.y_m), Mm(e.z_m), Deg(e.yaw_rad), Mm(params_.enter_x_m),
                  Mm(params_.enter_y_m), Mm(params_.enter_z_m), Deg(params_.enter_yaw_rad)));
}

void DockingProcedure::Dock(int64_t frame, const AxesPose& marker) {
  directive_.desired.x_m = std::max(params_.docking_x_m, params_.servo_x_m - RampedX_m());

  const AxesPose e = marker - directive_.desired;
  const struct {
    const char* axis;
    double error, allowed;
    const char* unit;
  } limits[] = {
      {"y", Mm(e.y_m), Mm(params_.allowance_y_m), " mm"},
      {"z", Mm(e.z_m), Mm(params_.allowance_z_m), " mm"},
      {"yaw", Deg(e.yaw_rad), Deg(params_.allowance_yaw_rad), "°"},
  };
  for (const auto& limit : limits) {
    if (std::abs(limit.error) <= limit.allowed) continue;
    BackOff(frame, fmt::format("error exceeds the allowance: {0} {1:+.1f}{3}, allowed {2:.1f}{3}",
                               limit.axis, limit.error, limit.allowed, limit.unit));
    return;
  }

  const double x_m = marker.x_m;
  if (x_m < nearest_x_m_ - kProgress_m || e.x_m <= params_.stuck_x_m) {
    nearest_x_m_ = std::min(nearest_x_m_, x_m);
    nearest_frame_ = frame;
  } else if (const auto frames = clock_.FramesFor(params_.stuck_s);
             frames > 0 && frame - nearest_frame_ >= frames) {
    BackOff(frame,
            fmt::format("stuck for {:g} s at x {:.1f} mm, {:.1f} mm from where it wants to be",
                        params_.stuck_s, Mm(x_m), Mm(e.x_m)));
    return;
  }
  const bool in_dock = x_m <= params_.docked_x_m && std::abs(e.y_m) <= params_.docked_y_m &&
                       std::abs(e.z_m) <= params_.docked_z_m;
  held_ = in_dock ? held_ + 1 : 0;
  if (held_ < params_.docked_hold_frames) return;
  Enter(Stage::kDocked, frame,
        fmt::format("docked in {} successive {}(s): x {:.1f} mm, at most {:.1f} mm, with errors "
                    "y {:+.1f} mm, z {:+.1f} mm, allowed {:.0f} and {:.0f} mm",
                    held_, directive_.guide == Guide::kPrediction ? "prediction" : "estimate",
                    Mm(x_m), Mm(params_.docked_x_m), Mm(e.y_m), Mm(e.z_m), Mm(params_.docked_y_m),
                    Mm(params_.docked_z_m)));
  attempts_ = 0;
  ++directive_.dockings;
  directive_.done = directive_.dockings >= params_.cycles;
}

void DockingProcedure::Stay(const PoseEstimate& estimate) {
  if (directive_.done) return;
  if (estimate.frame - stage_frame_ < clock_.FramesFor(params_.stay_s)) return;
  Enter(Stage::kUndocking, estimate.frame,
        fmt::format("docked {} of {} times", directive_.dockings, params_.cycles));
}

void DockingProcedure::Undock(const PoseEstimate& estimate) {
  directive_.desired.x_m = std::min(params_.servo_x_m, params_.docking_x_m + RampedX_m());
  const double x_m = estimate.X_HM.p.x();
  if (x_m < params_.servo_x_m - params_.enter_x_m) return;
  Enter(Stage::kVisualServoing, estimate.frame, fmt::format("undocked: x {:.1f} mm", Mm(x_m)));
}

double DockingProcedure::RampedX_m() const {
  return params_.docking_rate_mps * static_cast<double>(ramp_frames_) * clock_.frame_s() +
         params_.blind_rate_mps * static_cast<double>(blind_frames_) * clock_.frame_s();
}

void DockingProcedure::BackOff(int64_t frame, const std::string& reason) {
  Enter(Stage::kVisualServoing, frame, reason);
  Directive& d = directive_;
  if (params_.attempts == 0 || attempts_ < params_.attempts) return;
  d.given_up = true;
  d.given_up_reason =
      fmt::format("all {} attempts to dock failed, the last: {}", attempts_, reason);
}

void DockingProcedure::BridgeLoss(const PoseEstimate& estimate, const Outlook& outlook) {
  Directive& d = directive_;
  held_ = 0;
  if (d.stage == Stage::kDocked) return;
  const bool navigates = approach_.on() && outlook.navigated_MH;
  if (was_found_ && !navigates && LostFor(params_.give_up_s)) {
    d.given_up = true;
    d.given_up_reason = LossReason(estimate);
    return;
  }
  switch (d.stage) {
    case Stage::kApproach:
    case Stage::kSearch:
      SearchOn(estimate.frame, outlook);
      break;
    case Stage::kVisualServoing:
      if (LostFor(params_.return_to_approach_s))
        Enter(Stage::kApproach, estimate.frame, LossReason(estimate));
      else if (navigates && LostFor(params_.lost_after_s))
        SteerByNavigation(d.desired);
      break;
    case Stage::kDocking:
      if (LostFor(params_.lost_after_s)) BackOff(estimate.frame, LossReason(estimate));
      break;
    case Stage::kUndocking:
      if (LostFor(params_.lost_after_s))
        Enter(Stage::kVisualServoing, estimate.frame, LossReason(estimate));
      break;
    case Stage::kDocked:
      break;
  }
}

void DockingProcedure::Enter(Stage stage, int64_t frame, std::string reason) {
  Directive& d = directive_;
  d.transition = Transition{frame, d.stage, stage, std::move(reason)};
  d.stage = stage;
  stage_frame_ = frame;
  held_ = 0;
  ramp_frames_ = blind_frames_ = 0;
  if (stage == Stage::kDocking) {
    ++attempts_;
    nearest_x_m_ = params_.servo_x_m + params_.enter_x_m;
    nearest_frame_ = frame;
  }
  if (stage == Stage::kDocked) return;
  d.desired = {stage == Stage::kUndocking ? params_.docking_x_m : params_.servo_x_m,
               params_.servo_y_m, params_.servo_z_m, params_.servo_yaw_rad};
  if (stage == Stage::kApproach && d.transition->from != Stage::kSearch) approach_.Begin();
}

AxisVolts DockingProcedure::SearchVolts(int64_t frame) const {
  const double t_s =
      static_cast<double>(frame - stage_frame_) * clock_.frame_s() - params_.search_neutral_s;
  if (t_s < 0) return {};
  // cosine: the heading swings to both sides of where it began
  const double phase = 2 * std::numbers::pi * t_s / params_.search_period_s;
  return {.yaw_v = params_.search_yaw_v * std::cos(phase)};
}

bool DockingProcedure::HeldFor(double seconds) const {
  return held_ >= std::max<int64_t>(1, clock_.FramesFor(seconds));
}

bool DockingProcedure::LostFor(double seconds) const {
  return directive_.frames_lost >= clock_.FramesFor(seconds);
}

std::string DockingProcedure::LossReason(const PoseEstimate& estimate) const {
  const int64_t lost = directive_.frames_lost;
  return fmt::format("marker lost: F < {:.2f}{} for {} frames ({:.2f} s), now F = {:.3f}",
                     params_.lost_fitness, estimate.second ? " or two poses that fit" : "", lost,
                     static_cast<double>(lost) * clock_.frame_s(), estimate.fitness);
}

}  // namespace turbidock::control
