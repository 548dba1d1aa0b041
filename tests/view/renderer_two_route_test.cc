// Rasterised ids and depths against MuJoCo's ray casting, which shares no code with OpenGL.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/view/stereo_renderer.h"
#include "tests/vehicle/posed_scene.h"

namespace turbidock::view {
namespace {

using Eigen::Vector3d;
using testing::CastRay;
using testing::PosedScene;

// The depth buffer's step at 1 m is 3e-6 m; the rest is single-precision vertices.
constexpr double kFlatTol_m = 1e-5;   // times z^2, and along a slanted surface
constexpr double kRoundTol_m = 3e-4;  // facets of a ball or the pole, where they face the camera

bool IsFlat(int type) { return type == mjGEOM_BOX || type == mjGEOM_PLANE || type == mjGEOM_MESH; }

struct Agreement {
  int compared = 0, round = 0, different_surface = 0;
};

// Compares every `stride`th pixel that is not at an edge between surfaces.
Agreement Compare(const PosedScene& posed, const RenderedView& view, const CameraIntrinsics& camera,
                  const Pose& X_WC, int stride) {
  Agreement agreement;
  for (int v = 1; v + 1 < view.surface.height(); v += stride) {
    for (int u = 1; u + 1 < view.surface.width(); u += stride) {
      const int id = *view.surface.at(u, v);
      const bool edge = *view.surface.at(u - 1, v) != id || *view.surface.at(u + 1, v) != id ||
                        *view.surface.at(u, v - 1) != id || *view.surface.at(u, v + 1) != id;
      if (edge) continue;
      const Vector3d ray_C = camera.RayAt(u, v);
      const auto hit = CastRay(posed, X_WC.p, X_WC.q * ray_C);
      ++agreement.compared;
      if (hit.geom + 1 != id) {
        ++agreement.different_surface;
        continue;
      }
      if (id == 0) continue;
      const double z_m = hit.range_m / ray_C.norm();
      const double got_m = *view.depth_m.at(u, v);
      // How much depth changes within a pixel: a slanted surface magnifies what is lost sideways.
      const double slope_m = std::abs(*view.depth_m.at(u + 1, v) - *view.depth_m.at(u - 1, v)) +
                             std::abs(*view.depth_m.at(u, v + 1) - *view.depth_m.at(u, v - 1));
      if (IsFlat(posed.scene.model->geom_type[hit.geom])) {
        EXPECT_NEAR(got_m, z_m, kFlatTol_m * std::max(1.0, z_m * z_m) + 0.01 * slope_m)
            << posed.GeomName(hit.geom) << " at " << u << " " << v;
      } else {
        EXPECT_NEAR(got_m, z_m, kRoundTol_m + 0.1 * slope_m)
            << posed.GeomName(hit.geom) << " at " << u << " " << v;
        ++agreement.round;
      }
    }
  }
  return agreement;
}

class RendererAgainstRays : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, RendererAgainstRays,
                         ::testing::Values("pool_passive", "sea_active"),
                         [](const auto& tested) { return tested.param; });

TEST_P(RendererAgainstRays, SameSurfaceSameDepth) {
  const auto gl = MakeOsmesaContext();
  // The wide rig sees parts of the vehicle and takes in what lies far off the axis.
  for (const RigParams& params :
       {RigParams{}, RigParams{.width_px = 320, .height_px = 300, .horizontal_fov_rad = 2.0}}) {
    PosedScene posed(GetParam(), params);
    StereoRenderer renderer(*gl, posed.scene);
    RenderedStereo rendered;
    const StereoRig& rig = posed.scene.rig;
    for (const Pose& X_HM : {Pose::Translation(0.8, 0, 0), Pose::Translation(0.36, 0.03, -0.02),
                             Pose{FromYawPitchRoll(0.3, 0.1, -0.2), {0.6, -0.1, 0.05}}}) {
      posed.Place(X_HM);
      renderer.Render(*posed.data, &rendered);
      const Agreement left =
          Compare(posed, rendered.left, rig.left, rendered.X_WH * rig.left.X_HC, /*stride=*/7);
      const Agreement right =
          Compare(posed, rendered.right, rig.right, rendered.X_WH * rig.right.X_HC, /*stride=*/7);
      for (const Agreement& agreement : {left, right}) {
        EXPECT_GT(agreement.compared, 1500);
        EXPECT_GT(agreement.round, 5);
        EXPECT_EQ(agreement.different_surface, 0);
      }
    }
  }
}

// The wide rig does see the pole, so that leaving out what is out of view is put to the test.
TEST(RendererAgainstRays, WideRigSeesThePole) {
  const auto gl = MakeOsmesaContext();
  PosedScene posed("sea_active",
                   RigParams{.width_px = 320, .height_px = 300, .horizontal_fov_rad = 2.0});
  StereoRenderer renderer(*gl, posed.scene);
  RenderedStereo rendered;
  posed.Place(Pose::Translation(0.8, 0, 0));
  renderer.Render(*posed.data, &rendered);
  const int pole = posed.Geom("pole");
  for (const RenderedView* view : {&rendered.left, &rendered.right}) {
    const auto* begin = view->surface.data();
    EXPECT_GT(std::count(begin, begin + view->surface.pixels(), pole + 1), 500);
  }
}

}  // namespace
}  // namespace turbidock::view
