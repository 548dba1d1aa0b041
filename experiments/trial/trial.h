#pragma once
// One docking trial: the closed loop from water to water. world.h and eyes.h are the two sides of
// the loop, ending.h says when it is over, recorder.h what is left of it.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "control/autopilot.h"
#include "experiments/trial/dock_contact.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial_log.h"
#include "sim/base/image.h"
#include "sim/base/stage_timer.h"
#include "sim/vehicle/energy_balance.h"

namespace turbidock::trial {

// How a trial ended. The first two meet the published criterion on the estimate.
enum class Outcome {
  kDocked,       // and the pole is in the hole
  kFalseDock,    // but the pole is not in the hole
  kTimeout,      // the time was up
  kMarkerLost,   // the marker was found once and then lost for too long
  kCollision,    // the vehicle touched something other than the inside of the dock
  kDiverged,     // the physics gave no usable state
  kInterrupted,  // the caller asked to stop
};

// Position and heading of the marker in the camera head less the desired ones.
struct PoseError {
  double x_m = 0, y_m = 0, z_m = 0, yaw_rad = 0;
};

struct TrialResult {
  Outcome outcome = Outcome::kTimeout;
  std::string reason;     // a sentence for people
  bool docked = false;    // the criterion was met on the estimate
  bool inserted = false;  // truth, at the end: the pole's tip is inside the straight hole
  double time_s = 0;      // simulated: when the criterion was met, else of the end
  // At time_s, against the desired pose of that stage.
  PoseError final_error_true, final_error_estimated;
  double insertion_depth_m = 0;               // of the pole's tip past the dock's mouth, at the end
  std::optional<double> insertion_time_s;     // when the pole first was in the hole
  std::optional<Contact> first_dock_contact;  // of the pole with the dock
  double dock_force_max_newton = 0;
  std::optional<double> jam_time_s;  // when the pole first was found jammed; no end of the trial
  vehicle::EnergyBalance energy;     // of the whole trial
  double fitness_mean = 0, fitness_best = -1;
  int returns_to_servoing = 0;
  // Of the frames after the approach (all of them if it never ended): root mean square of the true
  // y and z errors together, each at most 1 m; largest way beyond the desired x, at most 1 m.
  double tracking_rms_m = 0, overshoot_m = 0;
  double effort_v = 0;  // root mean square of the commands' deviations from neutral, of all frames
  std::map<control::Stage, double> stage_time_s;
  int64_t seed = 0;
  std::string renderer;         // GL context and what draws in it; nothing for true_pose
  std::string estimator;        // what made the estimates: an estimator's name, or true_pose
  std::string digest;           // of states, estimates and commands; equal for equal runs
  double wall_time_s = 0;       // never part of a digest
  double real_time_factor = 0;  // simulated over wall time
  double peak_memory_mib = 0;   // resident memory of this process until now, at most
  TrialLog log;
};

// What an observer sees of a frame, once the frame's time has passed.
struct TrialFrame {
  const FrameRecord& record;
  // What the estimator saw: sure to be whole with whole_images only, empty when it saw the true
  // pose.
  const StereoImage& seen;
  int64_t evaluations = 0;  // of the fitness, spent on it
  const Image3u8* spectator =
      nullptr;  // at the frame's beginning; with TrialOptions::spectator only
};

// What an experiment does to the loop during a frame.
struct TrialExcitation {
  control::Excitation control;
  Wrench F_B_B;  // on the vehicle at B's origin, in B
};

struct TrialOptions {
  bool whole_images =
      false;               // make also the pixels that the estimator cannot read, for an observer
  bool spectator = false;  // also draw the outside view, for a video
  // Called every frame. Observers change nothing: the digest is the same with and without.
  std::function<void(const TrialFrame&)> observe;
  std::function<void(const control::Transition&)> on_transition;
  std::function<void(const std::string&)> on_remark;  // what people should know, a sentence
  std::function<bool()> stop_requested;               // polled every frame
  StageTimer* timer = nullptr;  // gets every stage of every frame, observers excepted
  // Asked every frame, for experiments on the loop itself; part of the digest by what it causes.
  std::function<TrialExcitation(int64_t frame)> excite;
};

// Runs a trial. ConfigError for a scenario that cannot run, SimulatorFault when nothing can be
// drawn.
TrialResult RunTrial(const Scenario& scenario, const TrialOptions& options = {});

}  // namespace turbidock::trial

template <>
struct turbidock::EnumNames<turbidock::trial::Outcome> {
  using E = turbidock::trial::Outcome;
  static constexpr auto kNames = std::to_array<std::pair<E, const char*>>({
      {E::kDocked, "docked"},
      {E::kFalseDock, "false_dock"},
      {E::kTimeout, "timeout"},
      {E::kMarkerLost, "marker_lost"},
      {E::kCollision, "collision"},
      {E::kDiverged, "diverged"},
      {E::kInterrupted, "interrupted"},
  });
};
