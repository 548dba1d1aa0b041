// Shadows: the closed forms against walking along the line and asking each point whether it is
// inside.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/base/random.h"
#include "sim/light/surfaces.h"
#include "tests/light/box_shadow.h"

namespace turbidock::light {
namespace {

using Eigen::Vector3d;

// Negative inside, by the definition of each shape; roughly a distance.
double Outside(const Surface& surface, const Vector3d& p) {
  const Vector3d& size = surface.size_m;
  switch (surface.shape) {
    case Shape::kPlane:
      return p.z();
    case Shape::kSphere:
      return p.norm() - size[0];
    case Shape::kEllipsoid:
      return ((p.array() / size.array()).matrix().norm() - 1) * size.minCoeff();
    case Shape::kCylinder:
      return std::max(p.head<2>().norm() - size[0], std::abs(p.z()) - size[1]);
    case Shape::kCapsule:
      return (p - Vector3d(0, 0, std::clamp(p.z(), -size[1], size[1]))).norm() - size[0];
    case Shape::kBox:
      break;
  }
  return (p.array().abs() - size.array()).maxCoeff();
}

Vector3d Anywhere(Rng& rng, double half_m) {
  return {rng.Uniform(-half_m, half_m), rng.Uniform(-half_m, half_m), rng.Uniform(-half_m, half_m)};
}

TEST(SegmentHits, AgreesWithWalking) {
  constexpr int kSteps = 400;
  Rng rng = SeedTree(11).Stream("surfaces");
  int compared = 0, hits = 0;
  for (const Shape shape :
       {Shape::kSphere, Shape::kCapsule, Shape::kEllipsoid, Shape::kCylinder, Shape::kBox})
    for (int i = 0; i < 400; ++i) {
      Surface surface;
      surface.shape = shape;
      surface.size_m = {0.3, 0.5, 0.4};
      const Vector3d a = Anywhere(rng, 1.2), b = Anywhere(rng, 1.2);
      double nearest = 1e9;
      for (int k = 0; k <= kSteps; ++k)
        nearest = std::min(nearest, Outside(surface, a + (b - a) * k / kSteps));
      // grazing lines: the walk may step over what is thinner than a step
      if (std::abs(nearest) < (b - a).norm() / kSteps) continue;
      ++compared;
      hits += nearest < 0;
      EXPECT_EQ(SegmentHits(surface, a, b), nearest < 0) << static_cast<int>(shape);
    }
  EXPECT_GT(compared, 1900);
  EXPECT_GT(hits, 400);
  EXPECT_LT(hits, compared - 400);
}

TEST(BoxShadow, AgreesWithPointByPoint) {
  constexpr int kSteps = 400;
  Rng rng = SeedTree(12).Stream("surfaces");
  Surface box;
  box.shape = Shape::kBox;
  box.size_m = {0.3, 0.5, 0.4};
  int wrong = 0, shaded = 0, points = 0;
  for (int i = 0; i < 500; ++i) {
    Vector3d source = Anywhere(rng, 1);
    while (Outside(box, source) < 0.01) source = Anywhere(rng, 1);
    const Vector3d a = Anywhere(rng, 1.5), u = Anywhere(rng, 1).normalized();
    const Stretch dark =
        testing::HiddenBy(BoxShadow(box, Eigen::Matrix3d::Identity(), source, a), u, {0, 3});
    for (int k = 0; k <= kSteps; ++k) {
      const double t = 3.0 * k / kSteps;
      const bool in_shadow = SegmentHits(box, source, a + t * u);
      wrong += in_shadow != (dark.t1_m > dark.t0_m && t >= dark.t0_m && t <= dark.t1_m);
      shaded += in_shadow;
      ++points;
    }
  }
  EXPECT_GT(shaded, points / 5);
  EXPECT_LT(shaded, points * 4 / 5);
  // only points on the very edge, and shadows less deep than the tolerance of touching
  EXPECT_LE(wrong, points / 10000);
}

}  // namespace
}  // namespace turbidock::light
