#include "vision/refinement_arbiter.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
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
// What a difference of scores tells of two poses: the logarithm of their odds. By likelihood, of
// 466 frames of 134 altered path-traced pairs in which one of the two was right.
constexpr double kOddsByScore = 120;
constexpr double kLeastWeight = 0.05;  // that is told

// Whether one of them is wrong where the other is right.
bool AreApart(const Pose& X_HM, const Pose& other_X_HM) {
  constexpr double kApart_m = 0.01;
  constexpr double kApart_rad = 0.0524;  // 3 degrees
  return (X_HM.p - other_X_HM.p).norm() > kApart_m ||
         AngleBetween(X_HM.q, other_X_HM.q) > kApart_rad;
}

// Whether two of the balls are seen, and nothing is of the third.
bool HoldsByTwo(const PoseEstimate& found, std::span<const double> support) {
  size_t seen = 0, nothing = 0;
  for (size_t b = 0; b < support.size(); ++b)
    if (support[b] >= Detection::kSeenSupport)
      ++seen;
    else if (found.ball_fitness[b] < Detection::kMatchedBallFitness)
      ++nothing;
  return seen == 2 && nothing == 1 && support.size() == 3;
}

}  // namespace

// X_HM turned about the line of the two balls that are matched best, which stay where they are.
Pose RefinementArbiter::RotatedAboutBallAxis(const Pose& X_HM, std::span<const double> match,
                                             double turn_rad) const {
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
  struct Candidate {
    Pose X_HM;
    double score = 0;
  };
  std::array<Candidate, kMaxCandidates> candidates;
  size_t considered = 0;
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
    candidates[considered++] = {refined->X_HM, score};
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
      consider(refine(RotatedAboutBallAxis(X_HM, std::span(match).first(balls),
                                           rng->Uniform(-kSwing_rad, kSwing_rad))));
  }
  last_X_HM_.reset();
  if (verdict.refined) last_X_HM_ = verdict.refined->X_HM.Canonical();
  for (const Candidate& candidate : std::span(candidates).first(considered)) {
    const double weight = 1 / (1 + std::exp(kOddsByScore * (best_score - candidate.score)));
    if (weight < (verdict.second ? verdict.second->weight : kLeastWeight)) continue;
    if (AreApart(candidate.X_HM, *last_X_HM_))
      verdict.second = {candidate.X_HM.Canonical(), weight};
  }
  // Where nothing is seen of a ball, the images do not tell the turn about the others.
  if (verdict.refined && !verdict.second && HoldsByTwo(found, by_ball(*verdict.refined)))
    verdict.second = {
        RotatedAboutBallAxis(*last_X_HM_, by_ball(*verdict.refined), kSwing_rad / 2).Canonical(),
        0.5};
  return verdict;
}

}  // namespace turbidock::vision
