#pragma once
// One docking trial: the closed loop from water to water. world.h and perception.h are the two
// sides of the loop, ending.h says when it is over, recorder.h what is left of it.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "control/autopilot.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial_record.h"
#include "sim/base/attitude.h"
#include "sim/base/image.h"
#include "sim/base/stage_timer.h"
#include "sim/vehicle/plant.h"

namespace turbidock::trial {

struct TrialResult : TrialRecord {
  TrialLog log;                        // frame by frame
  std::vector<ModelFile> model_files;  // as they were when it began
};

// What an observer sees of a frame, once the frame's time has passed.
struct TrialFrame {
  const FrameRecord& record;
  // What the estimator saw: sure to be whole with whole_images only, without them empty when it saw
  // the true pose.
  const StereoImage& seen;
  int64_t evaluations = 0;  // of the fitness, spent on it
  // The outside view at the frame's beginning; with TrialOptions::spectator only.
  const Image3u8* spectator = nullptr;
};

// A step of the physics, at its beginning.
struct MotionTick {
  double time_s = 0;
  vehicle::VehicleTruth truth{};
  ThrusterCommand command{};                            // during it
  control::Axes demand = control::Axes::Zero();         // of the controller, in its unit
  Eigen::Vector3d water_v_W = Eigen::Vector3d::Zero();  // at the centre of buoyancy
  Attitude measured{};                                  // by the attitude sensor, last
};

// What an experiment does to the loop during a frame.
struct TrialExcitation {
  control::Excitation control;
  Wrench F_B_B;  // on the vehicle at B's origin, in B
};

struct TrialOptions {
  // Make also the pixels that the estimator cannot read, for an observer: always (also where it
  // sees the true pose), or every so many frames (0: never).
  bool whole_images = false;
  int whole_images_every = 0;
  bool spectator = false;  // also draw the outside view, for a video
  // Called every frame. Observers change nothing: the digest is the same with and without.
  std::function<void(const TrialFrame&)> observe;
  std::function<void(const MotionTick&)> on_tick;  // likewise, every step of the physics
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

// Writes result.json (keys as in `list result-keys`), resolved.yaml and trajectory.csv into a
// folder, which it makes when needed, each complete or not at all.
void WriteRecords(const std::string& folder, const Scenario& scenario, const TrialResult& result);
inline const std::vector<std::string> kRecordFiles = {"result.json", "resolved.yaml",
                                                      "trajectory.csv"};

}  // namespace turbidock::trial
