#pragma once
// Whether the marker is in sight and its pose certain, judged from one frame to the next.

#include <span>
#include <string>

#include "sim/base/fields.h"
#include "sim/base/published.h"

namespace turbidock::vision {

// When the marker counts as in sight. On and off differ so that an F about the limit does not
// flicker.
struct DetectionParams {
  double on_fitness = 0.4, off_fitness = published::kDetectedFitness;
  int on_frames = 2, off_frames = 3;

  static void Fields(auto& self, auto&& field) {
    field("on_fitness", self.on_fitness, InRange(-1, 1), "detected from this fitness on");
    field("off_fitness", self.off_fitness, InRange(-1, 1), "lost below this fitness");
    field("on_frames", self.on_frames, InRange(1, 1000), "frames in a row before it is detected");
    field("off_frames", self.off_frames, InRange(1, 1000), "frames in a row before it is lost");
  }
  void Check(const std::string& path) const;
};

// When the search counts as done: the pose is certain.
struct CertaintyLimits {
  double fitness = published::kReliableFitness;
  double ball_fitness = 0.2;
};

class Detection {
 public:
  Detection(const DetectionParams& limits, const CertaintyLimits& certain)
      : limits_(limits), certain_(certain) {}

  // Takes up a frame: F and its part of each ball. While the marker is tracked a ball that is
  // matched badly does not count against it: three balls have told the pose before.
  void Update(double fitness, std::span<const double> ball_fitness, bool is_tracked);
  void Reset() { *this = Detection(limits_, certain_); }
  void CountLossAnew() { frames_uncertain_ = 0; }

  bool detected() const { return detected_; }
  // Frames in a row, up to the last one, in which the pose was certain or was not; one of them 0.
  int frames_certain() const { return frames_certain_; }
  int frames_uncertain() const { return frames_uncertain_; }

 private:
  DetectionParams limits_;
  CertaintyLimits certain_;
  bool detected_ = false;
  int frames_on_ = 0, frames_off_ = 0;  // in a row above and below the limits of detection
  int frames_certain_ = 0, frames_uncertain_ = 0;
};

}  // namespace turbidock::vision
