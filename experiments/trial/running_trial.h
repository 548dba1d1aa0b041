#pragma once
// A trial under way, a frame at a time: for whoever wants to pause it, look at it or interfere.
// RunTrial (trial.h) is this from beginning to end.

#include <optional>
#include <string>

#include "control/autopilot.h"
#include "control/controller_spec.h"
#include "experiments/trial/ending.h"
#include "experiments/trial/perception.h"
#include "experiments/trial/recorder.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "experiments/trial/world.h"

namespace turbidock::trial {

// The settings with one more key set, "water.milk_ml_m3=20": one of those that a running trial can
// follow, all of water, lamps, ball_lights, sea and the controllers. ConfigError for another key
// or for a value that is not allowed.
Scenario Changed(const Scenario& settings, const std::string& assignment);

// Steps, Set and Push follow from nothing but their order: the same ones give the same digest, with
// any pauses between them. Everything in one thread, to which the OpenGL context belongs.
class RunningTrial {
 public:
  // ConfigError for a scenario that cannot run, SimulatorFault when nothing can be drawn.
  explicit RunningTrial(const Scenario& scenario, TrialOptions options = {});
  RunningTrial(const RunningTrial&) = delete;
  RunningTrial& operator=(const RunningTrial&) = delete;

  bool ended() const { return ending_.has_value(); }
  // Lets the next frame's time pass. Not after the end.
  void Step();

  // Sets a key as Changed does, from the next frame on; a ConfigError also for what the trial could
  // not begin with, and nothing has changed then. The record and the digest have every change.
  void Set(const std::string& assignment);
  // A steady force [N] on the vehicle at B's origin, in W, from the next frame on, until another;
  // likewise recorded.
  void Push(const Eigen::Vector3d& f_W_newton);
  // Whether the images are made whole from the next frame on; changes nothing else.
  void SetFullFrame(bool whole) { perception_.SetFullFrame(whole); }

  // As they are now.
  const Scenario& settings() const { return settings_; }
  const Eigen::Vector3d& push_newton() const { return push_f_W_; }
  // So far.
  const TrialLog& log() const { return recorder_.log(); }
  const std::vector<control::Transition>& transitions() const { return recorder_.transitions(); }
  const std::vector<Change>& changes() const { return recorder_.changes(); }
  // What the estimator saw last; empty when it saw the true pose, without
  // TrialOptions::whole_images.
  const StereoImage& latest_images() const { return perception_.latest_images(); }

  // The result; interrupted where it has not ended. To be called once, after a step.
  TrialResult Finish();

 private:
  FrameRecord RecordOf(int64_t frame) const;
  void AddChange(const std::string& key, const std::string& value);
  std::optional<std::string> Advance(vehicle::ContactReport* contacts);

  const Scenario scenario_;  // as it began
  const std::vector<ModelFile> model_files_;
  Scenario settings_;
  TrialOptions options_;
  TrialRecorder recorder_;
  World world_;
  Perception perception_;
  control::CommandsOverTime commands_;  // in the autopilot's place
  control::Autopilot autopilot_;
  EndingRules rules_;
  ThrusterCommand command_;
  Attitude attitude_;  // as measured last
  Eigen::Vector3d push_f_W_ = Eigen::Vector3d::Zero();
  int64_t next_frame_ = 0;
  std::optional<Ending> ending_;
};

}  // namespace turbidock::trial
