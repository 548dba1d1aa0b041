#pragma once
// The classical way, to compare with: segment each ball by its colour in each image, triangulate
// its centre, and turn the marker's layout onto the three-dimensional points (absolute orientation;
// Umeyama 1991). It searches nothing and needs every ball to be seen well in both images.

#include <optional>
#include <vector>

#include "vision/fitness.h"
#include "vision/hue_labels.h"
#include "vision/pose_estimator.h"

namespace turbidock::vision {

struct BlobParams {
  int least_pixels = 20;  // of a blob; a ball at 1.6 m has 150

  static void Fields(auto& self, auto&& field) {
    field("least_pixels", self.least_pixels, InRange(1, 100000),
          "number of pixels of the smallest blob that counts as a ball");
  }
};

class BlobEstimator : public PoseEstimator {
 public:
  BlobEstimator(const BlobParams& params, const MarkerParams& marker, const HueParams& hue,
                const StereoRig& rig);

  // Where fewer than three balls are found in both images the pose stays what it was and the
  // fitness is -1.
  const PoseEstimate& Update(const StereoImage& seen) override;
  void Reset() override { estimate_ = {}; }
  std::string_view name() const override { return "blobs"; }

 private:
  // Centroid of the largest 4-connected set of pixels with that ball's label.
  std::optional<Eigen::Vector2d> LargestBlob(const Image1u8& labels, int ball);

  BlobParams params_;
  MarkerParams marker_;
  StereoRig rig_;
  HueLabeller labeller_;
  Stereo<Image1u8> labels_;
  Image1u8 visited_;
  Fitness fitness_;
  std::vector<int> stack_;
  PoseEstimate estimate_;
};

// The point nearest to the viewing rays of two pixels, in the camera head; nothing when the rays
// are parallel or meet behind the cameras.
std::optional<Eigen::Vector3d> Triangulate(const StereoRig& rig,
                                           const Stereo<Eigen::Vector2d>& pixels);

}  // namespace turbidock::vision
