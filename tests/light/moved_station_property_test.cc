// A station elsewhere, with the vehicle as far from it as before, looks as before.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/light/surfaces.h"
#include "sim/light/water.h"
#include "sim/view/stereo_renderer.h"
#include "tests/vehicle/posed_scene.h"

namespace turbidock::light {
namespace {

using testing::PosedScene;

// Where the station is displaced to, and the vehicle relative to it.
RadianceStereo SeenAt(const Eigen::Vector3d& displacement, const Pose& X_HM, bool moves_light) {
  PosedScene posed("sea_moored_active");
  const vehicle::Scene& scene = posed.scene;
  const mjModel& m = *scene.model;
  for (int i = 0; i < 3; ++i)
    posed.data->qpos[m.jnt_qposadr[scene.moored_body.joints[i]]] = displacement[i];
  const Pose X_WK_moved{FromYawPitchRoll(displacement.z(), 0, 0),
                        scene.X_WM.p + Eigen::Vector3d(displacement.x(), displacement.y(), 0)};
  posed.Place((X_WK_moved * X_HM.Inverse()).Inverse() * scene.X_WM);  // in the place at rest
  const Pose X_HM_now = vehicle::SitePose(*posed.data, scene.camera_head_site).Inverse() *
                        vehicle::SitePose(*posed.data, scene.marker_site);
  EXPECT_LT((X_HM_now.p - X_HM.p).norm(), 1e-9);
  EXPECT_LT(AngleBetween(X_HM_now.q, X_HM.q), 1e-7);

  const auto gl = view::MakeOsmesaContext();
  view::StereoRenderer renderer(*gl, scene);
  view::RenderedStereo rendered;
  renderer.Render(*posed.data, &rendered);
  if (!moves_light) rendered.X_WK = scene.X_WM;
  OpticsParams optics;
  optics.water.milk_ml_m3 = 10;
  optics.ball_lights.enabled = true;
  Water water(optics, scene.rig, SurfaceTable::FromScene(scene), LampPoses(scene));
  RadianceStereo radiance;
  water.Apply(rendered, &radiance);
  return radiance;
}

// Share of the light that differs.
double Difference(const RadianceStereo& a, const RadianceStereo& b) {
  double difference = 0, sum = 0;
  for (const Side side : kSides)
    for (size_t i = 0; i < 3 * a[side].pixels(); ++i) {
      difference += std::abs(a[side].data()[i] - b[side].data()[i]);
      sum += b[side].data()[i];
    }
  return difference / sum;
}

TEST(MovedStation, LooksTheSameFromAVehicleThatMovedWithIt) {
  const Pose X_HM{FromYawPitchRoll(0.1, 0.05, 0), {0.7, 0.05, -0.03}};
  const RadianceStereo at_rest = SeenAt({0, 0, 0}, X_HM, true);
  const Eigen::Vector3d displacement(0.3, -0.2, 0.4);
  // edges fall between other pixels in OpenGL's rounding
  EXPECT_LT(Difference(SeenAt(displacement, X_HM, true), at_rest), 1e-3);
  EXPECT_GT(Difference(SeenAt(displacement, X_HM, false), at_rest), 0.05)
      << "light that stays behind is seen";
}

}  // namespace
}  // namespace turbidock::light
