#pragma once
// What passes between renderer, water model and sensor.
//
// The renderer hands visibility to the water model: OpenGL decides which surface each pixel
// sees and how far away it is; all light is computed from that by sim/water.h, in linear units.

#include <cstdint>

#include "sim/base/image.h"
#include "sim/base/pose.h"

namespace turbidock::sim {

// One camera's view.
struct RenderedView {
  Image1u16 surface;  // MuJoCo geom id + 1; 0 where nothing was hit
  Image1f depth_m;    // along the optical axis (not the range); +inf where nothing was hit
};

// Both views of one instant.
struct RenderedStereo {
  int64_t tick = 0;
  RenderedView left, right;
  Pose X_WH;  // camera head in the world at that instant
};

// What the water model makes of it and hands to the sensor: linear radiance per channel at both
// cameras, W m^-2 sr^-1.
struct RadianceStereo {
  int64_t tick = 0;
  Image3f left, right;
};

}  // namespace turbidock::sim
