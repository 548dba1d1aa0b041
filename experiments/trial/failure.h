#pragma once
// Why a trial did not dock.

#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"

namespace turbidock::trial {

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
