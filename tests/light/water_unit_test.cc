// The water model's parameters and what it does at the ends of their ranges.
#include "sim/light/water.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/base/check.h"
#include "sim/camera/image_sensor.h"
#include "tests/light/optics_scene.h"
#include "tests/support/transfer_curve.h"

namespace turbidock::light {
namespace {

using testing::Cast;
using testing::LampsAt;
using testing::MarkerAndPlate;
using testing::SmallRig;

std::string KeyOfError(const OpticsParams& params) {
  try {
    Water(params, SmallRig(), SurfaceTable(MarkerAndPlate({})), LampsAt(0.16));
  } catch (const ConfigError& error) {
    return error.key();
  }
  return "none";
}

TEST(OpticsParams, DefaultsAreValidAndBadOnesNameTheKey) {
  EXPECT_EQ(KeyOfError({}), "none");
  OpticsParams params;
  params.water.milk_ml_m3 = -1;
  EXPECT_EQ(KeyOfError(params), "water.milk_ml_m3");
  params = {};
  params.water.absorption_per_m[1] = -0.1;
  EXPECT_EQ(KeyOfError(params), "water.absorption_per_m");
  params = {};
  params.ball_lights.balls[1].name = "pink";
  EXPECT_EQ(KeyOfError(params), "lights.marker.balls[1].name");
}

TEST(MakeMedium, AddsMilkToTheBackground) {
  WaterParams params;
  params.milk_ml_m3 = 100;
  params.milk_scattering_m2_ml = {0.0182052, 0.0203826, 0.0223698};
  params.milk_asymmetry = {0.750, 0.714, 0.681};
  const Medium pool = MakeMedium(params);
  EXPECT_TRUE(pool.scattering_per_m.isApprox(Rgb(1.82052, 2.03826, 2.23698)));
  EXPECT_TRUE(pool.asymmetry.isApprox(Rgb(0.750, 0.714, 0.681)));
  EXPECT_TRUE(pool.extinction_per_m().isApprox(Rgb(2.10052, 2.08326, 2.25198)));
  EXPECT_TRUE(pool.Diffuse(0).isApprox(pool.extinction_per_m()));
  EXPECT_NEAR(pool.Diffuse(1)[0], 0.28 + 1.82052 * 0.25, 1e-12);

  // milk and sea: scattering adds, the mean cosine lies between
  params.background = Background::kCoastal;
  const Medium sea = MakeMedium(params);
  const double peak_per_m = sea.peak.scattering_per_m, peak_g = 1 - sea.peak.width_rad;
  EXPECT_NEAR(sea.scattering_per_m[1] + peak_per_m, 0.219 + 2.03826, 1e-12);
  EXPECT_NEAR(sea.scattering_per_m[1] * sea.asymmetry[1] + peak_per_m * peak_g,
              0.219 * 0.924 + 2.03826 * 0.714, 1e-12);
  EXPECT_NEAR(sea.absorption_per_m[1], 0.179, 1e-12);
}

TEST(HenyeyGreenstein, IntegratesToOneWithMeanCosineG) {
  for (const double g : {-0.5, 0.0, 0.3, 0.714, 0.924}) {
    constexpr int kSteps = 200000;
    double total = 0, cosine = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double mu = -1 + (i + 0.5) * 2 / kSteps;
      const double share = HenyeyGreenstein(g, mu) * 2 * M_PI * 2 / kSteps;
      total += share;
      cosine += share * mu;
    }
    EXPECT_NEAR(total, 1, 1e-6);
    EXPECT_NEAR(cosine, g, 1e-6);
  }
}

TEST(BeamPattern, OfTheThreeShapes) {
  LampParams lamp;
  lamp.beam = BeamShape::kIsotropic;
  EXPECT_EQ(BeamPattern(lamp, -1), 1);
  lamp.beam = BeamShape::kCosine;
  EXPECT_EQ(BeamPattern(lamp, 0.5), 0.5);
  EXPECT_EQ(BeamPattern(lamp, -0.5), 0);
  lamp.cosine_exponent = 4;
  EXPECT_NEAR(BeamPattern(lamp, 0.5), 0.0625, 1e-15);
  lamp.beam = BeamShape::kCone;
  const auto at = [&](double alpha_rad) { return BeamPattern(lamp, std::cos(alpha_rad)); };
  EXPECT_EQ(at(0), 1);
  EXPECT_EQ(at(lamp.cone_half_angle_rad - lamp.cone_soft_rad - 1e-3), 1);
  EXPECT_NEAR(at(lamp.cone_half_angle_rad - lamp.cone_soft_rad / 2), 0.5, 1e-9);
  EXPECT_EQ(at(lamp.cone_half_angle_rad + 1e-3), 0);
}

TEST(BeamPattern, MeanOverAllDirections) {
  LampParams narrow{.beam = BeamShape::kCosine, .cosine_exponent = 10},
      cone{.beam = BeamShape::kCone},
      soft{.beam = BeamShape::kCone, .cone_half_angle_rad = 0.2, .cone_soft_rad = 0.9};
  for (const LampParams& lamp :
       {LampParams{.beam = BeamShape::kIsotropic}, LampParams{}, narrow, cone, soft}) {
    constexpr int kSteps = 200000;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) sum += BeamPattern(lamp, -1 + 2 * (i + 0.5) / kSteps) / kSteps;
    EXPECT_NEAR(MeanBeamPattern(lamp), sum, 1e-3 * sum);
  }
}

TEST(Water, WithoutLightIsBlack) {
  const StereoRig rig = SmallRig();
  const auto surfaces = MarkerAndPlate(Pose::Translation(0.6, 0, 0));
  OpticsParams params;
  params.water.milk_ml_m3 = 100;
  params.ball_lights.enabled = false;
  Water water(params, rig, SurfaceTable(surfaces), LampsAt(0.16));
  RadianceStereo out;
  water.Apply(Cast(surfaces, rig), &out);
  EXPECT_EQ(out.left, Image3f(160, 120));
  EXPECT_EQ(out.right, Image3f(160, 120));
}

// What the default exposure is made for: balls at 0.6 m in clear water, as the camera encodes them.
// A lit ball is near 255 DN in the core and 150 to 200 at the rim, a painted one under the lamps
// 120 to 200.
TEST(Defaults, GiveWellExposedBalls) {
  const StereoRig rig = RigParams{}.MakeRig();
  const auto surfaces = MarkerAndPlate(Pose::Translation(0.6, 0, 0));
  const camera::SensorParams camera;
  const auto dn = [&](const Image3f& image, const std::string& ball, double aside_m) {
    const int geom = SurfaceTable(surfaces).Find(ball);
    const Eigen::Vector3d p_HQ = surfaces[geom].X_AS.p + Eigen::Vector3d(0, 0, aside_m);
    const Eigen::Vector2d pixel = rig.left.Project(rig.left.X_HC.Inverse() * p_HQ);
    const float* radiance = image.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
    const double brightest = std::max({radiance[0], radiance[1], radiance[2]});
    return 255 *
           testing::Encode(camera, std::min(1.0, brightest / camera.full_scale_radiance_w_m2_sr));
  };
  for (const bool active : {true, false}) {
    OpticsParams params;
    params.ball_lights.enabled = active;
    params.lamps.enabled = !active;
    RadianceStereo out;
    Water(params, rig, SurfaceTable(surfaces), LampsAt(0.16)).Apply(Cast(surfaces, rig), &out);
    for (const std::string ball : {"ball_green", "ball_red", "ball_blue"}) {
      const double core_dn = dn(out.left, ball, 0), rim_dn = dn(out.left, ball, 0.017);
      EXPECT_GE(core_dn, active ? 235 : 120) << ball;
      EXPECT_LE(core_dn, active ? 255 : 200) << ball;
      if (!active) continue;
      EXPECT_GE(rim_dn, 150) << ball;
      EXPECT_LE(rim_dn, 200) << ball;
    }
  }
}

// Only what lies between vehicle and scene counts, not where they are; and each picture is of its
// own.
TEST(Water, DependsOnRelativePoseOnly) {
  const StereoRig rig = SmallRig();
  const Pose X_HM{FromYawPitchRoll(0.1, -0.05, 0.02), {0.7, 0.03, -0.02}};
  const Pose X_WH{FromYawPitchRoll(2.0, 0.3, -0.4), {5, -3, -2}};
  OpticsParams params;
  params.water.milk_ml_m3 = 40;
  params.lamps.enabled = true;
  params.shading.tile_px = 1;
  const auto here = MarkerAndPlate(X_HM), there = MarkerAndPlate(X_WH * X_HM);
  RadianceStereo a, b;
  const view::RenderedStereo seen = Cast(here, rig);
  Water(params, rig, SurfaceTable(here), LampsAt(0.16)).Apply(seen, &a);
  view::RenderedStereo moved = seen;
  moved.X_WH = X_WH;
  Water(params, rig, SurfaceTable(there), LampsAt(0.16)).Apply(moved, &b);
  int compared = 0;
  double brightest = 0;
  for (size_t i = 0; i < a.left.pixels() * 3; ++i) {
    const float expected = a.left.data()[i];
    brightest = std::max(brightest, double{expected});
    EXPECT_NEAR(b.left.data()[i], expected, 1e-5 * expected + 1e-9) << i;
    ++compared;
  }
  EXPECT_EQ(compared, 160 * 120 * 3);
  EXPECT_GT(brightest, 0.05);
  EXPECT_NE(a.left, a.right);
}

// A lit surface that belongs to the vehicle moves with it.
TEST(Water, VehicleSurfacesAreInTheHeadFrame) {
  const StereoRig rig = SmallRig();
  auto surfaces = MarkerAndPlate(Pose::Translation(50, 0, 0));
  Surface arm =
      testing::Block("hull_arm", Pose::Translation(0.5, 0, 0), {0.1, 0.1, 0.1}, 0.5, false);
  arm.fixed_to = FixedTo::kVehicle;
  surfaces.push_back(arm);
  OpticsParams params;
  params.ball_lights.enabled = false;
  params.lamps.enabled = true;
  Water water(params, rig, SurfaceTable(surfaces), LampsAt(0.16));
  RadianceStereo here, there;
  water.Apply(Cast(surfaces, rig), &here);
  const Pose X_WH{FromYawPitchRoll(2.0, 0.3, -0.4), {5, -3, -2}};
  water.Apply(Cast(surfaces, rig, X_WH), &there);
  EXPECT_GT(here.left.at(80, 60)[1], 0.01);
  EXPECT_NEAR(there.left.at(80, 60)[1], here.left.at(80, 60)[1], 1e-9);
}

}  // namespace
}  // namespace turbidock::light
