#pragma once
// Which refined pose to believe, if any.
//
// The search's best pose is refined. Where every ball has its outlines there (Refined::support),
// that is it. Else what passes for one of the balls may be something else, such as a side of the
// box that an overexposed ball lights, or a ball may be hidden: F is then largest at a pose that is
// turned about the line of the two others. The pose refined in the last frame and the search's own,
// turned at random about that line, compete with it. Support counts more than F, which may be less
// at the true pose.

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
    int evaluations = 0;               // of the fitness, one for each refined pose
    std::optional<Refined> refined;    // the pose to believe; nothing: the search's
    std::optional<SecondPose> second;  // another that competed with it
  };

  RefinementArbiter(const MarkerParams& marker, const StereoRig& rig)
      : refiner_(marker, rig), marker_(marker) {}

  // Evaluations that Judge may need in the next frame.
  int MostEvaluations() const { return found_was_supported_ ? 1 : kMaxCandidates; }
  // Refines `found`, the search's best, with at most so many evaluations. Reads pixels of `region`
  // only. Allocates nothing.
  Verdict Judge(const StereoImage& seen, const StereoRegion& region, const Fitness& fitness,
                const PoseEstimate& found, int most_evaluations, Rng* rng);
  // There was no refined pose in the last frame.
  void Reset() {
    last_X_HM_.reset();
    found_was_supported_ = true;
  }

 private:
  static constexpr int kMaxCandidates = 3;

  Pose RotatedAboutBallAxis(const Pose& X_HM, std::span<const double> match, double turn_rad) const;

  PoseRefiner refiner_;
  MarkerParams marker_;
  std::optional<Pose> last_X_HM_;    // refined in the last frame
  bool found_was_supported_ = true;  // the search's own pose of the last frame, with every ball
};

}  // namespace turbidock::vision
