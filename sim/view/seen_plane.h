#pragma once
// A bounded plane in a picture. The inverse of its depth is an affine function of the pixel, and so
// is each of its four edges' distance over the depth: no triangles are needed. A floor fills half
// of a picture, and OpenGL's way to it costs more than all that stands on it.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "sim/base/camera.h"
#include "sim/base/image.h"

namespace turbidock::view {

// Affine functions are [f0, fu, fv]: f0 + fu u + fv v at pixel (u, v).
struct SeenPlane {
  uint16_t surface = 0;                   // as in RenderedView
  Eigen::Vector3d nearness;               // near plane's depth / depth; 1 at the near plane
  std::array<Eigen::Vector3d, 4> within;  // >= 0 between the edges
};

// Seen from its front, its z axis: nothing from behind. The plane's frame G is given in the
// optical one.
std::optional<SeenPlane> PlaneSeen(const CameraIntrinsics& camera, const Eigen::Matrix3d& R_CG,
                                   const Eigen::Vector3d& p_CG, const Eigen::Vector2d& half_m,
                                   double near_m, uint16_t surface);

// Onto what is there, where the plane is nearer, or onto nothing: what is there is then written
// over. A pixel's result does not depend on the region.
enum class Onto { kWhatIsThere, kNothing };
void PaintPlane(const SeenPlane& plane, const PixelRegion& region, Onto onto, Image1u16* surface,
                Image1f* nearness);

}  // namespace turbidock::view
