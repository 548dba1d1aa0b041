#pragma once
// The fitness of an assumed pose: how well the marker's sample points, projected into both images,
// meet its colours. One ball in one camera gives
//
//   F = (1 / 60) (sum over 36 inner points of p - sum over 24 outer points of p),
//
// p = +1 where the nearest pixel agrees with the ball's colour and -1 elsewhere, outside the image
// and behind the camera. F is the mean over balls and cameras: +1 when the balls and nothing else
// match, -0.2 when nothing matches, +0.2 when everything does.

#include <array>

#include "sim/base/image.h"
#include "vision/marker_model.h"

namespace turbidock::vision {

// F and where it comes from.
struct FitnessByBall {
  double fitness = 0;
  std::array<double, kMaxBalls> left{}, right{};  // F of one ball in one camera

  double ball(int b) const { return 0.5 * (left[b] + right[b]); }
};

class Fitness {
 public:
  // Refers to the two label images (see HueLabeller), which must outlive it and, at each
  // evaluation, have the rig's size.
  Fitness(const MarkerParams& marker, const StereoRig& rig, const Image1u8& left_labels,
          const Image1u8& right_labels);

  // F in [-1, 1] of a marker at X_HM.
  double Evaluate(const Pose& X_HM) const;
  FitnessByBall EvaluateByBall(const Pose& X_HM) const;

  int ball_count() const { return ball_count_; }

 private:
  struct Camera {
    CameraIntrinsics intrinsics;
    Eigen::Matrix3d R_CH;
    Eigen::Vector3d p_CH;
    const Image1u8* labels;
  };

  // Inner minus outer matches of one ball in one camera, -24..36; F = match / 30 - 0.2.
  int Match(const Camera& camera, int ball, const Eigen::Vector3d& p_HQ) const;

  SamplePoints samples_;
  float reach_;  // of the farthest sample point, in radii
  int ball_count_;
  std::array<Eigen::Vector3d, kMaxBalls> p_MQ_m_;
  std::array<double, kMaxBalls> radius_m_;
  Camera left_, right_;
};

}  // namespace turbidock::vision
