#pragma once
// What the renderer hands to the water model.
//
// It is visibility alone: OpenGL decides which surface each pixel
// sees and how far away it is; all light is computed from that by sim/light/water.h, in linear
// units.

#include "sim/base/image.h"
#include "sim/base/pose.h"

namespace turbidock::view {

// One camera's view.
struct RenderedView {
  Image1u16 surface;  // MuJoCo geom id + 1; 0 where nothing was hit
  Image1f depth_m;    // along the optical axis (not the range); +inf where nothing was hit
};

// Both views of one instant.
struct RenderedStereo : Stereo<RenderedView> {
  Pose X_WH;  // camera head in the world at that instant
};

}  // namespace turbidock::view
