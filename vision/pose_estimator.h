#pragma once
// The estimator's interface. It sees images only, so the same code runs on a real vehicle.

#include <optional>
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
  // The pixels that the next Update can read at most; nothing: any. Whoever makes the images need
  // not fill the others: the estimate is the same whatever they hold.
  virtual std::optional<StereoRegion> Reach() const { return std::nullopt; }
  virtual std::string_view name() const = 0;
};

}  // namespace turbidock::vision
