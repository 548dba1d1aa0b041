#pragma once
// The estimator's interface. It sees images only, so the same code runs on a real vehicle.

#include <optional>
#include <string_view>

#include "sim/base/image.h"
#include "sim/base/pose_estimate.h"
#include "sim/base/stage_timer.h"

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
  virtual std::optional<StereoRegion> RegionOfInterest() const { return std::nullopt; }
  virtual std::string_view name() const = 0;

  // Gets kLabels at each Update; the rest of it is the caller's to count. Must outlive it.
  void set_timer(StageTimer* timer) { timer_ = timer; }

 protected:
  StageTimer* timer() const { return timer_; }

 private:
  StageTimer* timer_ = nullptr;
};

}  // namespace turbidock::vision
