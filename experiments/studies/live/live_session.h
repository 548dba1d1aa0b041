#pragma once
// A trial that somebody watches and interferes with: what `turbidock view` serves, without the
// serving.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "experiments/report/json.h"
#include "experiments/trial/running_trial.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"

namespace turbidock::live {

// What the page offers to change, each with its value and its range or choices; of gains those of
// the controller in force.
report::Json ControlsModel(const trial::Scenario& settings);

// Pauses, steps and looks change nothing: a trial that nobody interfered with ends with the digest
// of one that was never watched. All in one thread; time is the caller's.
class LiveSession {
 public:
  // Gets what a trial leaves and the scenario it began with, when it ends or is cut off.
  using OnResult = std::function<void(const trial::Scenario&, const trial::TrialResult&)>;

  explicit LiveSession(const trial::Scenario& scenario, OnResult on_result = nullptr);

  // What a page asks for, one of
  //   {"do": "go"}, {"do": "pause"}, {"do": "step"},
  //   {"do": "speed", "factor": 0.5},       // of real time, 0.05 to 100
  //   {"do": "set", "key": "water.milk_ml_m3", "value": 20},
  //   {"do": "push", "force_newton": [0, 2, 0]},   // in W, at most 50 N, until the next
  //   {"do": "restart", "seed": 7}          // without a seed: the same; settings stay as they are
  // ConfigError for anything else, and for a step or a push after the end; nothing has changed
  // then.
  void Handle(const std::string& command);

  // Whether a frame shall pass: while it goes, or single steps are left.
  bool wants_step() const { return !result_ && (going_ || steps_left_ > 0); }
  // One frame passes; `whole_images`: latest_images() is to be looked at.
  void Step(bool whole_images);
  // The end: a trial under way is cut off, with a result if it has a frame.
  void Close();

  bool going() const { return going_; }
  double speed() const { return speed_; }
  int64_t trial_number() const { return trial_number_; }        // counts restarts, from 1
  int64_t settings_number() const { return settings_number_; }  // counts their changes, from 1
  const trial::Scenario& began() const { return began_; }
  const trial::Scenario& settings() const { return settings_; }
  const trial::TrialLog& log() const { return result_ ? result_->log : trial_->log(); }
  const std::vector<control::Transition>& transitions() const {
    return result_ ? result_->transitions : trial_->transitions();
  }
  const std::vector<trial::Change>& changes() const {
    return result_ ? result_->changes : trial_->changes();
  }
  const Eigen::Vector3d& push_newton() const { return trial_->push_newton(); }
  const StereoImage& latest_images() const { return trial_->latest_images(); }
  const std::optional<trial::TrialResult>& result() const { return result_; }  // of an ended trial

 private:
  void FailIfEnded() const;
  void Restart(const trial::Scenario& scenario);
  void TakeResult();

  OnResult on_result_;
  trial::Scenario began_, settings_;
  std::unique_ptr<trial::RunningTrial> trial_;
  std::optional<trial::TrialResult> result_;
  int64_t trial_number_ = 0, settings_number_ = 0;
  bool going_ = true;
  int steps_left_ = 0;
  double speed_ = 1;
};

}  // namespace turbidock::live
