#pragma once
// What the docking procedure asks of the servo.

#include <cmath>

namespace turbidock::control {

// Where the marker shall be in the camera head H: position of M in H, and M's heading in H
// (0: the vehicle faces the marker squarely).
struct DesiredPose {
  double x_m = 0, y_m = 0, z_m = 0, yaw_rad = 0;

  bool IsFinite() const {
    return std::isfinite(x_m) && std::isfinite(y_m) && std::isfinite(z_m) && std::isfinite(yaw_rad);
  }
  bool operator==(const DesiredPose&) const = default;
};

}  // namespace turbidock::control
