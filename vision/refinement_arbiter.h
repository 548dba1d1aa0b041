#pragma once
// Which refined pose to believe, if any.
//
// Mostly the search's best pose is refined, and believed unless what refinement found contradicts
// the search: then the edges were of something else. Where two balls only are matched, the third
// hidden by the box or another ball, a turn about the line of the two costs the search next to
// nothing, but the outlines tell it: the pose refined in the last frame and the search's own,
// turned at random, then compete.

#include <optional>
#include <span>

#include "sim/base/pose_estimate.h"
#include "sim/base/random.h"
#include "vision/fitness.h"
#include "vision/refiner.h"

namespace turbidock::vision {

class RefinementArbiter {
 public:
  struct Verdict {
    int evaluations = 0;             // of the fitness, one for each refined pose
    std::optional<Refined> refined;  // the pose to believe; nothing: the search's
  };

  RefinementArbiter(const MarkerParams& marker, const StereoRig& rig)
      : refiner_(marker, rig), marker_(marker) {}

  // Evaluations that Judge may need where the balls are matched like this.
  int MostEvaluations(std::span<const double> ball_fitness) const {
    return IsHeldByTwo(ball_fitness) ? kMaxCandidates : 1;
  }
  // Refines `found`, the search's best, with at most so many evaluations. Reads pixels of `region`
  // only. Allocates nothing.
  Verdict Judge(const StereoImage& seen, const StereoRegion& region, const Fitness& fitness,
                const PoseEstimate& found, int most_evaluations, Rng* rng);
  // There was no refined pose in the last frame.
  void Reset() { last_X_HM_.reset(); }

 private:
  static constexpr int kMaxCandidates = 3;

  static bool IsHeldByTwo(std::span<const double> ball_fitness);
  Pose RotatedAboutBallAxis(const Pose& X_HM, std::span<const double> ball_fitness, Rng* rng) const;

  PoseRefiner refiner_;
  MarkerParams marker_;
  std::optional<Pose> last_X_HM_;  // refined in the last frame
};

}  // namespace turbidock::vision
