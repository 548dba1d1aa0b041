#pragma once
// Refinement of a pose that a search found, to a fraction of a pixel.
//
// The outline of a ball is where viewing rays touch its sphere. From the assumed pose, rays are
// laid across the predicted outlines in both images, the edge of the ball's colour is located along
// each, and the pose is moved (Gauss-Newton with robust weights) until the viewing rays of the
// edges touch the spheres. Depth then rests on disparity and on how far the balls are apart, not on
// how large they look: one unknown, common to all outlines, takes up what lets every ball look
// larger or smaller than it is (blooming, blur, dark rims).
//
// Parts of an outline that the marker's own box or another ball hides are left out.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/fields.h"
#include "sim/base/image.h"
#include "vision/marker_model.h"

namespace turbidock::vision {

struct RefineParams {
  bool enabled = true;
  int iterations = 6;
  int outline_points = 32;        // across each ball's outline in each image
  double reach_ratio = 0.6;       // how far to either side of an outline its edge is looked for,
  double least_reach_px = 4;      // over the projected radius; at least this
  double least_contrast_dn = 6;   // of an edge: four times a noise of 1.5 DN
  double edge_noise_px = 0.15;    // of one located edge, what small errors of the model do included
  double prior_position_m = 0.1;  // how well the search alone is trusted
  double prior_rotation_rad = 0.2;
  double bloom_px = 2;  // how much all outlines may be wider or narrower

  static void Fields(auto& self, auto&& field) {
    field("enabled", self.enabled, Range{}, "refine what the search found");
    field("iterations", self.iterations, InRange(1, 50), "Gauss-Newton steps");
    field("outline_points", self.outline_points, InRange(8, 360),
          "places across each ball's outline where its edge is looked for");
    field("reach_ratio", self.reach_ratio, InRange(0.1, 1),
          "how far from the outline an edge is looked for, over the projected radius");
    field("least_reach_px", self.least_reach_px, InRange(2, 40), "the same, at least");
    field("least_contrast_dn", self.least_contrast_dn, InRange(1, 255),
          "least step in colour that counts as an edge");
    field("edge_noise_px", self.edge_noise_px, InRange(0.01, 10),
          "standard deviation of a located edge");
    field("prior_position_m", self.prior_position_m, Above(0),
          "standard deviation of the search's position");
    field("prior_rotation_rad", self.prior_rotation_rad, Above(0),
          "standard deviation of the search's rotation");
    field("bloom_px", self.bloom_px, InRange(0, 10),
          "standard deviation of how much wider all outlines may look");
  }
};

struct Refined {
  Pose X_HM;
  // Of (position in H, rotation vector in H): 3 x metres, 3 x radians.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  int edges = 0;           // that took part
  double residual_px = 0;  // root mean square over them
  double bloom_px = 0;     // how much wider all outlines look than they are
};

class PoseRefiner {
 public:
  PoseRefiner(const RefineParams& params, const MarkerParams& marker, const StereoRig& rig);

  // Reads pixels of `region` only. Nothing where fewer edges are found than a pose needs. Allocates
  // nothing.
  std::optional<Refined> Refine(const StereoImage& seen, const StereoRegion& region,
                                const Pose& X_HM);

 private:
  struct Camera {
    CameraIntrinsics intrinsics;
    Pose X_HC;
  };
  // One edge: its viewing ray touches the ball's sphere.
  struct Edge {
    int ball = 0, camera = 0;
    Eigen::Vector3d ray_C;  // unit
    double contrast_dn = 0;
  };

  void FindEdges(const Image3u8& image, const PixelRegion& region, int camera, const Pose& X_HM,
                 double shrink);
  bool IsHidden(int ball, const Eigen::Vector3d& p_MC, const Eigen::Vector3d& ray_M,
                double distance_m) const;

  RefineParams params_;
  MarkerParams marker_;
  std::array<Camera, 2> cameras_;
  std::array<Eigen::Vector3d, kMaxBalls> hue_axis_;  // signal = axis . rgb, 0 for greys
  std::vector<Eigen::Vector2d> circle_;              // unit vectors
  std::vector<Edge> edges_;
  std::vector<double> residuals_px_, sorted_;
};

}  // namespace turbidock::vision
