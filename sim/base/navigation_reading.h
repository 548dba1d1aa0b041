#pragma once
// What the vehicle's navigation says without looking at the marker.

#include <Eigen/Core>
#include <optional>

namespace turbidock {

// Of a frame: where the camera head H is in the station's chart, which is the marker's frame M.
// Depth and heading come with every reading, the horizontal position with a fix.
struct NavigationReading {
  double z_m = 0, heading_rad = 0;
  std::optional<Eigen::Vector2d> fix_xy_m = {};  // nothing between fixes and in a drop-out
  // Of their noise, as a data sheet has it: what is constant or drifts is not in it.
  double z_std_m = 0, heading_std_rad = 0, fix_std_m = 0;
};

}  // namespace turbidock
