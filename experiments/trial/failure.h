#pragma once
// Why a trial did not dock: one word a trial, for tables of many.

#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"

namespace turbidock::trial {

// A trial succeeds when its outcome is `docked`: the criterion was met and the pole is in the hole.
// Otherwise the first of these that applies, in this order.
enum class Failure {
  kNone,
  kDiverged,        // the physics gave no usable state
  kCollision,       // the vehicle touched something other than the inside of the dock
  kJammed,          // the pole was held in the dock for a while
  kFalseLock,       // the estimate that was acted on was wrong: see FailureOf
  kNeverFound,      // the vehicle never began to servo
  kLostInServoing,  // the marker was lost to the end of the trial, last seen while servoing
  kLostInDocking,   // the same, while docking
  kOscillation,     // the vehicle swung about the desired pose to the end: see FailureOf
  kTimeout,         // none of these, and the time was up
  kCrashed,         // the trial's process ended
  kHung,            // the trial's process was stopped after its time limit
};

// The verdict on a trial from its result and log.
// False lock: a false dock, or more than half of the last kVerdictTime_s of servoing and docking
// with a usable estimate whose position was off by more than kFalseLock_m.
// Oscillation: in the last kVerdictTime_s under control the true y, z or yaw error changed sign at
// least kSwings times beyond the limits at which docking may begin (procedure.enter_*).
Failure FailureOf(const Scenario& scenario, const TrialResult& result);

inline constexpr double kVerdictTime_s = 15;  // guess: a few periods of the sea
inline constexpr double kFalseLock_m = 0.1;   // guess: the marker's own size
inline constexpr int kSwings = 4;             // guess: two full swings are no accident

}  // namespace turbidock::trial

template <>
struct turbidock::EnumNames<turbidock::trial::Failure> {
  using E = turbidock::trial::Failure;
  static constexpr auto kNames = std::to_array<std::pair<E, const char*>>({
      {E::kNone, "none"},
      {E::kDiverged, "diverged"},
      {E::kCollision, "collision"},
      {E::kJammed, "jammed"},
      {E::kFalseLock, "false_lock"},
      {E::kNeverFound, "never_found"},
      {E::kLostInServoing, "lost_in_servoing"},
      {E::kLostInDocking, "lost_in_docking"},
      {E::kOscillation, "oscillation"},
      {E::kTimeout, "timeout"},
      {E::kCrashed, "crashed"},
      {E::kHung, "hung"},
  });
};
