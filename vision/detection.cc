#include "vision/detection.h"

#include <algorithm>

namespace turbidock::vision {

void Detection::Update(const Evidence& evidence) {
  const auto seen = static_cast<size_t>(std::ranges::count_if(
      evidence.ball_support, [](double support) { return support >= kSeenSupport; }));
  const size_t balls = evidence.ball_support.size();
  const auto& cameras = evidence.camera_support;
  const bool both_see = !cameras || std::min(cameras->left, cameras->right) >= kSeenSupport;
  const bool all_seen = seen >= balls && both_see;
  const bool is_seen = evidence.is_tracked ? seen >= std::min<size_t>(balls, 2) : all_seen;
  const double fitness = evidence.fitness;
  const bool is_certain = is_seen && fitness >= published::kReliableFitness &&
                          (evidence.is_tracked ||
                           *std::ranges::min_element(evidence.ball_fitness) >= kMatchedBallFitness);
  frames_certain_ = is_certain ? frames_certain_ + 1 : 0;
  frames_uncertain_ = is_certain ? 0 : frames_uncertain_ + 1;
  frames_on_ = is_seen && fitness >= kOnFitness ? frames_on_ + 1 : 0;
  frames_off_ = !is_seen || fitness < kOffFitness ? frames_off_ + 1 : 0;
  if (frames_on_ >= kOnFrames) holds_ = true;
  if (frames_off_ >= kOffFrames) holds_ = is_confirmed_ = false;
  bears_out_ = balls == 0 || (all_seen && fitness >= kOnFitness);
  frames_borne_out_ = bears_out_ ? frames_borne_out_ + 1 : 0;
  if (holds_ && frames_borne_out_ >= kConfirmedFrames) is_confirmed_ = true;
}

}  // namespace turbidock::vision
