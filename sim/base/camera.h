#pragma once
// Pinhole cameras and the stereo rig. Conventions: sim/base/frames.h.

#include <Eigen/Core>

#include "sim/base/fields.h"
#include "sim/base/image.h"
#include "sim/base/pose.h"

namespace turbidock {

// Pinhole camera without distortion. The centre of the top-left pixel is (0, 0).
struct CameraIntrinsics {
  int width_px = 640, height_px = 480;
  double fx_px = 554.2562584220408, fy_px = 554.2562584220408;
  double cx_px = 319.5, cy_px = 239.5;

  // Square pixels, principal point in the middle of the image.
  static CameraIntrinsics FromHorizontalFov(int width_px, int height_px, double fov_rad);

  // Pixel of a point given in the optical frame C (z forward). Requires p_CQ.z() > 0.
  Eigen::Vector2d Project(const Eigen::Vector3d& p_CQ) const {
    return {fx_px * p_CQ.x() / p_CQ.z() + cx_px, fy_px * p_CQ.y() / p_CQ.z() + cy_px};
  }
  // Point on the viewing ray of pixel (u, v) at optical depth z = 1 m.
  Eigen::Vector3d RayAt(double u_px, double v_px) const {
    return {(u_px - cx_px) / fx_px, (v_px - cy_px) / fy_px, 1.0};
  }
  double vertical_fov_rad() const;
};

// A camera in its place: its optical frame in the camera head H.
struct MountedCamera : CameraIntrinsics {
  Pose X_HC;
};

using StereoRig = Stereo<MountedCamera>;
// All pixels of both cameras.
StereoRegion WholeImages(const StereoRig& rig);

// A rig of two equal, parallel cameras that look along the head's x axis, as a data file describes
// it.
struct RigParams {
  int width_px = 640;
  int height_px = 480;
  double horizontal_fov_rad = 1.0471975511965976;  // in water; 60 degrees
  double baseline_m = 0.12;

  static void Fields(auto& self, auto&& field) {
    field("width_px", self.width_px, InRange(16, 8192), "width of the cameras' images");
    field("height_px", self.height_px, InRange(16, 8192), "height of the cameras' images");
    field("horizontal_fov_rad", self.horizontal_fov_rad, InRange(0.1, 2.6),
          "cameras' horizontal field of view in water");
    field("baseline_m", self.baseline_m, InRange(0.01, 1),
          "distance between the cameras' optical centres");
  }

  StereoRig MakeRig() const;
};

}  // namespace turbidock
