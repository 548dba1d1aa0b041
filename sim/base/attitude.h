#pragma once
// What the vehicle feels of itself, without looking out.

#include <Eigen/Core>

namespace turbidock {

// Roll and pitch of the body frame B against the vertical (of the z-y-x factorisation), and the
// rates about B's x and y axes.
struct Attitude {
  Eigen::Vector2d roll_pitch_rad = Eigen::Vector2d::Zero();
  Eigen::Vector2d rate_rad_s = Eigen::Vector2d::Zero();
};

}  // namespace turbidock
