#pragma once
// Where to draw an estimated marker on a camera image: the published dotted circles.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "vision/marker_model.h"

namespace turbidock::vision {

// One ball's circle in one image. Pixel coordinates: (0, 0) is the centre of the top-left pixel.
struct ProjectedBall {
  Eigen::Vector2d center_px;
  double radius_px = 0;
  std::array<uint8_t, 3> rgb{};
};

// Circles of the balls in front of that camera, in the marker's order, for a marker at X_HM.
// Circles may lie outside the image.
std::vector<ProjectedBall> ProjectBalls(const MarkerParams& marker, const MountedCamera& camera,
                                        const Pose& X_HM);

}  // namespace turbidock::vision
