#pragma once
// What a camera may see of a scene, as triangles and balls ready for sim/view/rasteriser.h.

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

namespace turbidock::view {

struct SurfaceList {
  // `surface` is a MuJoCo geom id + 1; distractors come after the geoms.
  struct Triangle {
    std::array<uint32_t, 3> corner;  // counter-clockwise seen from outside
    uint16_t surface;
  };
  struct Ball {
    Eigen::Vector3f p_CQ;  // centre in the optical frame
    float radius_m;
    uint16_t surface;
    PixelRegion bounds;  // of its outline
    float cx_px, cy_px, per_fx, per_fy;
  };

  std::vector<Eigen::Vector3d> corners;  // homogeneous pixels (u w, v w, w), w the depth
  std::vector<Triangle> triangles;
  std::vector<Ball> balls;
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
    bool ball;
    double bounding_radius_m;  // around the geom's origin
    GeomMesh mesh;             // empty for a ball
  };

  float near_m_;
  std::vector<Drawn> drawn_, distractors_;
};

}  // namespace turbidock::view
