// Our drawing against MuJoCo's, which shares no code with it but OpenGL itself.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "sim/base/random.h"
#include "sim/view/stereo_renderer.h"
#include "tests/vehicle/posed_scene.h"
#include "tests/view/mujoco_visibility.h"

namespace turbidock::view {
namespace {

using testing::MujocoVisibility;
using testing::PosedScene;

// Facets of the thickest round thing, 78 mm in radius, lie up to 0.3 % of that inside.
constexpr double kFacet_m = 2.4e-4;

class RendererAgainstMujoco : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, RendererAgainstMujoco,
                         ::testing::Values("pool_active", "pool_passive", "sea_active",
                                           "sea_passive"),
                         [](const auto& tested) { return tested.param; });

// Each pixel shows the same surface as there or, if not, as within a pixel of there; depth agrees
// to what facets (of balls: ours are round) and the steps of MuJoCo's 24-bit buffer allow.
TEST_P(RendererAgainstMujoco, SameSurfaceSameDepth) {
  const auto gl = MakeOsmesaContext();
  int64_t compared = 0, different = 0, vehicle = 0;
  // The wide rig sees the vehicle's own pole and lamps.
  for (const RigParams& params :
       {RigParams{}, RigParams{.width_px = 321, .height_px = 243, .horizontal_fov_rad = 2.2}}) {
    PosedScene posed(GetParam(), params);
    StereoRenderer renderer(*gl, posed.scene);
    MujocoVisibility mujoco(*gl, posed.scene);
    Rng rng = SeedTree(7).Stream("poses");
    RenderedStereo rendered;
    for (int i = 0; i < 8; ++i) {
      posed.Place(Pose{
          FromYawPitchRoll(rng.Uniform(-0.6, 0.6), rng.Uniform(-0.3, 0.3), rng.Uniform(-0.3, 0.3)),
          {rng.Uniform(0.3, 1.6), rng.Uniform(-0.2, 0.2), rng.Uniform(-0.2, 0.2)}});
      renderer.Render(*posed.data, &rendered);
      for (const bool right : {false, true}) {
        const RenderedView& ours = right ? rendered.right : rendered.left;
        const RenderedView theirs =
            mujoco.Render(*posed.data, right ? posed.scene.right_camera : posed.scene.left_camera);
        for (int v = 1; v + 1 < ours.surface.height(); ++v)
          for (int u = 1; u + 1 < ours.surface.width(); ++u) {
            const int surface = *ours.surface.at(u, v);
            ++compared;
            if (surface != *theirs.surface.at(u, v)) {
              ++different;
              bool near = false;
              for (int dv = -1; dv <= 1; ++dv)
                for (int du = -1; du <= 1; ++du)
                  near = near || *theirs.surface.at(u + du, v + dv) == surface;
              ASSERT_TRUE(near) << posed.GeomName(surface - 1) << " at " << u << " " << v;
              continue;
            }
            const bool edge = *theirs.surface.at(u - 1, v) != surface ||
                              *theirs.surface.at(u + 1, v) != surface ||
                              *theirs.surface.at(u, v - 1) != surface ||
                              *theirs.surface.at(u, v + 1) != surface;
            if (surface == 0 || edge) continue;
            const vehicle::Part part = posed.scene.geom_part[surface - 1];
            vehicle += part == vehicle::Part::kPole || part == vehicle::Part::kHull;
            const int type = posed.scene.model->geom_type[surface - 1];
            const bool flat = type == mjGEOM_BOX || type == mjGEOM_PLANE || type == mjGEOM_MESH;
            const double z_m = *ours.depth_m.at(u, v);
            // Depth's change in two pixels: what is lost sideways or inwards is magnified by it.
            const double change_m =
                std::abs(*theirs.depth_m.at(u + 1, v) - *theirs.depth_m.at(u - 1, v)) +
                std::abs(*theirs.depth_m.at(u, v + 1) - *theirs.depth_m.at(u, v - 1));
            const double slope = change_m * posed.scene.rig.left.fx_px / (2 * z_m);
            const double tolerance_m =
                flat ? 1e-5 * std::max(1.0, z_m * z_m) + 0.01 * change_m : kFacet_m * (1 + slope);
            ASSERT_NEAR(*theirs.depth_m.at(u, v), z_m, tolerance_m)
                << posed.GeomName(surface - 1) << " at " << u << " " << v;
          }
      }
    }
  }
  EXPECT_LT(static_cast<double>(different), 1e-3 * static_cast<double>(compared));
  EXPECT_GT(vehicle, 2000);
}

}  // namespace
}  // namespace turbidock::view
