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
#include <span>
#include <vector>

#include "sim/base/image.h"
#include "vision/marker_model.h"

namespace turbidock::vision {

// F and where it comes from.
struct FitnessByBall {
  double fitness = 0;
  Stereo<std::array<double, kMaxBalls>> in;  // F of one ball in one camera

  double ball(int b) const { return 0.5 * (in.left[b] + in.right[b]); }
};

class Fitness {
 public:
  // Refers to the label images (see HueLabeller), which must outlive it and, at each evaluation,
  // have the rig's size.
  Fitness(const MarkerParams& marker, const StereoRig& rig, const Stereo<Image1u8>& labels);

  // From now on labels are read inside this region only, which must lie inside the images;
  // elsewhere nothing matches. Initially the whole images.
  void Confine(const StereoRegion& region);

  // F in [-1, 1] of a marker at X_HM.
  double Evaluate(const Pose& X_HM) const;
  FitnessByBall EvaluateByBall(const Pose& X_HM) const;
  // The same F, bit for bit, of many poses at once and faster. Allocates nothing.
  void EvaluateAll(std::span<const Pose> X_HM, std::span<double> fitness) const;

  int ball_count() const { return ball_count_; }

 private:
  struct Camera {
    CameraIntrinsics intrinsics;
    Eigen::Matrix3d R_CH;
    Eigen::Vector3d p_CH;
    const Image1u8* labels;
    PixelRegion region;
  };
  // A ball's circle in label coordinates: half a pixel up and to the left of pixel coordinates, so
  // that cutting the fraction off rounds to the nearest pixel.
  struct Circle {
    float u = 0, v = 0, radius = 0;
  };
  enum class Place { kInside, kPartly, kOutside };

  // Where the circle and its envelope are with respect to the region that is read.
  Place Project(const Camera& camera, int ball, const Eigen::Vector3d& p_HQ, Circle* circle) const;
  // Inner minus outer matches of one ball in one camera, -24..36; F = match / 30 - 0.2.
  int Match(const Camera& camera, int ball, const Eigen::Vector3d& p_HQ) const;
  int MatchPointByPoint(const Camera& camera, int ball, const Circle& circle) const;
  double FitnessOfMatches(int match) const;

  SamplePoints samples_;
  float reach_;  // of the farthest sample point, in radii
  int ball_count_;
  std::array<Eigen::Vector3d, kMaxBalls> p_MQ_m_;
  std::array<double, kMaxBalls> radius_m_;
  Stereo<Camera> cameras_;
};

}  // namespace turbidock::vision
