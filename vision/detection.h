#pragma once
// Whether the marker is in sight and its pose certain, judged from one frame to the next.

#include <span>

#include "sim/base/published.h"

namespace turbidock::vision {

class Detection {
 public:
  // Detected from kOnFitness on and until F falls below the published limit, each for some frames
  // in a row, so that an F about the limit does not flicker. In 10,000 frames without a marker
  // nothing was detected.
  static constexpr double kOnFitness = 0.4, kOffFitness = published::kDetectedFitness;
  static constexpr int kOnFrames = 2, kOffFrames = 3;
  // F of one ball from which it counts as matched: a third of its inner points, net.
  static constexpr double kMatchedBallFitness = 0.2;

  // Takes up a frame: F and its part of each ball. The pose is certain where F is reliable and,
  // unless the marker is tracked, every ball matched: F of two balls of three reaches 0.6 wherever
  // the third is. A track has told the third's place before.
  void Update(double fitness, std::span<const double> ball_fitness, bool is_tracked);

  bool detected() const { return detected_; }
  // Frames in a row, up to the last one, in which the pose was certain or was not; one of them 0.
  int frames_certain() const { return frames_certain_; }
  int frames_uncertain() const { return frames_uncertain_; }

 private:
  bool detected_ = false;
  int frames_on_ = 0, frames_off_ = 0;  // in a row above and below the limits of detection
  int frames_certain_ = 0, frames_uncertain_ = 0;
};

}  // namespace turbidock::vision
