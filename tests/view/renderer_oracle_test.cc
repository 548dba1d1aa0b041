// What the renderer draws against closed forms: the image of a sphere is an ellipse known exactly.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/view/stereo_renderer.h"
#include "tests/vehicle/posed_scene.h"

namespace turbidock::view {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::PosedScene;

struct Blob {
  Vector2d centroid_px = Vector2d::Zero();
  double area_px = 0;
};

Blob MeasureBlob(const RenderedView& view, int geom) {
  Blob blob;
  for (int v = 0; v < view.surface.height(); ++v) {
    for (int u = 0; u < view.surface.width(); ++u) {
      if (*view.surface.at(u, v) != geom + 1) continue;
      blob.centroid_px += Vector2d(u, v);
      blob.area_px += 1;
    }
  }
  blob.centroid_px /= blob.area_px;
  return blob;
}

// Silhouette of a sphere at p_CQ: rays x with x' (p p' - (|p|^2 - r^2) I) x = 0, a conic in the
// image.
Blob SphereImage(const CameraIntrinsics& camera, const Vector3d& p_CQ, double radius_m) {
  const Matrix3d conic =
      p_CQ * p_CQ.transpose() - (p_CQ.squaredNorm() - radius_m * radius_m) * Matrix3d::Identity();
  const Eigen::Matrix2d quadratic = conic.topLeftCorner<2, 2>();
  const Vector2d centre = -quadratic.inverse() * conic.topRightCorner<2, 1>();
  const double constant = conic(2, 2) + centre.dot(conic.topRightCorner<2, 1>());
  const double area = std::numbers::pi * std::abs(constant) / std::sqrt(quadratic.determinant());
  return {camera.Project({centre.x(), centre.y(), 1}), area * camera.fx_px * camera.fy_px};
}

// Places of the marker in H: straight ahead, and with the ball near every corner of the image.
const std::array kMarkerPlaces = {Vector3d(0.8, 0, 0),        Vector3d(0.6, 0.2, 0.15),
                                  Vector3d(0.6, -0.2, 0.15),  Vector3d(0.6, 0.2, -0.15),
                                  Vector3d(0.6, -0.2, -0.15), Vector3d(0.37, 0.013, -0.007),
                                  Vector3d(1.5, 0.4, 0.3)};

// A bias of half a pixel, as a wrong pixel centre or a row lost in the flip would give, is five
// times this.
constexpr double kCentroidTol_px = 0.1;

TEST(RendererGeometry, BallsAreWhereTheIntrinsicsProjectThem) {
  const auto gl = MakeOsmesaContext();
  PosedScene posed("sea_active");
  const vehicle::Scene& scene = posed.scene;
  StereoRenderer renderer(*gl, scene);
  RenderedStereo rendered;
  const vehicle::BallInScene* green = nullptr;
  for (const vehicle::BallInScene& ball : scene.balls)
    if (ball.name == "green") green = &ball;
  ASSERT_NE(green, nullptr);

  for (const Vector3d& p_HM : kMarkerPlaces) {
    SCOPED_TRACE(p_HM.transpose());
    const Pose X_HM{FromYawPitchRoll(0.05, -0.03, 0.02), p_HM};
    posed.Place(X_HM);
    renderer.Render(*posed.data, &rendered);
    EXPECT_NEAR((rendered.X_WH.p - (scene.X_WM * X_HM.Inverse()).p).norm(), 0, 1e-9);

    std::array<Blob, 2> seen;
    for (int side = 0; side < 2; ++side) {
      const CameraIntrinsics& camera = side == 0 ? scene.rig.left : scene.rig.right;
      const Pose& X_HC = side == 0 ? scene.rig.left.X_HC : scene.rig.right.X_HC;
      const Vector3d p_CQ = X_HC.Inverse() * (X_HM * green->p_MQ);
      const Blob expected = SphereImage(camera, p_CQ, green->radius_m);
      seen[side] = MeasureBlob(side == 0 ? rendered.left : rendered.right, green->geom);
      EXPECT_NEAR((seen[side].centroid_px - expected.centroid_px).norm(), 0, kCentroidTol_px);
      // Apparent radius: facets lie inside the sphere (0.3 %), and a disc of pixels is coarse.
      const double radius_px = std::sqrt(seen[side].area_px / std::numbers::pi);
      EXPECT_NEAR(radius_px, std::sqrt(expected.area_px / std::numbers::pi),
                  0.004 * radius_px + 0.15);
    }
    // Disparity of the discs: f b / z for a point, f b z / (z^2 - r^2) for the middle of the
    // ellipse.
    const double z_m = (X_HM * green->p_MQ).x(), r_m = green->radius_m;
    const double disparity_px = scene.rig.left.fx_px * 0.12 * z_m / (z_m * z_m - r_m * r_m);
    EXPECT_NEAR(seen[0].centroid_px.x() - seen[1].centroid_px.x(), disparity_px,
                2 * kCentroidTol_px);
    EXPECT_NEAR(seen[0].centroid_px.y(), seen[1].centroid_px.y(), 2 * kCentroidTol_px);
  }
}

// A wall square to the axis has one depth everywhere: along the axis, not along the ray.
TEST(RendererGeometry, DepthIsAlongTheAxis) {
  const auto gl = MakeOsmesaContext();
  PosedScene posed("sea_active");
  StereoRenderer renderer(*gl, posed.scene);
  RenderedStereo rendered;
  posed.Place(Pose::Translation(0.9, 0, 0));
  renderer.Render(*posed.data, &rendered);
  const int plate = posed.Geom("station_plate");
  const double depth_m = 0.9 + 0.11;
  // A step of a 24-bit buffer with clipping planes n = 0.02 m and f = 30 m: z^2 (f - n) / (n f)
  // 2^-24.
  const double step_m = depth_m * depth_m * (1 / 0.02 - 1 / 30.0) * std::ldexp(1.0, -24);
  for (const RenderedView* view : {&rendered.left, &rendered.right}) {
    int seen = 0;
    double low_m = 1e9, high_m = 0;
    for (int v = 0; v < view->surface.height(); ++v) {
      for (int u = 0; u < view->surface.width(); ++u) {
        if (*view->surface.at(u, v) != plate + 1) continue;
        const double z_m = *view->depth_m.at(u, v);
        low_m = std::min(low_m, z_m);
        high_m = std::max(high_m, z_m);
        ++seen;
      }
    }
    EXPECT_GT(seen, 30000);
    EXPECT_NEAR(low_m, depth_m, 2 * step_m);
    EXPECT_NEAR(high_m, depth_m, 2 * step_m);
  }
}

TEST(RendererGeometry, NothingIsInfinitelyFar) {
  const auto gl = MakeOsmesaContext();
  PosedScene posed("sea_active");
  StereoRenderer renderer(*gl, posed.scene);
  RenderedStereo rendered;
  posed.Place(Pose::Translation(1.2, 0, 0));
  renderer.Render(*posed.data, &rendered);
  int open_water = 0, surfaces = 0;
  for (const RenderedView* view : {&rendered.left, &rendered.right}) {
    ASSERT_EQ(view->surface.pixels(), view->depth_m.pixels());
    for (size_t i = 0; i < view->surface.pixels(); ++i) {
      const bool nothing = view->surface.data()[i] == 0;
      const float z_m = view->depth_m.data()[i];
      ASSERT_EQ(nothing, z_m == std::numeric_limits<float>::infinity());
      ASSERT_TRUE(nothing || (z_m > 0.02f && z_m < 30.1f)) << z_m;
      (nothing ? open_water : surfaces) += 1;
    }
  }
  EXPECT_GT(open_water, 100000);
  EXPECT_GT(surfaces, 100000);
}

// On the approach nothing of the station or the vehicle comes between a camera and a ball.
TEST(RendererGeometry, DockHidesNoBall) {
  const auto gl = MakeOsmesaContext();
  PosedScene posed("sea_passive"), bare("sea_passive");
  mjModel& m = *bare.scene.model;
  int removed = 0;
  for (int geom = 0; geom < m.ngeom; ++geom) {
    if (bare.scene.geom_part[geom] == vehicle::Part::kMarker) continue;
    m.geom_group[geom] = 3;
    ++removed;
  }
  ASSERT_GT(removed, 40);
  StereoRenderer renderer(*gl, posed.scene), bare_renderer(*gl, bare.scene);
  RenderedStereo rendered, bare_rendered;
  for (const double x_m : {0.35, 0.4, 0.5, 0.7, 1.0, 1.5}) {
    for (const double y_m : {-0.04, 0.04}) {
      for (const double z_m : {-0.04, 0.04}) {
        SCOPED_TRACE(::testing::Message() << x_m << " " << y_m << " " << z_m);
        const Pose X_HM = Pose::Translation(x_m, y_m, z_m);
        posed.Place(X_HM);
        bare.Place(X_HM);
        renderer.Render(*posed.data, &rendered);
        bare_renderer.Render(*bare.data, &bare_rendered);
        for (const vehicle::BallInScene& ball : posed.scene.balls) {
          for (auto side : {&RenderedStereo::left, &RenderedStereo::right}) {
            const double area_px = MeasureBlob(rendered.*side, ball.geom).area_px;
            EXPECT_GT(area_px, 50) << ball.name;
            EXPECT_EQ(area_px, MeasureBlob(bare_rendered.*side, ball.geom).area_px) << ball.name;
          }
        }
        // The cameras see no part of their own vehicle.
        for (const RenderedView* view : {&rendered.left, &rendered.right}) {
          for (size_t i = 0; i < view->surface.pixels(); ++i) {
            const int id = view->surface.data()[i];
            if (id == 0) continue;
            const vehicle::Part part = posed.scene.geom_part[id - 1];
            ASSERT_TRUE(part != vehicle::Part::kHull && part != vehicle::Part::kPole)
                << posed.GeomName(id - 1);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace turbidock::view
