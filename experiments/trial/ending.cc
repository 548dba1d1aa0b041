#include "experiments/trial/ending.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <vector>

#include "experiments/report/table.h"
#include "sim/base/units.h"

namespace turbidock::trial {
namespace {

using control::Stage;

// What a jam adds to a reason.
std::string JamRemark(const TrialResult& result) {
  return result.jam_time_s
             ? fmt::format("; the pole jammed in the dock at {:.1f} s", *result.jam_time_s)
             : "";
}

// What a navigation that was silent adds.
std::string NavigationRemark(const Scenario& scenario, const TrialResult& result) {
  const bool ever = std::ranges::any_of(
      result.log.frames, [](const FrameRecord& frame) { return frame.navigated_MH.has_value(); });
  return scenario.approach.on() && !ever ? "; navigation never reported a position" : "";
}

std::string Mm(double length_m) { return report::Fixed(units::MmFromM(length_m), 0); }

// Why the time was up: what the vehicle was still missing.
std::string TimeoutReason(const Scenario& scenario, const TrialResult& result,
                          const control::Directive& directive) {
  const std::string after = fmt::format("{:g} s are over", scenario.duration_s);
  if (!result.handover_time_s)
    return fmt::format(
        "{} and the marker was never found: the best fitness was {:.2f}, it takes "
        "{:g} for {:g} s{}{}",
        after, result.fitness_best, scenario.procedure.found_fitness,
        scenario.procedure.found_hold_s,
        result.fitness_best >= scenario.procedure.found_fitness ? ", of a marker that is detected"
                                                                : "",
        NavigationRemark(scenario, result));
  const AxesPose& e = result.final_error_estimated;
  return fmt::format(
             "{} in {} with the marker estimated {} mm, {} mm, {} mm and {}° "
             "from the desired pose",
             after, NameOf(directive.stage), Mm(e.x_m), Mm(e.y_m), Mm(e.z_m),
             report::Fixed(units::DegFromRad(e.yaw_rad), 1)) +
         JamRemark(result);
}

std::string DockedReason(const TrialResult& result) {
  const std::string met =
      fmt::format("the docking criterion was met after {:.1f} s", result.time_s);
  if (result.inserted)
    return fmt::format("{}; at the end the pole is in the hole, {:.0f} mm past the mouth", met,
                       units::MmFromM(result.insertion_depth_m));
  return fmt::format(
      "{} on the estimate, but at the end the pole is not in the hole: its tip is {:.0f} mm {} "
      "the mouth and the true position of the marker is off by {} mm in y and "
      "{} mm in z",
      met, units::MmFromM(std::abs(result.insertion_depth_m)),
      result.insertion_depth_m < 0 ? "in front of" : "past", Mm(result.final_error_true.y_m),
      Mm(result.final_error_true.z_m));
}

bool IsUnderWay(const FrameRecord& frame) {
  return frame.stage == Stage::kVisualServoing || frame.stage == Stage::kDocking;
}

// Frames of servoing or docking with an estimate that the vehicle could act on.
std::vector<FrameRecord> UsableFrames(const Scenario& scenario,
                                      std::span<const FrameRecord> frames) {
  std::vector<FrameRecord> usable;
  for (const FrameRecord& frame : frames)
    if (IsUnderWay(frame) && frame.fitness >= scenario.procedure.lost_fitness)
      usable.push_back(frame);
  return usable;
}

std::span<const FrameRecord> Last(const Scenario& scenario, double seconds,
                                  std::span<const FrameRecord> frames) {
  const auto most = static_cast<size_t>(scenario.clock.FramesFor(seconds));
  return frames.last(std::min(most, frames.size()));
}

bool IsFalseLock(std::span<const FrameRecord> frames) {
  const auto wrong = std::count_if(frames.begin(), frames.end(), [](const FrameRecord& frame) {
    return (frame.est_X_HM.p - frame.true_at_image_X_HM.p).norm() > kFalseLock_m;
  });
  return 2 * wrong > std::ssize(frames);
}

// How often a true error went from beyond one limit to beyond the other.
int SwingsOf(double AxesPose::*axis, double limit, std::span<const FrameRecord> frames) {
  int side = 0, swings = 0;
  for (const FrameRecord& frame : frames) {
    const double error = (AxesPose::Of(frame.true_X_HM) - frame.desired).*axis;
    if (!(std::abs(error) > limit)) continue;
    const int now = error > 0 ? 1 : -1;
    swings += now == -side;
    side = now;
  }
  return swings;
}

bool IsOscillation(const control::ProcedureParams& p, std::span<const FrameRecord> frames) {
  return std::max({SwingsOf(&AxesPose::y_m, p.enter_y_m, frames),
                   SwingsOf(&AxesPose::z_m, p.enter_z_m, frames),
                   SwingsOf(&AxesPose::yaw_rad, p.enter_yaw_rad, frames)}) >= kSwings;
}

bool IsLost(const Scenario& scenario, const TrialResult& result) {
  if (result.outcome == Outcome::kMarkerLost) return true;
  const auto& frames = result.log.frames;
  const auto most = static_cast<size_t>(scenario.clock.FramesFor(scenario.procedure.lost_after_s));
  if (frames.size() <= most) return false;
  return std::none_of(
      frames.end() - static_cast<int64_t>(most), frames.end(),
      [&](const FrameRecord& frame) { return frame.fitness >= scenario.procedure.lost_fitness; });
}

}  // namespace

EndingRules::EndingRules(const Scenario& scenario)
    : clock_(scenario.clock),
      plays_back_(scenario.plays_back()),
      last_frame_(clock_.FramesFor(scenario.duration_s)),
      hold_frames_(clock_.FramesFor(scenario.after_docked_s)) {}

std::optional<Ending> EndingRules::After(const FrameEvents& now) {
  if (now.directive.done && !docked_frame_) docked_frame_ = now.frame;
  const double now_s = clock_.TimeOfFrame(now.frame + 1);
  if (now.fault) return Ending{Outcome::kDiverged, *now.fault};
  if (now.contacts.collision_force_newton > 0)
    return Ending{Outcome::kCollision,
                  fmt::format("{} at {:.1f} s with {:.1f} N", now.contacts.collision, now_s,
                              now.contacts.collision_force_newton)};
  if (now.directive.given_up && !plays_back_)
    return Ending{now.directive.marker_seen ? Outcome::kGaveUp : Outcome::kMarkerLost,
                  now.directive.given_up_reason};
  if (now.stop_requested)
    return Ending{Outcome::kInterrupted, fmt::format("stopped at {:.1f} s", now_s)};
  if (docked_frame_) {
    if (now.frame + 1 - *docked_frame_ >= hold_frames_) return Ending{Outcome::kSuccess, ""};
  } else if (now.frame + 1 >= last_frame_) {
    return Ending{Outcome::kTimeout, ""};
  }
  return std::nullopt;
}

std::string ReasonOf(const Ending& ending, const Scenario& scenario, const TrialResult& result,
                     const control::Directive& directive) {
  if (ending.outcome == Outcome::kSuccess) return DockedReason(result);
  if (ending.outcome == Outcome::kTimeout) return TimeoutReason(scenario, result, directive);
  return ending.reason;
}

Failure FailureOf(const Scenario& scenario, const TrialResult& result) {
  static const std::map<Outcome, Failure> kAsItEnded = {
      {Outcome::kSuccess, Failure::kNone},      {Outcome::kInterrupted, Failure::kNone},
      {Outcome::kDiverged, Failure::kDiverged}, {Outcome::kCollision, Failure::kCollision},
      {Outcome::kCrashed, Failure::kCrashed},   {Outcome::kHung, Failure::kHung},
      {Outcome::kNoAnswer, Failure::kNoAnswer}};
  if (result.outcome == Outcome::kCollision &&
      IsFalseLock(UsableFrames(scenario, Last(scenario, kBeforeCollision_s, result.log.frames))))
    return Failure::kFalseLock;
  if (const auto found = kAsItEnded.find(result.outcome); found != kAsItEnded.end())
    return found->second;
  if (result.jam_time_s) return Failure::kJammed;
  if (result.outcome == Outcome::kFalseDock) return Failure::kFalseLock;
  const std::vector<FrameRecord> usable = UsableFrames(scenario, result.log.frames);
  const bool was_under_way =
      std::any_of(result.log.frames.begin(), result.log.frames.end(), IsUnderWay);
  const auto last = Last(scenario, kVerdictTime_s, usable);
  if (IsFalseLock(last)) return Failure::kFalseLock;
  if (!was_under_way) return Failure::kNeverFound;
  if (IsLost(scenario, result))
    return !usable.empty() && usable.back().stage == Stage::kDocking ? Failure::kLostInDocking
                                                                     : Failure::kLostInServoing;
  if (IsOscillation(scenario.procedure, last)) return Failure::kOscillation;
  return result.outcome == Outcome::kGaveUp ? Failure::kGaveUp : Failure::kTimeout;
}

}  // namespace turbidock::trial
