#include "vision/refinement_arbiter.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <utility>

#include "vision/detection.h"

namespace turbidock::vision {
namespace {

constexpr double kLargestLoss = 0.25;  // of F; a hidden half of a ball costs up to 0.2
constexpr double kLargestResidual_px = 1.0;
constexpr double kSwing_rad = 0.6;  // most that a pose is turned about two balls, to either side

}  // namespace

bool RefinementArbiter::IsHeldByTwo(std::span<const double> ball_fitness) {
  return ball_fitness.size() > 2 && std::ranges::count_if(ball_fitness, [&](double match) {
                                      return match >= Detection::kMatchedBallFitness;
                                    }) == 2;
}

// X_HM turned about the line of the two balls that are matched best, which stay where they are.
Pose RefinementArbiter::RotatedAboutBallAxis(const Pose& X_HM, std::span<const double> ball_fitness,
                                             Rng* rng) const {
  size_t first = 0, second = 1;
  if (ball_fitness[second] > ball_fitness[first]) std::swap(first, second);
  for (size_t b = 2; b < ball_fitness.size(); ++b) {
    if (ball_fitness[b] > ball_fitness[first])
      second = std::exchange(first, b);
    else if (ball_fitness[b] > ball_fitness[second])
      second = b;
  }
  const Eigen::Vector3d& p_MQ = marker_.balls[first].p_MQ_m;
  const Eigen::Vector3d axis = (marker_.balls[second].p_MQ_m - p_MQ).normalized();
  const double turn_rad = rng->Uniform(-kSwing_rad, kSwing_rad);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(turn_rad, axis));
  return X_HM * Pose{turn, p_MQ - turn * p_MQ};
}

RefinementArbiter::Verdict RefinementArbiter::Judge(const StereoImage& seen,
                                                    const StereoRegion& region,
                                                    const Fitness& fitness,
                                                    const PoseEstimate& found, int most_evaluations,
                                                    Rng* rng) {
  std::array<Pose, kMaxCandidates> candidates{found.X_HM};
  int count = 1;
  if (IsHeldByTwo(found.ball_fitness)) {
    const auto add = [&](const Pose& X_HM) { candidates[static_cast<size_t>(count++)] = X_HM; };
    if (count < most_evaluations) add(RotatedAboutBallAxis(found.X_HM, found.ball_fitness, rng));
    if (count < most_evaluations && last_X_HM_) add(*last_X_HM_);
  }
  Verdict verdict;
  double best_fitness = found.fitness - kLargestLoss;
  for (const Pose& candidate : std::span(candidates).first(static_cast<size_t>(count))) {
    const std::optional<Refined> refined = refiner_.Refine(seen, region, candidate);
    if (!refined || refined->residual_px > kLargestResidual_px) continue;
    const double f = fitness.Evaluate(refined->X_HM);
    ++verdict.evaluations;
    if (verdict.refined ? f <= best_fitness : f < best_fitness) continue;
    verdict.refined = refined;
    best_fitness = f;
  }
  last_X_HM_.reset();
  if (verdict.refined) last_X_HM_ = verdict.refined->X_HM.Canonical();
  return verdict;
}

}  // namespace turbidock::vision
