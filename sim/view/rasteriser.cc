#include "sim/view/rasteriser.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "sim/base/vector_clones.h"

namespace turbidock::view {
namespace {

using Eigen::Vector3d;

// While a picture is drawn it holds near_m / depth, which is linear over it; less than this where
// there is nothing. (Not 0, which library functions are called for to write it.)
constexpr float kNothing = 1e-30f;

// A picture's part that is drawn to. Pixel (u, v) is number v * width + u.
struct Target {
  PixelRegion region;
  int width;
  uint16_t* surface;
  float* nearness;
};

TURBIDOCK_VECTOR_CLONES
void Clear(const Target& target) {
  const PixelRegion& region = target.region;
  for (int v = region.row_begin; v < region.row_end; ++v) {
    const ptrdiff_t start = static_cast<ptrdiff_t>(v) * target.width + region.column_begin;
    std::fill_n(target.surface + start, region.width(), uint16_t{0});
    std::fill_n(target.nearness + start, region.width(), kNothing);
  }
}

TURBIDOCK_VECTOR_CLONES
void ToDepth(float near_m, const Target& target) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const PixelRegion& region = target.region;
  for (int v = region.row_begin; v < region.row_end; ++v) {
    float* values = target.nearness + static_cast<ptrdiff_t>(v) * target.width;
    for (int u = region.column_begin; u < region.column_end; ++u)
      values[u] = values[u] > kNothing ? near_m / values[u] : kInfinity;
  }
}

// Where a row of a triangle begins, so that its pixels do not depend on the region: they count from
// there.
struct Run {
  int first;  // column
  float nearness, per_px;
};

[[gnu::always_inline]] inline void DrawRun(const Run run, uint16_t surface, int begin, int end,
                                           const Target& target, int v) {
  const ptrdiff_t start = static_cast<ptrdiff_t>(v) * target.width + begin;
  float* __restrict nearness = target.nearness + start;
  uint16_t* __restrict surfaces = target.surface + start;
  const int from = begin - run.first, count = end - begin;
  for (int i = 0; i < count; ++i) {
    const float here = run.nearness + static_cast<float>(from + i) * run.per_px;
    const float before = nearness[i];
    // positive numbers are in the order of their bits; a choice by the same test as the surface's
    // would become stores under a mask, which are dear
    nearness[i] = std::bit_cast<float>(
        std::max(std::bit_cast<int32_t>(before), std::bit_cast<int32_t>(here)));
    surfaces[i] = here > before ? surface : surfaces[i];
  }
}

// With the corners' homogeneous pixels as the columns of M, a pixel p = (u, v, 1) shows the
// triangle where all of M^-1 p are positive, and the sum of these is 1 / depth there (Olano and
// Greer 1997): both are linear over the picture, whatever lies behind the camera.
TURBIDOCK_VECTOR_CLONES
void DrawTriangle(const Vector3d& a, const Vector3d& b, const Vector3d& c, uint16_t surface,
                  double near_m, const Target& target) {
  constexpr int kSides = 4;
  Vector3d side[kSides] = {c.cross(b), a.cross(c), b.cross(a), Vector3d::Zero()};
  const double size = a.dot(side[0]);
  if (!(size > 0)) return;  // seen from behind, or from aside
  const Vector3d nearness = near_m / size * (side[0] + side[1] + side[2]);
  side[3] = Vector3d::UnitZ() - nearness;  // beyond the near plane
  const PixelRegion& region = target.region;
  double top = region.row_begin, bottom = region.row_end - 1;
  if (a.z() >= near_m && b.z() >= near_m && c.z() >= near_m) {
    const double rows[3] = {a.y() / a.z(), b.y() / b.z(), c.y() / c.z()};
    top = std::max(top, std::ceil(std::min(rows[0], std::min(rows[1], rows[2]))));
    bottom = std::min(bottom, std::floor(std::max(rows[0], std::max(rows[1], rows[2]))));
  }
  if (!(top <= bottom)) return;
  const double last_column = target.width - 1;
  for (int v = static_cast<int>(top); v <= bottom; ++v) {
    double left = 0, right = last_column;
    for (const Vector3d& s : side) {
      const double at_0 = s.y() * v + s.z();
      if (s.x() > 0)
        left = std::max(left, -at_0 / s.x());
      else if (s.x() < 0)
        right = std::min(right, -at_0 / s.x());
      else if (at_0 < 0)
        right = -1;
    }
    if (!(left <= right)) continue;
    const int first = static_cast<int>(std::ceil(left)), last = static_cast<int>(right);
    const Run run = {first,
                     static_cast<float>(nearness.x() * first + nearness.y() * v + nearness.z()),
                     static_cast<float>(nearness.x())};
    DrawRun(run, surface, std::max(first, region.column_begin),
            std::min(last + 1, region.column_end), target, v);
  }
}

// The nearer crossing of the ray t d with the sphere: first the ray's point nearest to the centre,
// so that no large squares are subtracted.
TURBIDOCK_VECTOR_CLONES
void DrawBall(const SurfaceList::Ball& ball, float near_m, const Target& target) {
  const auto [p_CQ, radius_m, surface, bounds, cx_px, cy_px, per_fx, per_fy] = ball;
  const float x = p_CQ.x(), y = p_CQ.y(), z = p_CQ.z(), r2 = radius_m * radius_m;
  const int begin = std::max(bounds.column_begin, target.region.column_begin);
  const int end = std::min(bounds.column_end, target.region.column_end);
  for (int v = std::max(bounds.row_begin, target.region.row_begin);
       v < std::min(bounds.row_end, target.region.row_end); ++v) {
    const float dy = (static_cast<float>(v) - cy_px) * per_fy;
    float* __restrict nearness = target.nearness + static_cast<ptrdiff_t>(v) * target.width;
    uint16_t* __restrict surfaces = target.surface + static_cast<ptrdiff_t>(v) * target.width;
    for (int u = begin; u < end; ++u) {
      const float dx = (static_cast<float>(u) - cx_px) * per_fx;
      const float d2 = dx * dx + dy * dy + 1.0f;
      const float t = (dx * x + dy * y + z) / d2;
      const float ox = x - t * dx, oy = y - t * dy, oz = z - t;
      const float h2 = r2 - (ox * ox + oy * oy + oz * oz);
      const float depth = t - std::sqrt(std::max(h2, 0.0f) / d2);
      const float here = near_m / depth;
      const bool nearer = (h2 > 0.0f) & (depth >= near_m) & (here > nearness[u]);
      nearness[u] = nearer ? here : nearness[u];
      surfaces[u] = nearer ? surface : surfaces[u];
    }
  }
}

}  // namespace

void DrawSurfaces(const SurfaceList& list, float near_m, const PixelRegion& region,
                  RenderedView* view) {
  const Target target = {region, view->surface.width(), view->surface.data(), view->depth_m.data()};
  Clear(target);
  for (const SurfaceList::Triangle& triangle : list.triangles) {
    const auto corner = [&](int i) -> const Vector3d& {
      return list.corners[triangle.corner[static_cast<size_t>(i)]];
    };
    DrawTriangle(corner(0), corner(1), corner(2), triangle.surface, double{near_m}, target);
  }
  for (const SurfaceList::Ball& ball : list.balls) DrawBall(ball, near_m, target);
  ToDepth(near_m, target);
}

}  // namespace turbidock::view
