// The glow of the water before what the lamps light, where a closed form is known.

#include "sim/light/reflectors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/light/water.h"
#include "tests/light/optics_scene.h"

namespace turbidock::light {
namespace {

constexpr double kPi = std::numbers::pi;

// Scatters equally in all directions and takes nothing away: b / (4 pi) I / h Int -sin(phi) dphi
// from the camera to the foot.
TEST(Disc, HaloWithoutExtinction) {
  const Medium medium{.scattering_per_m = Rgb::Constant(0.2)};
  const Glow disc{.radius_m = 0.05, .intensity_w_sr = {1, 2, 3}, .disc = true};
  int compared = 0;
  for (const double foot_m : {0.3, 1.0})
    for (const double offset_m : {0.06, 0.2, 0.5}) {
      const double cos_phi0 = offset_m / std::hypot(offset_m, foot_m);
      const double expected = 0.2 / (4 * kPi) / offset_m * (1 - cos_phi0);
      const Rgb got = HaloAlongRay(medium, Rgb::Zero(), disc, foot_m, offset_m, {0, foot_m}, 2000);
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(got[k] / (disc.intensity_w_sr[k] * expected), 1, 1e-5);
      // nothing comes from behind the disc
      EXPECT_EQ(
          HaloAlongRay(medium, Rgb::Zero(), disc, foot_m, offset_m, {foot_m, 5}, 2000).maxCoeff(),
          0);
      ++compared;
    }
  EXPECT_EQ(compared, 6);
}

struct Lit {
  explicit Lit(const Medium& medium, double lamp_w_sr = 1)
      : Lit(medium, lamp_w_sr, testing::MarkerAndPlate(Pose::Translation(3, 0, 0))) {}
  Lit(const Medium& medium, double lamp_w_sr, const std::vector<Surface>& seen)
      : surfaces(seen), reflectors(SurfaceTable(surfaces), medium) {
    std::vector<PlacedSurface> placed;
    for (const Surface& surface : surfaces)
      placed.push_back({surface.X_AS.R().cast<float>(), surface.X_AS.p.cast<float>()});
    Lamp lamp;
    lamp.beam.beam = BeamShape::kIsotropic;
    lamp.beam.intensity_w_sr.setConstant(lamp_w_sr);
    PointBatch batch{};
    reflectors.Illuminate(SurfaceTable(surfaces), placed, std::span(&lamp, 1), {}, &batch);
  }
  std::vector<Surface> surfaces;
  Reflectors reflectors;
};

// From afar, with the lamp at the camera: plate 0.27 m^2 at 3.11 m (albedo 0.2), the box's front at
// 2.95 m (0.5), and of the balls their own colours.
TEST(Reflectors, ThrowBackWhatLambertSays) {
  const Medium medium;
  const Rgb got = Lit(medium).reflectors.intensity_w_sr();
  double expected = 0;
  const int n = 200;  // the plate in small pieces: light falls obliquely on its ends
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double y = 0.6 * ((i + 0.5) / n - 0.5), z = 0.45 * ((j + 0.5) / n - 0.5);
      const double r2 = 3.11 * 3.11 + y * y + z * z;
      expected += 0.2 / kPi * 0.27 / (n * n) * 3.11 / std::pow(r2, 1.5);
    }
  expected += 0.5 / kPi * 0.01 / (2.95 * 2.95);
  // red channel: 0.75 of (0.03, 1, 0.03) for green, red, blue, two thirds of R^2 E
  expected +=
      2.0 / 3 * 0.0004 * 0.75 * (0.03 / (2.91 * 2.91) + 1 / (2.98 * 2.98) + 0.03 / (2.98 * 2.98));
  EXPECT_NEAR(got[0] / expected, 1, 0.01);
  EXPECT_NEAR(Lit(medium, 2.5).reflectors.intensity_w_sr()[0] / got[0], 2.5, 1e-5);
}

// A Lambertian sphere that is lit from where it is seen: Int rho E cos^2 / pi dA = 2/3 rho E R^2.
TEST(Reflectors, ABallThrowsBackTwoThirds) {
  const Medium medium;
  std::vector<Surface> balls;
  for (const Surface& surface : testing::MarkerAndPlate(Pose::Translation(3, 0, 0)))
    if (surface.name == "ball_red") balls.push_back(surface);
  ASSERT_EQ(balls.size(), 1u);
  const double nearest_m = balls[0].X_AS.p.norm() - 0.02;
  const Rgb got = Lit(medium, 1, balls).reflectors.intensity_w_sr();
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(got[k], 2.0 / 3 * balls[0].albedo[k] * 0.0004 / (nearest_m * nearest_m),
                1e-3 * got[0]);
}

// Beside a painted ball in milk: by the halo's integral, of as much of its light as is seen from
// there.
TEST(Reflectors, GlowAsIsSeenFromThere) {
  WaterParams milk;
  milk.milk_ml_m3 = 40;
  const Medium medium = MakeMedium(milk);
  const MountedCamera camera = testing::SmallRig().left;
  const RayFrame rays(camera);
  for (const double way_m : {0.3, 1.2}) {
    const Eigen::Vector3d p_HBall = camera.X_HC * Eigen::Vector3d(0, 0, way_m);
    const Lit lit(medium, 1,
                  {testing::Ball("ball", Pose::Translation(p_HBall.x(), p_HBall.y(), p_HBall.z()),
                                 0.02, {1, 1, 1})});
    PointBatch batch{};
    batch.count = PointBatch::kVector;
    for (int i = 0; i < batch.count; ++i) {
      batch.u_px[i] = static_cast<float>(camera.cx_px + camera.fx_px * (0.03 + 0.002 * i) / way_m);
      batch.v_px[i] = static_cast<float>(camera.cy_px);
      batch.depth_m[i] = 20;
    }
    FindRays(rays, &batch);
    std::vector<Light> light(PointBatch::kVector, Light::Zero());
    const Glow glow = {.radius_m = 0.02, .intensity_w_sr = lit.reflectors.intensity_w_sr()};
    lit.reflectors.AddHalos(rays, batch.count, &batch, light.data());
    for (int i = 0; i < batch.count; ++i) {
      const Eigen::Vector3d ray(batch.ray_x[i], batch.ray_y[i], batch.ray_z[i]);
      const Eigen::Vector3d to_ball = p_HBall - camera.X_HC.p;
      const Rgb expected = HaloAlongRay(
          medium, medium.halo_loss_per_m(), SeenFrom(way_m, medium, glow), to_ball.dot(ray),
          to_ball.cross(ray).norm(), {0, static_cast<double>(batch.range_m[i])}, 2000);
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(light[static_cast<size_t>(i)][k] / expected[k], 1, 0.02) << way_m << " " << i;
    }
  }
}

// With surface halos the water never gets darker, nor brighter than what shines into it; without
// them nothing else changes.
TEST(Reflectors, OnlyAddLight) {
  const StereoRig rig = RigParams{}.MakeRig();
  const auto surfaces = testing::MarkerAndPlate(Pose::Translation(0.5, 0, 0));
  const view::RenderedStereo seen = testing::Cast(surfaces, rig);
  const auto images = [&](bool halos, double milk_ml_m3) {
    OpticsParams optics;
    optics.ball_lights.enabled = false;
    optics.lamps.enabled = true;
    optics.water.milk_ml_m3 = milk_ml_m3;
    optics.water.surface_halos = halos;
    RadianceStereo radiance;
    Water(optics, rig, SurfaceTable(surfaces), testing::LampsAt(0.16)).Apply(seen, &radiance);
    return radiance.left;
  };
  EXPECT_EQ(images(true, 0), images(false, 0));
  const Image3f with = images(true, 20), without = images(false, 20), clear = images(false, 0);
  double most = 0, brightest = 0;
  for (size_t i = 0; i < 3 * with.pixels(); ++i) {
    EXPECT_GE(with.data()[i], without.data()[i] - 1e-5f);
    most = std::max(most, static_cast<double>(with.data()[i] - without.data()[i]));
    brightest = std::max(brightest, static_cast<double>(clear.data()[i]));
  }
  EXPECT_GT(most, 0.002 * brightest);
  EXPECT_LT(most, 0.2 * brightest);
}

}  // namespace
}  // namespace turbidock::light
