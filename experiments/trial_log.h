#pragma once
// The record of a trial: one row a camera frame, in memory; files are made from it afterwards.

#include <cstdint>
#include <string>
#include <vector>

#include "control/stage.h"
#include "sim/base/pose.h"
#include "sim/base/thruster_command.h"

namespace turbidock::experiments {

// Desired position of the marker in the camera head and heading error to hold.
struct DesiredPose {
  double x_m = 0, y_m = 0, z_m = 0, yaw_rad = 0;
};

struct FrameRecord {
  int64_t frame = 0;
  double time_s = 0;
  control::Stage stage = control::Stage::kApproach;
  Pose est_X_HM;        // the estimator's best pose
  double fitness = -1;  // and its F
  Pose true_X_HM;
  Pose true_X_WB;
  Twist true_V_WB_B;
  DesiredPose desired;
  bool controlled =
      false;  // false: the vehicle searches or drifts, `desired` is not being followed
  ThrusterCommand command;
  double insertion_depth_m = 0;  // of the pole's tip past the dock's mouth
  double dock_force_newton = 0;
  double collision_force_newton = 0;
};

struct StageChange {
  int64_t frame = 0;
  double time_s = 0;
  control::Stage from = control::Stage::kApproach, to = control::Stage::kApproach;
  std::string reason;
};

struct TrialLog {
  std::vector<FrameRecord> frames;
  std::vector<StageChange> changes;
};

}  // namespace turbidock::experiments
