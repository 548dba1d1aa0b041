#pragma once
// When a trial is over, and why; and why it did not dock.

#include <cstdint>
#include <optional>
#include <string>

#include "control/docking_procedure.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "sim/vehicle/plant.h"

namespace turbidock::trial {

struct Ending {
  Outcome outcome = Outcome::kTimeout;
  std::string reason;  // empty where only the whole trial tells: see ReasonOf
};

// What happened in a frame, once its time has passed.
struct FrameEvents {
  int64_t frame = 0;
  const control::Directive& directive;
  const std::optional<std::string>& fault;  // of the physics
  const vehicle::ContactReport& contacts;
  bool stop_requested = false;
};

class EndingRules {
 public:
  explicit EndingRules(const Scenario& scenario);

  // To be asked after every frame, in order. The first rule that applies: a fault, a collision,
  // the marker lost for good or all attempts failed, a request to stop, docked (as often as it
  // shall) and held, the time up. Once docked, the time is not up before the hold is over.
  std::optional<Ending> After(const FrameEvents& now);

 private:
  ClockParams clock_;
  bool plays_back_;  // the procedure only looks on: what it gives up goes on
  int64_t last_frame_, hold_frames_;
  std::optional<int64_t> docked_frame_;
};

// Why it ended, as a sentence for people. `result` is complete but for this; `directive` the last.
std::string ReasonOf(const Ending& ending, const Scenario& scenario, const TrialResult& result,
                     const control::Directive& directive);

// The verdict on a trial from its result and log.
// False lock: a false dock, or more than half of the last kVerdictTime_s of servoing and docking
// with a usable estimate whose position was off by more than kFalseLock_m; of a collision, more
// than half of such frames within kBeforeCollision_s of it. Oscillation: in the last kVerdictTime_s
// under control the true y, z or yaw error changed sign at least kSwings times beyond the limits at
// which docking may begin (procedure.enter_*).
Failure FailureOf(const Scenario& scenario, const TrialResult& result);

inline constexpr double kVerdictTime_s = 15;     // guess: a few periods of the sea
inline constexpr double kFalseLock_m = 0.1;      // guess: the marker's own size
inline constexpr double kBeforeCollision_s = 3;  // guess: what a vehicle needs to stop
inline constexpr int kSwings = 4;                // guess: two full swings are no accident

}  // namespace turbidock::trial
