#include "sim/base/camera.h"

#include <cmath>

#include "sim/base/frames.h"

namespace turbidock {

CameraIntrinsics CameraIntrinsics::FromHorizontalFov(int width_px, int height_px, double fov_rad) {
  CameraIntrinsics camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = camera.fy_px = 0.5 * width_px / std::tan(0.5 * fov_rad);
  camera.cx_px = 0.5 * (width_px - 1);
  camera.cy_px = 0.5 * (height_px - 1);
  return camera;
}

double CameraIntrinsics::vertical_fov_rad() const { return 2 * std::atan(0.5 * height_px / fy_px); }

StereoRig RigParams::MakeRig() const {
  const CameraIntrinsics camera =
      CameraIntrinsics::FromHorizontalFov(width_px, height_px, horizontal_fov_rad);
  const Eigen::Quaterniond q_HC(HeadFromOptical());
  return {{camera, Pose{q_HC, {0, 0.5 * baseline_m, 0}}},
          {camera, Pose{q_HC, {0, -0.5 * baseline_m, 0}}}};
}

StereoRegion WholeImages(const StereoRig& rig) {
  return rig.Each([](const CameraIntrinsics& camera) -> PixelRegion {
    return {0, 0, camera.width_px, camera.height_px};
  });
}

}  // namespace turbidock
