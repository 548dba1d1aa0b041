#pragma once
// What an estimator says of one frame; what the control side hears.

#include <cstdint>
#include <vector>

#include "sim/base/pose.h"

namespace turbidock {

struct PoseEstimate {
  int64_t frame = 0;
  Pose X_HM;                         // marker in the camera head, canonical quaternion
  double fitness = -1;               // F in [-1, 1] of this frame's best pose
  std::vector<double> ball_fitness;  // per ball, mean of both cameras; their mean is the fitness
  int64_t evaluations = 0;           // fitness evaluations spent on this frame
};

}  // namespace turbidock
