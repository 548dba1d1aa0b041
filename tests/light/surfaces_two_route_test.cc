// Shadows: the closed forms against walking along the line and asking each point whether it is
// inside. Normals: many at once against one by one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/base/random.h"
#include "sim/light/point_batch.h"
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

// Wherever the surface stands, and however it is turned.
TEST(FindNormals, AgreesWithOneByOne) {
  Rng rng = SeedTree(12).Stream("normals");
  int compared = 0;
  for (const Shape shape :
       {Shape::kSphere, Shape::kCapsule, Shape::kEllipsoid, Shape::kCylinder, Shape::kBox}) {
    Surface surface;
    surface.shape = shape;
    surface.size_m = {0.03, 0.05, 0.04};
    const Eigen::Matrix3d R_HS =
        Eigen::AngleAxisd(rng.Uniform(-3, 3), Anywhere(rng, 1).normalized()).toRotationMatrix();
    const Vector3d p_HS(0.7, -0.1, 0.05);
    PointBatch batch;
    std::vector<Vector3d> expected_H;
    for (; batch.count < PointBatch::kSize; ++batch.count) {
      // on the surface along a line from its middle
      const Vector3d way = Anywhere(rng, 1).normalized();
      double inside = 0, outside = 1;
      for (int i = 0; i < 50; ++i) {
        const double middle = (inside + outside) / 2;
        (Outside(surface, middle * way) < 0 ? inside : outside) = middle;
      }
      const Vector3d p_SQ = inside * way, p_HQ = p_HS + R_HS * p_SQ;
      expected_H.push_back(R_HS * OutwardNormal(surface, p_SQ));
      batch.x_m[batch.count] = static_cast<float>(p_HQ.x());
      batch.y_m[batch.count] = static_cast<float>(p_HQ.y());
      batch.z_m[batch.count] = static_cast<float>(p_HQ.z());
    }
    FindNormals(surface, {R_HS.cast<float>(), p_HS.cast<float>()}, &batch);
    for (int i = 0; i < batch.count; ++i) {
      const Vector3d got_H(batch.normal_x[i], batch.normal_y[i], batch.normal_z[i]);
      // but where a box's or a cylinder's faces meet
      if ((got_H - expected_H[static_cast<size_t>(i)]).norm() > 1e-4 &&
          (shape == Shape::kBox || shape == Shape::kCylinder) && std::abs(got_H.norm() - 1) < 1e-5)
        continue;
      ++compared;
      EXPECT_LT((got_H - expected_H[static_cast<size_t>(i)]).norm(), 1e-4)
          << static_cast<int>(shape);
    }
  }
  EXPECT_GT(compared, 630);
}

}  // namespace
}  // namespace turbidock::light
