#pragma once
// Refinement of a pose that a search found, to a fraction of a pixel.
//
// The outline of a ball is where viewing rays touch its sphere. From the assumed pose, rays are
// laid across the predicted outlines in both images, the edge of the ball's colour is located along
// each, and the pose is moved (Gauss-Newton with robust weights) until the viewing rays of the
// edges touch the spheres. Depth then rests on disparity and on how far the balls are apart, not on
// how large they look: one unknown, common to all outlines, takes up what lets every ball look
// larger or smaller than it is (blooming, blur, dark rims). Where balls differ in that, each has
// two more, along the image's lines and across them: video keeps less colour along a line, and of a
// dim ball the least.
//
// Parts of an outline that the marker's own box or another ball hides are left out.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/image.h"
#include "sim/base/pose_estimate.h"
#include "vision/marker_model.h"

namespace turbidock::vision {

struct Refined {
  Pose X_HM;
  // Of (position in H, rotation vector in H): 3 x metres, 3 x radians. Edges of one ball in one
  // image are off together, mostly: see PoseRefiner::Covariance.
  PoseCovariance covariance = PoseCovariance::Zero();
  // Of each ball, the share of the places across its outline, in both images together, that have an
  // edge where the pose predicts one. Places that are hidden or out of sight do not count; a ball
  // with few others has little support.
  std::array<double, kMaxBalls> support{};
  Stereo<double> camera_support = {};  // likewise of each image, its balls together
  int edges = 0;                       // that took part
  double residual_px = 0;              // root mean square over them
  double bloom_px = 0;                 // how much wider all outlines look than they are
};

class PoseRefiner {
 public:
  PoseRefiner(const MarkerParams& marker, const StereoRig& rig);

  // How far to either side of a ball's outline its edge is looked for.
  static double Reach_px(double radius_px) {
    return std::max(kMinReach_px, kReachRatio * radius_px);
  }

  // Reads pixels of `region` only. Nothing where fewer edges are found than a pose needs. Allocates
  // nothing.
  std::optional<Refined> Refine(const StereoImage& seen, const StereoRegion& region,
                                const Pose& X_HM);

 private:
  static constexpr double kReachRatio = 0.6, kMinReach_px = 4;
  // Position, rotation and bloom of all outlines; where balls differ, what each has more of it,
  // along the image's lines and across them.
  static constexpr int kCommon = 7, kMostUnknowns = kCommon + 2 * kMaxBalls;
  using CommonUnknowns = Eigen::Matrix<double, kCommon, 1>;
  using Unknowns = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostUnknowns, 1>;
  using Information =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostUnknowns, kMostUnknowns>;

  // One edge: its viewing ray touches the ball's sphere.
  struct Edge {
    int ball = 0;
    Side side = Side::kLeft;
    Eigen::Vector3d ray_C;  // unit
    double width_px = 0;    // over which the signal falls, by its slope there
    // In the last step: Tukey's weight, and how the residual follows the unknowns.
    double weight = 0;
    CommonUnknowns row = CommonUnknowns::Zero();
    Eigen::Vector2d ball_row = Eigen::Vector2d::Zero();
  };

  void FindEdges(const Image3u8& image, const PixelRegion& region, Side side, const Pose& X_HM,
                 double shrink);
  void Linearise(const Pose& X_HM, const Unknowns& moved);
  bool BallsDiffer() const;
  void CountSupport(Refined* refined) const;
  std::optional<double> BrightnessWidth_px(const StereoImage& seen, const StereoRegion& region,
                                           const Pose& X_HM);
  PoseCovariance Covariance(const Refined& refined,
                            const std::optional<double>& brightness_width_px,
                            const Unknowns& prior_weight, const Information& information,
                            double scale_px);
  bool IsHidden(int ball, const Eigen::Vector3d& p_MC, const Eigen::Vector3d& ray_M,
                double distance_m) const;

  MarkerParams marker_;
  StereoRig rig_;
  std::array<Eigen::Vector3d, kMaxBalls> hue_axis_;  // signal = axis . rgb, 0 for greys
  std::vector<Eigen::Vector2d> circle_;              // unit vectors
  std::vector<Edge> edges_;
  Stereo<std::array<int, kMaxBalls>> in_sight_;  // places across each ball's outline
  std::vector<double> residuals_px_, sorted_;
};

}  // namespace turbidock::vision
