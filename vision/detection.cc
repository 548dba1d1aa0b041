#include "vision/detection.h"

#include <algorithm>

namespace turbidock::vision {

void Detection::Update(double fitness, std::span<const double> ball_fitness, bool is_tracked) {
  const bool is_certain =
      fitness >= published::kReliableFitness &&
      (is_tracked || *std::ranges::min_element(ball_fitness) >= kMatchedBallFitness);
  frames_certain_ = is_certain ? frames_certain_ + 1 : 0;
  frames_uncertain_ = is_certain ? 0 : frames_uncertain_ + 1;
  frames_on_ = fitness >= kOnFitness ? frames_on_ + 1 : 0;
  frames_off_ = fitness < kOffFitness ? frames_off_ + 1 : 0;
  if (frames_on_ >= kOnFrames) detected_ = true;
  if (frames_off_ >= kOffFrames) detected_ = false;
}

}  // namespace turbidock::vision
