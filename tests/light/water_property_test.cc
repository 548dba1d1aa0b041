// What must hold whatever the water: scattering never adds to direct light, nor creates energy.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sim/light/water.h"
#include "tests/light/optics_scene.h"

namespace turbidock::light {
namespace {

using testing::Cast;
using testing::LampsAt;
using testing::MarkerAndPlate;
using testing::SmallRig;

Image3f Left(const OpticsParams& params, const std::vector<Surface>& surfaces) {
  const StereoRig rig = SmallRig();
  RadianceStereo out;
  Water(params, rig, SurfaceTable(surfaces), LampsAt(0.16)).Apply(Cast(surfaces, rig), &out);
  return out.left;
}

OpticsParams Base(bool active) {
  OpticsParams params;
  params.water.background = Background::kCustom;
  params.water.multiple_scattering = false;
  params.ball_lights.enabled = active;
  params.lamps.enabled = !active;
  params.shading.tile_px = 1;
  return params;
}

TEST(Water, ScatteringOnlyAddsItsOwnLight) {
  const auto surfaces = MarkerAndPlate(Pose::Translation(0.6, 0, 0));
  for (const bool active : {true, false}) {
    int compared = 0;
    for (const double b_per_m : {0.1, 1.0, 4.0}) {
      OpticsParams params = Base(active);
      params.water.absorption_per_m = {1 + b_per_m, 1 + b_per_m, 1 + b_per_m};
      const Image3f absorbing = Left(params, surfaces);
      params.water.absorption_per_m = {1, 1, 1};
      params.water.scattering_per_m = {b_per_m, b_per_m, b_per_m};
      const Image3f scattering = Left(params, surfaces);
      params.water.scattering_per_m = {0, 0, 0};
      const Image3f clear = Left(params, surfaces);
      for (size_t i = 0; i < clear.pixels() * 3; ++i) {
        // strict single scattering: direct light as with absorption of the same strength, plus
        // scattered
        EXPECT_GE(scattering.data()[i], absorbing.data()[i] * (1 - 1e-5f));
        // which is less than in clearer water
        EXPECT_LE(absorbing.data()[i], clear.data()[i] * (1 + 1e-6f));
        ++compared;
      }
    }
    EXPECT_EQ(compared, 3 * 160 * 120 * 3);
  }
}

// Energy: a ball of intensity I in the middle of a sphere of thin water of radius r, scattering
// equally in all directions, loses 4 pi I b r watts to scattering, I b r per steradian. The halo
// seen by parallel rays, summed over the plane across them, must be just that.
TEST(Halo, SumsToThePowerThatIsScattered) {
  Medium medium;
  medium.scattering_per_m.setConstant(1e-3);
  const Glow glow{.radius_m = 1e-4, .intensity_w_sr = {1, 1, 1}};
  // rays at distance h from the ball, in the water for 2 sqrt(1 - h^2)
  constexpr int kRings = 4000;
  double power_w_sr = 0;
  for (int i = 0; i < kRings; ++i) {
    const double h = (i + 0.5) / kRings, half = std::sqrt(1 - h * h);
    power_w_sr += HaloAlongRay(medium, Rgb::Zero(), glow, 2, h, {2 - half, 2 + half}, 32)[0] * 2 *
                  M_PI * h / kRings;
  }
  EXPECT_NEAR(power_w_sr, 1e-3 * 1 * 1, 1e-3 * 1e-3);
}

TEST(Water, RadianceIsFiniteAndNotNegative) {
  for (const bool active : {true, false})
    for (const double milk : {0.0, 1.0, 2000.0})
      for (const double x_m : {0.02, 0.12, 0.35, 30.0}) {  // also with the camera inside a ball
        OpticsParams params;
        params.water.milk_ml_m3 = milk;
        params.ball_lights.enabled = active;
        params.lamps.enabled = !active;
        const Image3f image = Left(params, MarkerAndPlate(Pose::Translation(x_m, 0.06, 0)));
        int bad = 0;
        for (size_t i = 0; i < image.pixels() * 3; ++i)
          bad += !(image.data()[i] >= 0 && std::isfinite(image.data()[i]));
        EXPECT_EQ(bad, 0) << active << " " << milk << " " << x_m;
      }
}

}  // namespace
}  // namespace turbidock::light
