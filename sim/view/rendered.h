#pragma once
// What the renderer hands to the water model.
//
// It is visibility alone: OpenGL decides which surface each pixel
// sees and how far away it is; all light is computed from that by sim/light/water.h, in linear
// units.

#include <vector>

#include "sim/base/image.h"
#include "sim/base/pose.h"

namespace turbidock::view {

// One camera's view.
struct RenderedView {
  // MuJoCo geom id + 1, after the geoms the number of a distractor; 0 where nothing was hit
  Image1u16 surface;
  Image1f depth_m;  // along the optical axis (not the range); +inf where nothing was hit
};

// Something that is no part of the model (sim/view/distractors.h): where it is, if it is there.
struct PlacedDistractor {
  bool present = false;
  Pose X_WV;
};

// Both views of one instant.
struct RenderedStereo : Stereo<RenderedView> {
  Pose X_WH;  // camera head in the world at that instant
  Pose X_WK;  // body that holds marker and station, where it can move (vehicle::MooredBody)
  std::vector<PlacedDistractor> distractors{};
  // how far the current has carried what drifts in the water, in W
  Eigen::Vector3d drift_m = Eigen::Vector3d::Zero();
};

}  // namespace turbidock::view
