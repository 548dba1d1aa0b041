#pragma once
// The estimator's interface. It sees images only, so the same code runs on a real vehicle.

#include <string_view>

#include "sim/base/image.h"
#include "sim/base/pose_estimate.h"

namespace turbidock::vision {

class PoseEstimator {
 public:
  virtual ~PoseEstimator() = default;
  // Processes the next frame. Images that are not of the rig's size are a ConfigError.
  virtual const PoseEstimate& Update(const StereoImage& seen) = 0;
  // Forgets what was learnt from earlier frames (the random stream goes on).
  virtual void Reset() = 0;
  virtual std::string_view name() const = 0;
};

}  // namespace turbidock::vision
