// Normals, shadows and the table of surfaces.
#include "sim/light/surfaces.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/light/box_shadow.h"
#include "tests/light/optics_scene.h"

namespace turbidock::light {
namespace {

using Eigen::Vector3d;

Surface Make(Shape shape, const Vector3d& size_m) {
  Surface surface;
  surface.shape = shape;
  surface.size_m = size_m;
  return surface;
}

TEST(OutwardNormal, OfEveryShape) {
  const Vector3d size(0.1, 0.2, 0.3);
  EXPECT_EQ(OutwardNormal(Make(Shape::kPlane, size), {3, 4, 0}), Vector3d::UnitZ());
  EXPECT_TRUE(OutwardNormal(Make(Shape::kSphere, size), {0, -0.1, 0}).isApprox(-Vector3d::UnitY()));
  EXPECT_EQ(OutwardNormal(Make(Shape::kBox, size), {0.0999, -0.15, 0.29}), Vector3d::UnitX());
  EXPECT_EQ(OutwardNormal(Make(Shape::kBox, size), {0.05, -0.2001, 0.2}), -Vector3d::UnitY());
  // cylinder and capsule: radius 0.1, half length 0.2
  EXPECT_EQ(OutwardNormal(Make(Shape::kCylinder, size), {0.05, 0.05, -0.2}), -Vector3d::UnitZ());
  EXPECT_TRUE(OutwardNormal(Make(Shape::kCylinder, size), {0.06, 0.08, 0.1})
                  .isApprox(Vector3d(0.6, 0.8, 0)));
  EXPECT_TRUE(OutwardNormal(Make(Shape::kCapsule, size), {0.06, 0.08, 0.1})
                  .isApprox(Vector3d(0.6, 0.8, 0)));
  EXPECT_TRUE(
      OutwardNormal(Make(Shape::kCapsule, size), {0.06, 0, 0.28}).isApprox(Vector3d(0.6, 0, 0.8)));
  // the ellipsoid's normal is the gradient of (x/a)^2 + (y/b)^2 + (z/c)^2
  EXPECT_TRUE(OutwardNormal(Make(Shape::kEllipsoid, {1, 2, 1}), {std::sqrt(0.5), std::sqrt(2), 0})
                  .isApprox(Vector3d(2, 1, 0).normalized()));
}

TEST(SurfaceTable, FindsByName) {
  const SurfaceTable table(testing::MarkerAndPlate({}));
  EXPECT_EQ(table.size(), 5);
  EXPECT_EQ(table.Find("ball_red"), 2);
  EXPECT_EQ(table[table.Find("ball_red")].name, "ball_red");
  EXPECT_EQ(table.Find("ball_pink"), -1);
}

TEST(BoxShadow, OfALampBeforeAWall) {
  // A source 1 m in front of a box of half side 0.1 whose near face is at x = 0; rays run across
  // behind it.
  const Surface box = Make(Shape::kBox, {0.1, 0.1, 0.1});
  const Vector3d p_SC(-1.1, 0, 0);
  // behind the box at x = 0.9, 2 m from the source, the shadow is as wide as the near face makes it
  const auto hidden = [&](const Vector3d& p_SA, const Stretch& stretch) {
    return testing::HiddenBy(BoxShadow(box, Eigen::Matrix3d::Identity(), p_SC, p_SA),
                             Vector3d::UnitY(), stretch);
  };
  const Stretch dark = hidden({0.9, -5, 0}, {0, 10});
  EXPECT_NEAR(dark.t0_m, 4.8, 1e-12);
  EXPECT_NEAR(dark.t1_m, 5.2, 1e-12);
  // cut by the stretch
  const Stretch half = hidden({0.9, -5, 0}, {5, 10});
  EXPECT_EQ(half.t0_m, 5);
  EXPECT_NEAR(half.t1_m, 5.2, 1e-12);
  // in front of the box, or above its shadow, none
  for (const Vector3d& p_SA : {Vector3d(-0.2, -5, 0), Vector3d(0.9, -5, 0.21)}) {
    const Stretch none = hidden(p_SA, {0, 10});
    EXPECT_LE(none.t1_m, none.t0_m);
  }
}

}  // namespace
}  // namespace turbidock::light
