#pragma once
// The estimator's interface. It sees images only, so the same code runs on a real vehicle.

#include <cstdint>
#include <string_view>
#include <vector>

#include "sim/base/image.h"
#include "sim/base/pose.h"

namespace turbidock::vision {

struct PoseEstimate {
  int64_t frame = 0;
  Pose X_HM;                          // marker in the camera head, canonical quaternion
  double fitness = -1;                // F in [-1, 1] of this frame's best pose
  std::vector<double> ball_fitness;   // per ball, mean of both cameras; mean over balls = fitness
  int64_t evaluations = 0;            // fitness evaluations spent on this frame
};

class PoseEstimator {
 public:
  virtual ~PoseEstimator() = default;
  // Processes the next frame. The images must have the rig's size (ConfigError).
  virtual const PoseEstimate& Update(const StereoImage& seen) = 0;
  // Forgets everything learnt from earlier frames (the random stream goes on).
  virtual void Reset() = 0;
  virtual std::string_view name() const = 0;
};

}  // namespace turbidock::vision
