#include "experiments/trial/ending.h"

#include <fmt/format.h>

#include <cmath>

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

// Why the time was up: what the vehicle was still missing.
std::string TimeoutReason(const Scenario& scenario, const TrialResult& result,
                          const control::Directive& directive) {
  const std::string after = fmt::format("{:g} s are over", scenario.duration_s);
  if (directive.stage == Stage::kApproach && result.transitions.empty())
    return fmt::format(
        "{} and the marker was never found: the best fitness was {:.2f}, it takes "
        "{:g} for {:g} s",
        after, result.fitness_best, scenario.procedure.found_fitness,
        scenario.procedure.found_hold_s);
  const AxesPose& e = result.final_error_estimated;
  return fmt::format(
             "{} in {} with the marker estimated {:.0f} mm, {:.0f} mm, {:.0f} mm and {:.1f} deg "
             "from the desired pose",
             after, NameOf(directive.stage), units::MmFromM(e.x_m), units::MmFromM(e.y_m),
             units::MmFromM(e.z_m), units::DegFromRad(e.yaw_rad)) +
         JamRemark(result);
}

std::string DockedReason(const TrialResult& result) {
  const std::string met =
      fmt::format("the docking criterion was met after {:.1f} s", result.time_s);
  if (result.inserted)
    return fmt::format("{} and the pole is in the hole, {:.0f} mm past the mouth", met,
                       units::MmFromM(result.insertion_depth_m));
  return fmt::format(
      "{} on the estimate, but the pole is not in the hole: its tip is {:.0f} mm {} "
      "the mouth and the true position of the marker is off by {:.0f} mm in y and "
      "{:.0f} mm in z",
      met, units::MmFromM(std::abs(result.insertion_depth_m)),
      result.insertion_depth_m < 0 ? "in front of" : "past",
      units::MmFromM(result.final_error_true.y_m), units::MmFromM(result.final_error_true.z_m));
}

}  // namespace

EndingRules::EndingRules(const Scenario& scenario)
    : clock_(scenario.clock),
      last_frame_(clock_.FramesFor(scenario.duration_s)),
      hold_frames_(clock_.FramesFor(scenario.docked_hold_s)) {}

std::optional<Ending> EndingRules::After(const FrameEvents& now) {
  if (now.directive.done && !docked_frame_) docked_frame_ = now.frame;
  const double now_s = clock_.TimeOfFrame(now.frame + 1);
  if (now.fault) return Ending{Outcome::kDiverged, *now.fault};
  if (now.contacts.collision_force_newton > 0)
    return Ending{Outcome::kCollision,
                  fmt::format("{} at {:.1f} s with {:.1f} N", now.contacts.collision, now_s,
                              now.contacts.collision_force_newton)};
  if (now.directive.given_up)
    return Ending{now.directive.marker_seen ? Outcome::kGaveUp : Outcome::kMarkerLost,
                  now.directive.given_up_reason};
  if (now.stop_requested)
    return Ending{Outcome::kInterrupted, fmt::format("stopped at {:.1f} s", now_s)};
  if (docked_frame_) {
    if (now.frame + 1 - *docked_frame_ >= hold_frames_) return Ending{Outcome::kDocked, ""};
  } else if (now.frame + 1 >= last_frame_) {
    return Ending{Outcome::kTimeout, ""};
  }
  return std::nullopt;
}

std::string ReasonOf(const Ending& ending, const Scenario& scenario, const TrialResult& result,
                     const control::Directive& directive) {
  if (ending.outcome == Outcome::kDocked) return DockedReason(result);
  if (ending.outcome == Outcome::kTimeout) return TimeoutReason(scenario, result, directive);
  return ending.reason;
}

}  // namespace turbidock::trial
