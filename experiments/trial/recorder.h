#pragma once
// What a trial leaves: its log, frame by frame, and the result that is made of it.

#include <chrono>
#include <cstdint>
#include <optional>

#include "control/docking_procedure.h"
#include "experiments/trial/ending.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "sim/base/digest.h"
#include "sim/vehicle/plant.h"

namespace turbidock::trial {

// What the pole and the dock did to each other in a trial, gathered frame by frame.
class DockContact {
 public:
  explicit DockContact(const JamParams& jam) : jam_(jam) {}

  void Update(const FrameRecord& frame);

  // Nothing when it has not happened. Each is the first time only.
  std::optional<Contact> first_contact() const { return first_contact_; }
  std::optional<double> insertion_time_s() const { return insertion_time_s_; }
  std::optional<double> jam_time_s() const { return jam_time_s_; }  // when it was established
  double force_max_newton() const { return force_max_newton_; }

 private:
  JamParams jam_;
  std::optional<Contact> first_contact_;
  std::optional<double> insertion_time_s_, jam_time_s_;
  double force_max_newton_ = 0;
  // Since when the pole has been held where it is.
  std::optional<double> held_since_s_;
  double held_depth_m_ = 0;
};

class TrialRecorder {
 public:
  // Wall time counts from here.
  explicit TrialRecorder(const Scenario& scenario);

  // Their names, before the first frame.
  void SetThrusters(std::vector<std::string> names) { result_.log.thrusters = std::move(names); }
  // Where it begins: the camera head in the marker's frame.
  void SetStart(const Pose& X_MH) { result_.start = AxesPose::Of(X_MH); }
  void Add(const control::Transition& change) { result_.transitions.push_back(change); }
  // A setting that was changed; part of the digest.
  void Add(const Change& change);
  void Add(const FrameRecord& record);  // once its time has passed

  // The result of the frames so far, of the plant as it is now and of the last directive. To be
  // called once. What was simulated with (renderer, estimator) is left to the caller.
  TrialResult Finish(const vehicle::Plant& plant, const control::Directive& directive,
                     const Ending& ending);

  // What there is so far.
  const TrialLog& log() const { return result_.log; }
  const std::vector<control::Transition>& transitions() const { return result_.transitions; }
  const std::vector<Change>& changes() const { return result_.changes; }

 private:
  void NoteHandover(const FrameRecord& record);
  void Summarise();
  void SummariseControl();

  const Scenario& scenario_;
  std::chrono::steady_clock::time_point wall_start_ = std::chrono::steady_clock::now();
  TrialResult result_;
  Digest digest_;
  DockContact dock_contact_;
  std::optional<int64_t> docked_frame_;
};

}  // namespace turbidock::trial
