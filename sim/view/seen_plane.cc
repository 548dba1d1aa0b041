#include "sim/view/seen_plane.h"

#include <algorithm>
#include <cmath>

#include "sim/base/vector_clones.h"

namespace turbidock::view {
namespace {

using Eigen::Vector3d;

// OpenGL snaps corners to 1/256 of a pixel. Edges reach this much farther, so that none of what
// stands on a plane opens a gap beside it.
constexpr double kReach_px = 1.0 / 64;

// Columns of a row that show the plane, and the inverse of its depth there.
struct PlaneRow {
  int begin, end;
  float at_zero, per_column;
  uint16_t surface;
};

TURBIDOCK_VECTOR_CLONES
void PaintNearest(const PlaneRow& row, uint16_t* __restrict surface, float* __restrict nearness) {
  const auto [begin, end, at_zero, per_column, id] = row;
  for (int u = begin; u < end; ++u) {
    const float here = at_zero + per_column * static_cast<float>(u);
    const bool nearest = here > nearness[u];
    nearness[u] = nearest ? here : nearness[u];
    surface[u] = nearest ? id : surface[u];
  }
}

// In columns [first, last).
TURBIDOCK_VECTOR_CLONES
void PaintAlone(const PlaneRow& row, int first, int last, uint16_t* __restrict surface,
                float* __restrict nearness) {
  const auto [begin, end, at_zero, per_column, id] = row;
  const auto nothing = [&](int from, int to) {
    std::fill(nearness + from, nearness + to, 0.0f);
    std::fill(surface + from, surface + to, uint16_t{0});
  };
  nothing(first, begin);
  for (int u = begin; u < end; ++u) nearness[u] = at_zero + per_column * static_cast<float>(u);
  std::fill(surface + begin, surface + end, id);
  nothing(end, last);
}

}  // namespace

std::optional<SeenPlane> PlaneSeen(const CameraIntrinsics& camera, const Eigen::Matrix3d& R_CG,
                                   const Eigen::Vector3d& p_CG, const Eigen::Vector2d& half_m,
                                   double near_m, uint16_t surface) {
  const Vector3d normal = R_CG.col(2);
  // n . p of its points; the camera is in front of it where that is negative
  const double offset_m = normal.dot(p_CG);
  if (offset_m >= 0) return std::nullopt;
  // n . ray at a pixel, as an affine function, for any vector n
  const auto along_ray = [&](const Vector3d& n) -> Vector3d {
    const double u = n.x() / camera.fx_px, v = n.y() / camera.fy_px;
    return {n.z() - u * camera.cx_px - v * camera.cy_px, u, v};
  };
  const Vector3d per_depth = along_ray(normal) / offset_m;  // 1 / depth
  SeenPlane seen{.surface = surface, .nearness = near_m * per_depth, .within = {}};
  for (int axis = 0; axis < 2; ++axis) {
    // the place along the axis, over the depth
    const Vector3d place = along_ray(R_CG.col(axis)) - R_CG.col(axis).dot(p_CG) * per_depth;
    seen.within[2 * axis] = half_m[axis] * per_depth - place;
    seen.within[2 * axis + 1] = half_m[axis] * per_depth + place;
  }
  for (Vector3d& f : seen.within) f[0] += kReach_px * f.tail<2>().norm();
  return seen;
}

void PaintPlane(const SeenPlane& plane, const PixelRegion& region, Onto onto, Image1u16* surface,
                Image1f* nearness) {
  for (int v = region.row_begin; v < region.row_end; ++v) {
    double begin = region.column_begin, end = region.column_end - 1;
    // keeps the columns where f >= 0
    const auto narrow = [&](double f0, double fu) {
      if (fu > 0)
        begin = std::max(begin, std::ceil(-f0 / fu));
      else if (fu < 0)
        end = std::min(end, std::floor(-f0 / fu));
      else if (f0 < 0)
        end = begin - 1;
    };
    const auto in_row = [&](const Vector3d& f) { return f[0] + f[2] * v; };
    const double near_at_zero = in_row(plane.nearness);
    narrow(near_at_zero, plane.nearness[1]);
    narrow(1 - near_at_zero, -plane.nearness[1]);
    for (const Vector3d& within : plane.within) narrow(in_row(within), within[1]);
    begin = std::min<double>(begin, region.column_end);
    end = std::max<double>(end + 1, begin);
    const PlaneRow row = {static_cast<int>(begin), static_cast<int>(end),
                          static_cast<float>(near_at_zero), static_cast<float>(plane.nearness[1]),
                          plane.surface};
    if (onto == Onto::kNothing)
      PaintAlone(row, region.column_begin, region.column_end, surface->row(v), nearness->row(v));
    else
      PaintNearest(row, surface->row(v), nearness->row(v));
  }
}

}  // namespace turbidock::view
