// The tables and the tiles against summing everything for every pixel.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/base/random.h"
#include "sim/camera/image_sensor.h"
#include "sim/light/water.h"
#include "tests/light/optics_scene.h"
#include "tests/light/plain_water.h"
#include "tests/support/transfer_curve.h"

namespace turbidock::light {
namespace {

using Eigen::Vector3d;
using testing::Block;
using testing::Cast;
using testing::LampsAt;
using testing::MarkerAndPlate;

OpticsParams Turbid(bool active) {
  OpticsParams params;
  params.water.milk_ml_m3 = 60;
  params.water.surface_halos = false;  // the plain model has none
  params.ball_lights.enabled = active;
  params.lamps.enabled = !active;
  params.shading.tile_px = 1;
  return params;
}

// Pixels anywhere in the image, ends of their rays at 0.1 to 5 m or nowhere.
struct Probe {
  int u, v;
  double depth_m;
};

std::vector<Probe> Probes(const StereoRig& rig) {
  Rng rng = SeedTree(21).Stream("probes");
  std::vector<Probe> probes;
  for (int i = 0; i < rig.left.width_px; ++i)
    probes.push_back({i,  // a column each, so that no two are at one pixel
                      static_cast<int>(rng.Below(rig.left.height_px)),
                      i % 10 == 0 ? std::numeric_limits<double>::infinity()
                                  : 0.1 * std::pow(50, rng.Uniform())});
  return probes;
}

// The scene with one black screen at each probe's depth, in the left view.
view::RenderedStereo BlackScreens(const StereoRig& rig, const std::vector<Probe>& probes,
                                  int screen) {
  view::RenderedStereo rendered = Cast({}, rig);
  for (const Probe& p : probes)
    if (std::isfinite(p.depth_m)) {
      *rendered.left.surface.at(p.u, p.v) = static_cast<uint16_t>(screen + 1);
      *rendered.left.depth_m.at(p.u, p.v) = static_cast<float>(p.depth_m);
    }
  return rendered;
}

TEST(VeilTable, AgreesWithQuadrature) {
  const StereoRig rig = RigParams{}.MakeRig();
  for (const double offset_m : {0.09, 0.16}) {
    const OpticsParams params = Turbid(false);
    const std::vector<Surface> surfaces = {
        Block("screen", Pose::Translation(9, 0, 0), {0.1, 9, 9}, 0, false)};
    Water water(params, rig, SurfaceTable(surfaces), LampsAt(offset_m));
    const std::vector<Probe> probes = Probes(rig);
    RadianceStereo out;
    water.Apply(BlackScreens(rig, probes, 0), &out);
    const Rgb diffuse_per_m = water.medium().lighting_loss_per_m();
    double worst = 0;
    for (const Probe& p : probes) {
      const Vector3d ray_C = rig.left.RayAt(p.u, p.v);
      Rgb expected = Rgb::Zero();
      for (const Pose& X_HE : LampsAt(offset_m))
        expected += VeilAlongRay(water.medium(), diffuse_per_m,
                                 {X_HE.p, X_HE.q * Vector3d::UnitX(), params.lamps},
                                 rig.left.X_HC.p, rig.left.X_HC.q * ray_C.normalized(),
                                 {params.water.port_m, p.depth_m * ray_C.norm()}, 400);
      for (int k = 0; k < 3; ++k)
        worst = std::max(worst, std::abs(out.left.at(p.u, p.v)[k] / expected[k] - 1));
    }
    EXPECT_LT(worst, 0.01) << offset_m;
    EXPECT_GT(worst, 1e-7) << "the table is not a table";
  }
}

// HaloAlongRay of `lit` without `dark`, which lies within it or is empty, from the table.
Rgb HaloFromTable(const HaloTable& table, const Glow& glow, const Rgb& diffuse_per_m, double foot_m,
                  double offset_m, const Stretch& lit, const Stretch& dark = {}) {
  const double h_m = std::max(offset_m, glow.radius_m);
  const auto up_to = [&](double t_m) -> Rgb {
    const double s_m = t_m - foot_m, w = std::isinf(s_m) ? 1.0 : s_m / (h_m + std::abs(s_m));
    const Light sum = table.Cumulative(HaloTable::AtOffset(static_cast<float>(glow.radius_m / h_m)),
                                       HaloTable::At(static_cast<float>(w)));
    return sum.head<3>().cast<double>();
  };
  Rgb sum = up_to(lit.t1_m) - up_to(lit.t0_m);
  if (dark.t1_m > dark.t0_m) sum -= up_to(dark.t1_m) - up_to(dark.t0_m);
  return sum.max(0.0) / h_m * (-diffuse_per_m * foot_m).exp();
}

class HaloTableOf : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(BallAndDisc, HaloTableOf, ::testing::Bool());

TEST_P(HaloTableOf, AgreesWithQuadrature) {
  const Medium medium = MakeMedium({.milk_ml_m3 = 60});
  const Rgb diffuse_per_m = medium.halo_loss_per_m();
  const Glow glow{.radius_m = 0.02, .intensity_w_sr = {1, 2, 3}, .disc = GetParam()};
  const HaloTable table(medium, glow);
  Rng rng = SeedTree(22).Stream("probes");
  double worst = 0, brightest = 0;
  int compared = 0;
  for (int i = 0; i < 2000; ++i) {
    const double foot_m = rng.Uniform(0.3, 1.5), offset_m = 0.02 * std::pow(25, rng.Uniform());
    const double range_m =
        i % 10 == 0 ? std::numeric_limits<double>::infinity() : foot_m + rng.Uniform(-0.2, 0.5);
    const Rgb expected =
        HaloAlongRay(medium, diffuse_per_m, glow, foot_m, offset_m, {0, range_m}, 1000);
    const Rgb got = HaloFromTable(table, glow, diffuse_per_m, foot_m, offset_m, {0, range_m});
    // relative to the brightest halo at that distance
    const Rgb scale =
        HaloAlongRay(medium, diffuse_per_m, glow, foot_m, 0.02, {0, 10 * foot_m}, 200);
    worst = std::max(worst, ((got - expected).abs() / scale).maxCoeff());
    brightest = std::max(brightest, (expected / scale).maxCoeff());
    ++compared;
    // a shadow takes away what lies in it
    const Stretch dark{0.4 * range_m, 0.6 * range_m};
    if (std::isfinite(range_m)) {
      const Rgb parts =
          HaloAlongRay(medium, diffuse_per_m, glow, foot_m, offset_m, {0, dark.t0_m}, 500) +
          HaloAlongRay(medium, diffuse_per_m, glow, foot_m, offset_m, {dark.t1_m, range_m}, 500);
      const Rgb shaded =
          HaloFromTable(table, glow, diffuse_per_m, foot_m, offset_m, {0, range_m}, dark);
      worst = std::max(worst, ((shaded - parts).abs() / scale).maxCoeff());
    }
  }
  EXPECT_EQ(compared, 2000);
  EXPECT_GT(brightest, 0.9);
  EXPECT_LT(worst, 0.002);
  EXPECT_GT(worst, 1e-7) << "the table is not a table";
}

// Lamps that look down and outwards.
std::vector<Pose> TiltedLamps() {
  std::vector<Pose> X_HE = LampsAt(0.16);
  X_HE[0].q = FromYawPitchRoll(0.1, 0.15, 0);
  X_HE[1].q = FromYawPitchRoll(-0.05, 0.2, 0.5);
  return X_HE;
}

// Single precision, batches and tables against the plain model, pixel by pixel: every 3rd of every
// 3rd row, of a small picture of the default marker.
TEST(Water, AgreesWithThePlainModel) {
  const StereoRig rig = testing::SmallRig();
  const camera::SensorParams camera;
  for (const bool active : {true, false})
    for (const BeamShape beam : {BeamShape::kCosine, BeamShape::kCone}) {
      const Pose X_WH{FromYawPitchRoll(2.0, 0.3, -0.4), {5, -3, -2}};
      auto surfaces =
          MarkerAndPlate(X_WH * Pose{FromYawPitchRoll(0.1, 0.05, 0), {0.6, 0.02, 0.01}});
      // one of each other shape too
      Surface odd =
          Block("odd", X_WH * Pose::Translation(0.7, 0.2, 0.1), {0.05, 0.08, 0.06}, 0.4, true);
      odd.shape = active ? Shape::kCylinder : Shape::kEllipsoid;
      surfaces.push_back(odd);
      odd.X_AS = X_WH * Pose{FromYawPitchRoll(0, 1, 0.3), {0.7, -0.2, 0.1}};
      odd.size_m = {0.03, 0.06, 0};
      odd.shape = Shape::kCapsule;
      surfaces.push_back(odd);
      const view::RenderedStereo rendered = Cast(surfaces, rig, X_WH);
      OpticsParams params = Turbid(active);
      params.lamps.beam = beam;
      const testing::PlainWater plain(params, rig, surfaces, TiltedLamps());
      RadianceStereo out;
      Water(params, rig, SurfaceTable(surfaces), TiltedLamps()).Apply(rendered, &out);
      const auto dn = [&](double radiance) {
        return 255 * testing::Encode(camera,
                                     std::min(1.0, radiance / camera.full_scale_radiance_w_m2_sr));
      };
      int compared = 0, off = 0, lit = 0;
      double worst = 0, squares = 0;
      for (int v = 0; v < rig.left.height_px; v += 3)
        for (int u = 0; u < rig.left.width_px; u += 3) {
          const Rgb expected = plain.At(rendered, u, v);
          for (int k = 0; k < 3; ++k) {
            const double error = dn(out.left.at(u, v)[k]) - dn(expected[k]);
            squares += error * error;
            worst = std::max(worst, std::abs(error));
            off += std::abs(error) > 0.5;
            lit += dn(expected[k]) > 5;
            ++compared;
          }
        }
      EXPECT_EQ(compared, 40 * 54 * 3);
      EXPECT_GT(lit, compared / 20);
      // tables of veil and halo: within a hundredth; the edge of a shadow may fall either side
      EXPECT_LT(std::sqrt(squares / compared), 0.1) << active;
      EXPECT_LE(off, compared / 500) << active << " " << worst;
      EXPECT_GT(worst, 1e-4) << "the two are one";
    }
}

// What interpolation over tiles does to the picture, in DN. The middle of each tile is within a
// quarter of a DN or a hundredth of the light; corners of shadows may slip through, so a few pixels
// are further off.
TEST(Tiles, AgreeWithEveryPixel) {
  const StereoRig rig = RigParams{}.MakeRig();
  const camera::SensorParams camera;
  for (const bool active : {true, false}) {
    const auto surfaces = MarkerAndPlate({FromYawPitchRoll(0.1, 0.05, 0), {0.8, 0.02, 0.01}});
    const view::RenderedStereo rendered = Cast(surfaces, rig);
    OpticsParams params = Turbid(active);
    RadianceStereo exact, tiled;
    Water(params, rig, SurfaceTable(surfaces), LampsAt(0.16)).Apply(rendered, &exact);
    params.shading.tile_px = 16;
    Water(params, rig, SurfaceTable(surfaces), LampsAt(0.16)).Apply(rendered, &tiled);
    double squares = 0;
    int far_off = 0, lit = 0;
    const size_t n = exact.left.pixels() * 3;
    const auto dn = [&](float radiance) {
      return 255 *
             testing::Encode(camera, std::min(1.0, radiance / camera.full_scale_radiance_w_m2_sr));
    };
    for (size_t i = 0; i < n; ++i) {
      const double expected = dn(exact.left.data()[i]), error = dn(tiled.left.data()[i]) - expected;
      squares += error * error;
      far_off += std::abs(error) > 1;
      lit += expected > 10;
    }
    EXPECT_LT(std::sqrt(squares / n), 0.1) << active;
    EXPECT_GT(squares, 0) << "the tiles are not tiles";
    EXPECT_LT(far_off, static_cast<int>(n / 2000)) << active;
    EXPECT_GT(lit, static_cast<int>(n / 100)) << active;
  }
}

}  // namespace
}  // namespace turbidock::light
