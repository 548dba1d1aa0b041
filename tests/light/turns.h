#pragma once
// How light turns on the walks of oracles.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/base/random.h"

namespace turbidock::testing {

// The cosine of a turn, drawn from Henyey and Greenstein's function (1941) with mean cosine g.
inline double HenyeyGreenstein(double g, Rng* rng) {
  const double q = (1 - g * g) / (1 - g + 2 * g * rng->Uniform());
  return (1 + g * g - q * q) / (2 * g);
}

// A direction at an angle of that cosine to the direction u, about it at random.
inline Eigen::Vector3d Turned(const Eigen::Vector3d& u, double cosine, Rng* rng) {
  const double angle_rad = 2 * std::numbers::pi * rng->Uniform();
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  const Eigen::Vector3d v = u.unitOrthogonal();
  return (cosine * u + sine * (std::cos(angle_rad) * v + std::sin(angle_rad) * u.cross(v)))
      .normalized();
}

}  // namespace turbidock::testing
