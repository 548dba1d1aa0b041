#pragma once
// A geom's surface as triangles, for drawing.

#include <mujoco/mujoco.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace turbidock::view {

struct GeomMesh {
  std::vector<Eigen::Vector3d> vertices_m;         // in the geom's frame
  std::vector<std::array<uint32_t, 3>> triangles;  // counter-clockwise seen from outside
};

// A plane, capsule, ellipsoid, cylinder, box or mesh; spheres are drawn by their equation. Round
// shapes get facets whose corners lie on them and whose middles are 0.3 % of the radius inside. A
// plane without bounds reaches as far as the model's far clipping plane. ConfigError for height
// fields and other shapes without triangles.
GeomMesh MeshOf(const mjModel& m, int geom);

GeomMesh BoxMesh(const Eigen::Vector3d& half_size_m);

}  // namespace turbidock::view
