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
// Least support of a ball that needs no other pose to compare with: 91 % of the right poses that
// kAgreed_px was set by (refiner.cc) have it, and 0.3 % of the others.
constexpr double kSupported = 0.5;
// What support counts over F. At the true pose F may be less by 0.15 than where a lit side of the
// box passes for a ball, and the mean support is larger by 0.13 to 0.3.
constexpr double kSupportWeight = 2;
constexpr double kSwing_rad = 0.6;  // most that a pose is turned about two balls, to either side

}  // namespace

// X_HM turned about the line of the two balls that are matched best, which stay where they are.
Pose RefinementArbiter::RotatedAboutBallAxis(const Pose& X_HM, std::span<const double> match,
                                             Rng* rng) const {
  size_t first = 0, second = 1;
  if (match[second] > match[first]) std::swap(first, second);
  for (size_t b = 2; b < match.size(); ++b) {
    if (match[b] > match[first])
      second = std::exchange(first, b);
    else if (match[b] > match[second])
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
  const size_t balls = marker_.balls.size();
  Verdict verdict;
  double best_score = 0;  // of the pose that is believed so far
  const auto by_ball = [balls](const Refined& refined) {
    return std::span(refined.support).first(balls);
  };
  const auto consider = [&](const std::optional<Refined>& refined) {
    if (!refined || refined->residual_px > kLargestResidual_px) return;
    ++verdict.evaluations;
    const double f = fitness.Evaluate(refined->X_HM);
    if (f < found.fitness - kLargestLoss) return;
    // where a ball is not seen at all, chance gives it up to that much
    double support = 0;
    for (const double share : by_ball(*refined))
      if (share >= Detection::kSeenSupport) support += share / static_cast<double>(balls);
    const double score = f + kSupportWeight * support;
    if (verdict.refined && score <= best_score) return;
    best_score = score;
    verdict.refined = refined;
  };
  const auto refine = [&](const Pose& X_HM) { return refiner_.Refine(seen, region, X_HM); };
  const std::optional<Refined> of_found = refine(found.X_HM);
  const bool is_supported =
      balls < 3 || (of_found && std::ranges::min(by_ball(*of_found)) >= kSupported);
  // Support that ends from one frame to the next: the search was drawn to where F is larger.
  const bool ends = !is_supported && most_evaluations == 1 && last_X_HM_;
  consider(ends ? refine(*last_X_HM_) : of_found);
  found_was_supported_ = balls < 3 || (is_supported && verdict.refined);
  if (!found_was_supported_) {
    const Pose X_HM = verdict.refined ? verdict.refined->X_HM : found.X_HM;
    std::array<double, kMaxBalls> match{};
    std::ranges::copy(found.ball_fitness, match.begin());
    if (verdict.refined) match = verdict.refined->support;
    int left = most_evaluations - 1;
    if (left > 0 && last_X_HM_) {
      consider(refine(*last_X_HM_));
      --left;
    }
    for (; left > 0; --left)
      consider(refine(RotatedAboutBallAxis(X_HM, std::span(match).first(balls), rng)));
  }
  last_X_HM_.reset();
  if (verdict.refined) last_X_HM_ = verdict.refined->X_HM.Canonical();
  return verdict;
}

}  // namespace turbidock::vision
