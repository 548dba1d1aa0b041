#pragma once
// When the cameras expose and when an image arrives at the estimator, in frames of the loop.
//
// Images are numbered one after the other; with a period of one frame an image's number is the
// frame of its exposure. An image arrives at frame 0, whatever the delay: the cameras have been on
// for a while.

#include <cstdint>

namespace turbidock::trial {

class CameraSchedule {
 public:
  // Every `period` frames, at least 1; at the estimator `delay` frames later.
  CameraSchedule(int period, int delay) : period_(period), delay_(delay) {}

  int64_t first_frame() const { return -delay_; }  // of the exposures
  bool ExposesAt(int64_t frame) const { return (frame + delay_) % period_ == 0; }
  bool ArrivesAt(int64_t frame) const { return frame % period_ == 0; }
  int64_t ExposureOf(int64_t frame) const { return frame - delay_; }  // of what arrives at it
  // Number of the image exposed at this frame, of the one that arrived last.
  int64_t ExposedAt(int64_t frame) const { return (frame + delay_) / period_ - delay_; }
  int64_t LatestAt(int64_t frame) const { return frame / period_ - delay_; }
  // Images to keep beside the latest, so that none is overwritten while it is still needed.
  int under_way() const { return delay_ == 0 ? 0 : 1 + (delay_ - 1) / period_; }

 private:
  int period_, delay_;
};

}  // namespace turbidock::trial
