#pragma once
// What an estimator says of one frame; what the control side hears.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/base/pose.h"

namespace turbidock {

// Of (position, rotation vector), both in H: 3 x metres, then 3 x radians.
using PoseCovariance = Eigen::Matrix<double, 6, 6>;

// A pose that the images allow beside the one that is estimated, and is not near it.
struct SecondPose {
  Pose X_HM;          // canonical quaternion
  double weight = 0;  // probability, up to 0.5, that it is this one, if it is one of the two
};

struct PoseEstimate {
  int64_t frame = 0;
  Pose X_HM;                         // marker in the camera head, canonical quaternion
  double fitness = -1;               // F in [-1, 1] of the best pose the search found in this frame
  std::vector<double> ball_fitness;  // per ball, mean of both cameras; their mean is the fitness
  // Per ball, the share of its outline in sight that has an edge where X_HM predicts it; 0 where
  // X_HM was not refined, empty where the estimator does not refine.
  std::vector<double> ball_support;
  int64_t evaluations = 0;  // fitness evaluations spent on this frame
  bool detected = false;    // the marker is in sight (with hysteresis); else X_HM is a guess
  // When X_HM was refined to a fraction of a pixel; nothing when it is the search's alone.
  std::optional<PoseCovariance> covariance;
  // Where the images leave two answers, such as a turn about the line of the two balls that are
  // seen.
  std::optional<SecondPose> second;
};

}  // namespace turbidock
