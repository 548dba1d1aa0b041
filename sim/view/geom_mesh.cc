#include "sim/view/geom_mesh.h"

#include <cmath>
#include <numbers>
#include <string>

#include "sim/base/check.h"

namespace turbidock::view {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSlices = 40;           // around an axis
constexpr int kHalfCircleSides = 24;  // from pole to pole

// What a profile of points (radius, z), listed upwards, sweeps around z.
GeomMesh Revolve(const std::vector<Vector2d>& profile) {
  GeomMesh mesh;
  for (const Vector2d& point : profile)
    for (int slice = 0; slice < kSlices; ++slice) {
      const double angle_rad = 2 * std::numbers::pi * slice / kSlices;
      mesh.vertices_m.emplace_back(point.x() * std::cos(angle_rad), point.x() * std::sin(angle_rad),
                                   point.y());
    }
  for (uint32_t low = 0; low + 1 < profile.size(); ++low)
    for (uint32_t slice = 0; slice < kSlices; ++slice) {
      const uint32_t next = (slice + 1) % kSlices;
      const uint32_t a = low * kSlices + slice, b = low * kSlices + next;
      const uint32_t c = b + kSlices, d = a + kSlices;
      if (profile[low].x() > 0) mesh.triangles.push_back({a, b, c});
      if (profile[low + 1].x() > 0) mesh.triangles.push_back({a, c, d});
    }
  return mesh;
}

// Part of a circle's profile around (0, z), its sides numbered from the lower pole.
void AddArc(double radius, double z, int first_side, int last_side,
            std::vector<Vector2d>* profile) {
  for (int side = first_side; side <= last_side; ++side) {
    const double angle_rad = std::numbers::pi * side / kHalfCircleSides;
    const bool pole = side == 0 || side == kHalfCircleSides;
    profile->emplace_back(pole ? 0 : radius * std::sin(angle_rad),
                          z - radius * std::cos(angle_rad));
  }
}

GeomMesh UnitBall() {
  std::vector<Vector2d> profile;
  AddArc(1, 0, 0, kHalfCircleSides, &profile);
  return Revolve(profile);
}

GeomMesh Capsule(double radius, double half_length) {
  std::vector<Vector2d> profile;
  AddArc(radius, -half_length, 0, kHalfCircleSides / 2, &profile);
  AddArc(radius, half_length, kHalfCircleSides / 2, kHalfCircleSides, &profile);
  return Revolve(profile);
}

GeomMesh Plane(double half_x, double half_y) {
  return {{{-half_x, -half_y, 0}, {half_x, -half_y, 0}, {half_x, half_y, 0}, {-half_x, half_y, 0}},
          {{0, 1, 2}, {0, 2, 3}}};
}

GeomMesh FromAsset(const mjModel& m, int asset) {
  GeomMesh mesh;
  for (int i = 0; i < m.mesh_vertnum[asset]; ++i)
    mesh.vertices_m.push_back(
        Eigen::Vector3f::Map(m.mesh_vert + 3 * (m.mesh_vertadr[asset] + i)).cast<double>());
  for (int i = 0; i < m.mesh_facenum[asset]; ++i) {
    const int* face = m.mesh_face + 3 * (m.mesh_faceadr[asset] + i);
    mesh.triangles.push_back({static_cast<uint32_t>(face[0]), static_cast<uint32_t>(face[1]),
                              static_cast<uint32_t>(face[2])});
  }
  return mesh;
}

}  // namespace

GeomMesh BoxMesh(const Vector3d& half) {
  GeomMesh mesh;
  for (int corner = 0; corner < 8; ++corner)
    mesh.vertices_m.emplace_back((corner & 1 ? 1 : -1) * half.x(), (corner & 2 ? 1 : -1) * half.y(),
                                 (corner & 4 ? 1 : -1) * half.z());
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return mesh;
}

GeomMesh MeshOf(const mjModel& m, int geom) {
  const Vector3d size = Vector3d::Map(m.geom_size + 3 * geom);
  switch (m.geom_type[geom]) {
    case mjGEOM_PLANE: {
      const double far_m = m.vis.map.zfar * m.stat.extent;
      return Plane(size.x() > 0 ? size.x() : far_m, size.y() > 0 ? size.y() : far_m);
    }
    case mjGEOM_ELLIPSOID: {
      GeomMesh mesh = UnitBall();
      for (Vector3d& p : mesh.vertices_m) p = p.cwiseProduct(size).eval();
      return mesh;
    }
    case mjGEOM_CAPSULE:
      return Capsule(size.x(), size.y());
    case mjGEOM_CYLINDER:
      return Revolve({{0, -size.y()}, {size.x(), -size.y()}, {size.x(), size.y()}, {0, size.y()}});
    case mjGEOM_BOX:
      return BoxMesh(size);
    case mjGEOM_MESH:
      return FromAsset(m, m.geom_dataid[geom]);
    default: {
      const char* name = mj_id2name(&m, mjOBJ_GEOM, geom);
      throw ConfigError("geom " + (name ? std::string(name) : "number " + std::to_string(geom)),
                        "its shape cannot be drawn: use plane, sphere, capsule, ellipsoid, "
                        "cylinder, box, or mesh");
    }
  }
}

}  // namespace turbidock::view
