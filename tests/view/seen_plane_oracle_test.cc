// Planes painted without triangles against rays cast at them.

#include "sim/view/seen_plane.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/base/pose.h"
#include "sim/base/random.h"

namespace turbidock::view {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr uint16_t kPlane = 7, kOther = 3;
constexpr double kNear_m = 0.02;
const PixelRegion kWhole{0, 0, 160, 120};

CameraIntrinsics Camera() { return CameraIntrinsics::FromHorizontalFov(160, 120, 1.2); }

struct Picture {
  explicit Picture(uint16_t id = 0, float near = 0)
      : surface(160, 120, id), nearness(160, 120, near) {}
  Image1u16 surface;
  Image1f nearness;
};

// How near the ray through a pixel meets the plane in front of it, near plane's depth / depth, and
// how far inside its edges, metres.
struct Hit {
  double nearness = 0, inside_m = -1;
};
Hit Cast(const Matrix3d& R_CG, const Vector3d& p_CG, const Vector2d& half_m, double u, double v) {
  const Vector3d ray = Camera().RayAt(u, v), normal = R_CG.col(2);
  const double depth_m = normal.dot(p_CG) / normal.dot(ray);
  if (normal.dot(p_CG) >= 0 || depth_m < kNear_m) return {};
  const Vector3d p_GQ = R_CG.transpose() * (depth_m * ray - p_CG);
  return {kNear_m / depth_m,
          std::min(half_m.x() - std::abs(p_GQ.x()), half_m.y() - std::abs(p_GQ.y()))};
}

TEST(SeenPlane, IsWhatRaysMeet) {
  Rng rng = SeedTree(5).Stream("planes");
  int seen_planes = 0, hits = 0;
  for (int i = 0; i < 100; ++i) {
    const Matrix3d R_CG =
        FromYawPitchRoll(rng.Uniform(-3, 3), rng.Uniform(-1.5, 1.5), rng.Uniform(-3, 3))
            .toRotationMatrix();
    const Vector3d p_CG(rng.Uniform(-1, 1), rng.Uniform(-1, 1), rng.Uniform(-0.5, 3));
    const Vector2d half_m(rng.Uniform(0.01, 2), rng.Uniform(0.01, 2));
    const auto seen = PlaneSeen(Camera(), R_CG, p_CG, half_m, kNear_m, kPlane);
    ASSERT_EQ(seen.has_value(), R_CG.col(2).dot(p_CG) < 0);
    // of one that is seen from its side edges meet at so small an angle that corners reach far
    if (!seen || R_CG.col(2).dot(p_CG) > -0.1) continue;
    ++seen_planes;
    Picture alone(99, 2), parts(99, 2), over(kOther, 0.01f);
    PaintPlane(*seen, kWhole, Onto::kNothing, &alone.surface, &alone.nearness);
    PaintPlane(*seen, kWhole, Onto::kWhatIsThere, &over.surface, &over.nearness);
    for (const PixelRegion& part :
         {PixelRegion{0, 0, 33, 120}, PixelRegion{33, 0, 160, 50}, PixelRegion{33, 50, 160, 120}})
      PaintPlane(*seen, part, Onto::kNothing, &parts.surface, &parts.nearness);
    EXPECT_EQ(parts.surface, alone.surface);
    EXPECT_EQ(parts.nearness, alone.nearness);
    for (int v = 0; v < 120; ++v)
      for (int u = 0; u < 160; ++u) {
        const Hit hit = Cast(R_CG, p_CG, half_m, u, v);
        const double near = *alone.nearness.at(u, v);
        const auto meets = [&](double du, double dv) {
          const Hit beside = Cast(R_CG, p_CG, half_m, u + du, v + dv);
          return beside.nearness > 0 && beside.inside_m > 0;
        };
        const bool met = meets(0, 0);
        // edges may be a 64th of a pixel farther out
        bool is_edge = false;
        for (const double du : {-0.02, 0.0, 0.02})
          for (const double dv : {-0.02, 0.0, 0.02}) is_edge = is_edge || meets(du, dv) != met;
        if (is_edge) continue;
        ASSERT_EQ(*alone.surface.at(u, v), met ? kPlane : 0) << i << " " << u << " " << v;
        ASSERT_NEAR(near, met ? hit.nearness : 0, 3e-6);
        const bool nearest = met && hit.nearness > 0.01;
        if (met && std::abs(hit.nearness - 0.01) < 1e-5) continue;
        ASSERT_EQ(*over.surface.at(u, v), nearest ? kPlane : kOther);
        ASSERT_NEAR(*over.nearness.at(u, v), nearest ? hit.nearness : 0.01, 3e-6);
        hits += met;
      }
  }
  EXPECT_GT(seen_planes, 20);
  EXPECT_GT(hits, 50000);
}

// As OpenGL cuts it away.
TEST(SeenPlane, IsNotSeenBeforeTheNearPlane) {
  // its front towards the camera
  const Matrix3d R_CG = Eigen::Vector3d(1, -1, -1).asDiagonal();
  for (const double depth_m : {0.5 * kNear_m, 1.5 * kNear_m}) {
    const auto seen = PlaneSeen(Camera(), R_CG, {0, 0, depth_m}, Vector2d(1, 1), kNear_m, kPlane);
    ASSERT_TRUE(seen);
    Picture picture;
    PaintPlane(*seen, kWhole, Onto::kWhatIsThere, &picture.surface, &picture.nearness);
    EXPECT_EQ(*picture.surface.at(80, 60), depth_m > kNear_m ? kPlane : 0) << depth_m;
  }
}

}  // namespace
}  // namespace turbidock::view
