#pragma once
// The record of a trial: one row a camera frame, in memory; files are made from it afterwards.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "control/axes.h"
#include "control/docking_procedure.h"
#include "sim/base/pose.h"
#include "sim/base/thruster_command.h"

namespace turbidock::trial {

// What is known of one camera frame. Time and truth are of the moment the vehicle acts; the
// estimate is of the image that arrived last, exposed camera_delay_frames before that. An estimate
// is compared with the truth of its image, whatever is steered with the truth of the frame.
struct FrameRecord {
  int64_t frame = 0;
  double time_s = 0;
  control::Stage stage = control::Stage::kApproach;
  Pose est_X_HM;        // the estimator's best pose
  double fitness = -1;  // and its F
  // Squared, by the covariance that the estimate claims (vision/normalised_error.h), if it does.
  std::optional<double> normalised_error2;
  double image_time_s = 0;  // when its image was exposed; 0 for what was exposed before the trial
  Pose true_at_image_X_HM;  // the marker then
  Pose true_X_HM;
  Pose true_X_WB;
  Twist true_V_WB_B;
  AxesPose desired;
  bool controlled = false;  // false: the vehicle searches or drifts instead of following `desired`
  control::Axes demand = control::Axes::Zero();  // of the controller; zero without control
  ThrusterCommand command;                       // a voltage for each thruster
  double insertion_depth_m = 0;                  // of the pole's tip past the dock's mouth
  bool inserted = false;                         // the tip is inside the straight hole
  double dock_force_newton = 0;                  // the largest until the next frame
  double collision_force_newton = 0;
};

struct TrialLog {
  std::vector<std::string> thrusters{"surge_left", "surge_right", "sway", "heave"};
  std::vector<FrameRecord> frames{};
};

}  // namespace turbidock::trial
