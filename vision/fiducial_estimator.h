#pragma once
// What others use, to compare with: AprilTag's detector reads the marker's tags, AprilTag's or
// ArUco's, in each image, and the pose is the one that puts their corners where both images have
// them.

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "sim/base/camera.h"
#include "vision/fiducial_marker.h"
#include "vision/pose_estimator.h"
#include "vision/tag_codes.h"

struct apriltag_detector;  // of libapriltag

namespace turbidock::vision {

// F is 1 in a frame in which at least one tag is read in both images and its corners agree with the
// pose, and -1 in any other, whose pose stays what it was: a code is read or it is not, nothing
// lies between. `ball_fitness` is empty, `evaluations` 0. After such a frame the next is read about
// the tags alone, which is all that is carried over.
class FiducialEstimator : public PoseEstimator {
 public:
  // ConfigError for parameters out of range or without a tag.
  FiducialEstimator(const FiducialParams& params, const StereoRig& rig);

  const PoseEstimate& Update(const StereoImage& seen) override;
  void Reset() override {
    estimate_ = {};
    region_.reset();
  }
  std::optional<StereoRegion> RegionOfInterest() const override { return region_; }
  std::string_view name() const override { return "fiducial"; }

  // A tag as it was read in an image. Corners: left and right at the bottom, right and left at the
  // top, as the tag is printed; pixels.
  struct Reading {
    size_t tag = 0;  // of the parameters'
    Side side = Side::kLeft;
    std::array<Eigen::Vector2d, 4> corners_px;
  };
  // Of the last Update, those that the pose does not agree with included.
  const std::vector<Reading>& readings() const { return readings_; }

 private:
  struct DestroyDetector {
    void operator()(apriltag_detector* detector) const;
  };

  void Read(const Image3u8& image, const PixelRegion& region, Side side);
  // Where the tags are in the next frame, with room for what the vehicle moves until then.
  std::optional<PixelRegion> RegionOf(Side side) const;
  // Point i of a tag's corners, in M.
  Eigen::Vector3d Corner(size_t tag, size_t i) const;
  // The pose of these readings; nothing where no tag is read in both images.
  std::optional<Pose> Solve(const std::vector<Reading>& readings) const;
  double Error_px(const Reading& reading, const Pose& X_HM) const;

  FiducialParams params_;
  StereoRig rig_;
  FamilyPtr codes_;
  std::unique_ptr<apriltag_detector, DestroyDetector> detector_;
  Image1u8 grey_;
  std::vector<Reading> readings_;
  PoseEstimate estimate_;
  std::optional<StereoRegion> region_;  // what the next Update reads; nothing: all
};

}  // namespace turbidock::vision
