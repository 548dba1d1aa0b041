#pragma once
// What a camera may see of a scene: triangles and balls ready for sim/view/surface_canvas.h, and
// planes for sim/view/seen_plane.h.

#include <mujoco/mujoco.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/image.h"
#include "sim/base/pose.h"
#include "sim/view/distractors.h"
#include "sim/view/geom_mesh.h"
#include "sim/view/seen_plane.h"

namespace turbidock::view {

// Positions are OpenGL's clip coordinates, z being the near plane's depth and w the depth along the
// optical axis, so that the depth buffer holds near / depth. x / w and y / w run from -1 to 1 over
// the image, y downwards: OpenGL's first row is the picture's top.
struct SurfaceList {
  struct Corner {
    std::array<float, 4> clip;
    uint32_t surface;  // MuJoCo geom id + 1, distractors after the geoms
  };
  // A corner of a rectangle in the image that holds what is in view of a ball's outline.
  struct BallCorner {
    std::array<float, 2> clip;    // where w = 1
    std::array<float, 2> ray;     // through it: (x, y) at depth 1 in the optical frame
    std::array<float, 4> ball_m;  // centre in the optical frame, radius
    uint32_t surface;
  };

  std::vector<Corner> corners;
  std::vector<uint32_t> triangles;  // three corners each, counter-clockwise seen from outside
  std::vector<BallCorner> ball_corners;
  std::vector<uint32_t> ball_triangles;
  // Part of the region outside of which no triangle or ball is seen; empty if none is.
  PixelRegion drawn;

  std::vector<SeenPlane> planes;
};

class SurfaceLister {
 public:
  // Keeps a reference to the model. Leaves out geoms of the hidden group and transparent ones.
  SurfaceLister(const mjModel& model, const std::vector<Distractor>& distractors, int hidden_group,
                float near_m);

  // Lists, at the computed positions in `data`, every geom and every distractor of which something
  // may lie in a region of the camera's image; what is listed of it does not depend on the region.
  // Of fewer distractors than there are the others are absent.
  void List(const mjData& data, std::span<const PlacedDistractor> distractors,
            const CameraIntrinsics& camera, const Pose& X_WC, const PixelRegion& region,
            SurfaceList* list) const;

 private:
  struct Drawn {
    int geom;
    bool ball, plane;
    double bounding_radius_m;  // around the geom's origin
    GeomMesh mesh;             // empty for a ball; of a plane corner 2 tells its half size
  };

  float near_m_;
  std::vector<Drawn> drawn_, distractors_;
};

}  // namespace turbidock::view
