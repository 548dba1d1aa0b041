#pragma once
// Images of fiducial tags as a closed form has them.

#include "sim/base/camera.h"
#include "sim/base/image.h"
#include "vision/fiducial_marker.h"
#include "vision/tag_codes.h"

namespace turbidock::testing {

// What a camera sees of the tags before a wall: each pixel the mean of 16 rays.
inline Image3u8 Paint(const vision::FiducialParams& params, const MountedCamera& camera,
                      const Pose& X_HM, uint8_t wall_dn = 50) {
  Image3u8 image(camera.width_px, camera.height_px, wall_dn);
  for (const vision::TagParams& tag : params.tags) {
    const Pose X_TC = (camera.X_HC.Inverse() * X_HM * tag.X_MT()).Inverse();
    const vision::TagCells cells = vision::CellsOf(params.family, tag.id);
    const double middle = cells.across / 2.0, per_m = (cells.across - 2) / tag.size_m;
    for (int v = 0; v < image.height(); ++v)
      for (int u = 0; u < image.width(); ++u) {
        double sum = 0;
        bool touched = false;
        for (int k = 0; k < 16; ++k) {
          const Eigen::Vector3d ray_T =
              X_TC.q * camera.RayAt(u - 0.375 + 0.25 * (k % 4), v - 0.375 + 0.25 * (k / 4));
          const double t = -X_TC.p.x() / ray_T.x();
          const Eigen::Vector3d p_T = X_TC.p + t * ray_T;
          const int column = static_cast<int>(std::floor(middle - per_m * p_T.y())),
                    row = static_cast<int>(std::floor(middle - per_m * p_T.z()));
          const bool on =
              t > 0 && column >= 0 && column < cells.across && row >= 0 && row < cells.across;
          touched = touched || on;
          sum += !on ? wall_dn : cells(row, column) ? 200 : 20;
        }
        if (touched) std::fill_n(image.at(u, v), 3, static_cast<uint8_t>(std::lround(sum / 16)));
      }
  }
  return image;
}

inline StereoImage Paint(const vision::FiducialParams& params, const StereoRig& rig,
                         const Pose& X_HM, uint8_t wall_dn = 50) {
  StereoImage seen;
  for (const Side side : kSides) seen[side] = Paint(params, rig[side], X_HM, wall_dn);
  return seen;
}

}  // namespace turbidock::testing
