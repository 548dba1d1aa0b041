#include "experiments/trial/failure.h"

#include <algorithm>
#include <map>
#include <span>
#include <vector>

namespace turbidock::trial {
namespace {

using control::Stage;

bool IsUnderWay(const FrameRecord& frame) {
  return frame.stage == Stage::kVisualServoing || frame.stage == Stage::kDocking;
}

// Frames of servoing or docking with an estimate that the vehicle could act on.
std::vector<FrameRecord> UsableFrames(const Scenario& scenario, const TrialLog& log) {
  std::vector<FrameRecord> usable;
  for (const FrameRecord& frame : log.frames)
    if (IsUnderWay(frame) && frame.fitness >= scenario.procedure.lost_fitness)
      usable.push_back(frame);
  return usable;
}

std::span<const FrameRecord> Last(const Scenario& scenario, double seconds,
                                  const std::vector<FrameRecord>& frames) {
  const auto most = static_cast<size_t>(scenario.clock.FramesFor(seconds));
  return std::span(frames).last(std::min(most, frames.size()));
}

bool IsFalseLock(std::span<const FrameRecord> frames) {
  const auto wrong = std::count_if(frames.begin(), frames.end(), [](const FrameRecord& frame) {
    return (frame.est_X_HM.p - frame.true_X_HM.p).norm() > kFalseLock_m;
  });
  return 2 * wrong > std::ssize(frames);
}

// How often a value went from beyond one limit to beyond the other.
class SwingCounter {
 public:
  explicit SwingCounter(double limit) : limit_(limit) {}
  void Add(double error) {
    const int side = error > limit_ ? 1 : error < -limit_ ? -1 : 0;
    if (side == 0) return;
    if (side == -side_) ++swings_;
    side_ = side;
  }
  int swings() const { return swings_; }

 private:
  double limit_;
  int side_ = 0, swings_ = 0;
};

bool IsOscillation(const Scenario& scenario, std::span<const FrameRecord> frames) {
  const control::ProcedureParams& p = scenario.procedure;
  SwingCounter y(p.enter_y_m), z(p.enter_z_m), yaw(p.enter_yaw_rad);
  for (const FrameRecord& frame : frames) {
    const AxesPose error = AxesPose::Of(frame.true_X_HM) - frame.desired;
    y.Add(error.y_m);
    z.Add(error.z_m);
    yaw.Add(error.yaw_rad);
  }
  return std::max({y.swings(), z.swings(), yaw.swings()}) >= kSwings;
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

Failure FailureOf(const Scenario& scenario, const TrialResult& result) {
  static const std::map<Outcome, Failure> kAsItEnded = {
      {Outcome::kDocked, Failure::kNone},       {Outcome::kInterrupted, Failure::kNone},
      {Outcome::kDiverged, Failure::kDiverged}, {Outcome::kCollision, Failure::kCollision},
      {Outcome::kCrashed, Failure::kCrashed},   {Outcome::kHung, Failure::kHung}};
  if (const auto found = kAsItEnded.find(result.outcome); found != kAsItEnded.end())
    return found->second;
  if (result.jam_time_s) return Failure::kJammed;
  if (result.outcome == Outcome::kFalseDock) return Failure::kFalseLock;
  const std::vector<FrameRecord> usable = UsableFrames(scenario, result.log);
  const bool was_under_way =
      std::any_of(result.log.frames.begin(), result.log.frames.end(), IsUnderWay);
  const auto last = Last(scenario, kVerdictTime_s, usable);
  if (IsFalseLock(last)) return Failure::kFalseLock;
  if (!was_under_way) return Failure::kNeverFound;
  if (IsLost(scenario, result))
    return !usable.empty() && usable.back().stage == Stage::kDocking ? Failure::kLostInDocking
                                                                     : Failure::kLostInServoing;
  if (IsOscillation(scenario, last)) return Failure::kOscillation;
  return result.outcome == Outcome::kGaveUp ? Failure::kGaveUp : Failure::kTimeout;
}

}  // namespace turbidock::trial
