// The terms of the water model against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "sim/light/water.h"
#include "tests/light/optics_scene.h"

namespace turbidock::light {
namespace {

using Eigen::Vector3d;
using testing::Ball;
using testing::Block;
using testing::Cast;

constexpr double kPi = std::numbers::pi;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// One camera pixel row and column more than needed, with a pixel exactly in the middle.
StereoRig OddRig() {
  RigParams rig;
  rig.width_px = 65;
  rig.height_px = 49;
  return rig.MakeRig();
}

// Every pixel by itself, balls dark, lamps isotropic with 1 W/sr.
OpticsParams LampsOnly() {
  OpticsParams params;
  params.shading.tile_px = 1;
  params.ball_lights.enabled = false;
  params.lamps.enabled = true;
  params.lamps.beam = BeamShape::kIsotropic;
  params.lamps.intensity_w_sr = {1, 1, 1};
  return params;
}

OpticsParams BallsOnly() {
  OpticsParams params;
  params.shading.tile_px = 1;
  params.lamps.enabled = false;
  return params;
}

void SetMedium(const Vector3d& absorption_per_m, const Vector3d& scattering_per_m, double g,
               WaterParams* water) {
  water->background = Background::kCustom;
  water->absorption_per_m = absorption_per_m;
  water->scattering_per_m = scattering_per_m;
  water->asymmetry.setConstant(g);
}

Rgb MiddleOfLeft(const OpticsParams& params, const StereoRig& rig,
                 const std::vector<Surface>& surfaces, const std::vector<Pose>& X_HE) {
  Water water(params, rig, SurfaceTable(surfaces), X_HE);
  RadianceStereo out;
  water.Apply(Cast(surfaces, rig), &out);
  const float* pixel = out.left.at(32, 24);
  return {pixel[0], pixel[1], pixel[2]};
}

// A sphere of radius 0.02 whose middle the left camera's middle pixel sees at the given range.
std::vector<Surface> BallsAtRange(double range_m, const StereoRig& rig) {
  const Pose X_HQ = Pose::Translation(range_m + 0.02, rig.left.X_HC.p.y(), 0);
  return {Ball("ball_green", X_HQ, 0.02, Vector3d::Zero()),
          Ball("ball_red", Pose::Translation(0, 9, 0), 0.02, Vector3d::Zero()),
          Ball("ball_blue", Pose::Translation(0, -9, 0), 0.02, Vector3d::Zero())};
}

// Petzold (1972) at 514 nm: absorption and extinction; 1.8 % of the light is scattered backwards.
TEST(Medium, IsThePublishedWater) {
  const struct {
    Background background;
    double absorption_per_m, extinction_per_m;
  } waters[] = {{Background::kClear, 0.114, 0.151},
                {Background::kCoastal, 0.179, 0.398},
                {Background::kHarbor, 0.366, 2.190}};
  for (const auto& water : waters) {
    WaterParams params;
    params.background = water.background;
    params.milk_ml_m3 = 0;
    const Medium medium = MakeMedium(params);
    EXPECT_NEAR(medium.absorption_per_m[1], water.absorption_per_m, 1e-12);
    EXPECT_NEAR(medium.extinction_per_m()[1], water.extinction_per_m, 1e-12);
    // red light is absorbed more, blue light less than green
    EXPECT_GT(medium.absorption_per_m[0], medium.absorption_per_m[1]);
    EXPECT_LT(medium.absorption_per_m[2], medium.absorption_per_m[1]);
    double backwards = 0;
    constexpr int kSteps = 10000;
    for (int i = 0; i < kSteps; ++i)
      backwards += 2 * kPi / kSteps * HenyeyGreenstein(medium.asymmetry[1], -(i + 0.5) / kSteps);
    const double all_per_m = water.extinction_per_m - water.absorption_per_m;
    EXPECT_NEAR(backwards * medium.scattering_per_m[1] / all_per_m, 0.018, 0.0015);
  }
}

TEST(DirectLight, OfABallFallsAsBeerAndLambertOneWay) {
  const StereoRig rig = OddRig();
  OpticsParams params = BallsOnly();
  const Vector3d c(0.9, 1.2, 1.7);
  SetMedium(c, Vector3d::Zero(), 0, &params.water);
  const Rgb near = MiddleOfLeft(params, rig, BallsAtRange(0.4, rig), {});
  const Rgb far = MiddleOfLeft(params, rig, BallsAtRange(1.0, rig), {});
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(far[k] / near[k], std::exp(-c[k] * 0.6), 1e-5);
  const double emitted =
      params.ball_lights.rim_radiance_w_m2_sr + params.ball_lights.core_radiance_w_m2_sr;
  EXPECT_NEAR(near[1], emitted * std::exp(-c[1] * 0.4), 1e-6);
}

TEST(DirectLight, OfAPlateFallsTwoWays) {
  const StereoRig rig = OddRig();
  const double y_m = rig.left.X_HC.p.y();
  // the lamp at the optical centre, so that both ways are equal
  const std::vector<Pose> lamp = {Pose::Translation(0, y_m, 0)};
  const auto plate = [](double range_m) {
    return std::vector{
        Block("plate", Pose::Translation(range_m + 0.01, 0, 0), {0.01, 1, 1}, 0.6, false)};
  };
  OpticsParams params = LampsOnly();
  const Vector3d a(0.9, 1.2, 1.7);
  SetMedium(a, Vector3d::Zero(), 0, &params.water);
  for (const double r_m : {0.4, 1.0}) {
    const Rgb seen = MiddleOfLeft(params, rig, plate(r_m), lamp);
    for (int k = 0; k < 3; ++k) {
      const double expected = 0.6 / kPi / (r_m * r_m) * std::exp(-2 * a[k] * r_m);
      EXPECT_NEAR(seen[k], expected, 1e-5 * expected);
    }
  }
}

TEST(DirectLight, WithoutWaterIsPlainLambert) {
  const StereoRig rig = OddRig();
  OpticsParams params = LampsOnly();
  params.lamps.beam = BeamShape::kCosine;
  SetMedium(Vector3d::Zero(), Vector3d::Zero(), 0, &params.water);
  // a tilted plate lit by a lamp aside: E = I cos(alpha) cos(i) / d^2
  const Pose X_WS{FromYawPitchRoll(0.4, 0.2, 0), {0.8, 0, 0}};
  const std::vector<Surface> plate = {Block("plate", X_WS, {0.01, 1, 1}, 0.6, false)};
  const Pose X_HE{FromYawPitchRoll(-0.2, 0, 0), {0, 0.3, 0.1}};
  const Vector3d u_H = Vector3d::UnitX();
  const Vector3d normal_H = X_WS.q * -Vector3d::UnitX();
  const Vector3d p_on_face = X_WS.p + 0.01 * normal_H;
  const double range_m = normal_H.dot(p_on_face - rig.left.X_HC.p) / normal_H.dot(u_H);
  const Vector3d p_HQ = rig.left.X_HC.p + range_m * u_H, d_H = p_HQ - X_HE.p;
  const double expected = 0.6 / kPi * (X_HE.q * Vector3d::UnitX()).dot(d_H) / d_H.norm() *
                          -normal_H.dot(d_H) / d_H.norm() / d_H.squaredNorm();
  const Rgb seen = MiddleOfLeft(params, rig, plate, {X_HE});
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(seen[k], expected, 1e-6 * expected);
}

TEST(DirectLight, IsCutOffByTheMarker) {
  const StereoRig rig = OddRig();
  OpticsParams params = LampsOnly();
  SetMedium(Vector3d::Zero(), Vector3d::Zero(), 0, &params.water);
  std::vector<Surface> surfaces = {
      Block("plate", Pose::Translation(1.01, 0, 0), {0.01, 1, 1}, 0.6, false)};
  const Pose left = Pose::Translation(0, 0.5, 0), right = Pose::Translation(0, -0.5, 0);
  const Rgb one = MiddleOfLeft(params, rig, surfaces, {right});
  const Rgb both = MiddleOfLeft(params, rig, surfaces, {left, right});
  // a box between the plate's middle and the left lamp, beside the view
  surfaces.push_back(
      Block("marker_box", Pose::Translation(0.5, 0.06 + 0.22, 0), {0.05, 0.05, 0.05}, 0.5, true));
  EXPECT_NEAR(MiddleOfLeft(params, rig, surfaces, {left, right})[1], one[1], 1e-9);
  surfaces.back().casts_shadow = false;
  EXPECT_NEAR(MiddleOfLeft(params, rig, surfaces, {left, right})[1], both[1], 1e-9);
  EXPECT_GT(both[1], 1.5 * one[1]);
}

TEST(DirectLight, OfABallOnTheFaceItTouches) {
  // E = pi L (R / d)^2 cos(i), with d and cos(i) to the centre: a uniform Lambertian sphere
  const StereoRig rig = OddRig();
  OpticsParams params = BallsOnly();
  params.ball_lights.core_radiance_w_m2_sr = 0;
  SetMedium(Vector3d::Zero(), Vector3d::Zero(), 0, &params.water);
  std::vector<Surface> surfaces = BallsAtRange(0.5, rig);
  const double aside_m = 0.05;
  surfaces[0].X_AS.p.y() += aside_m;
  surfaces.push_back(
      Block("marker_box", Pose::Translation(0.59, 0, 0), {0.05, 0.2, 0.2}, 0.5, true));
  const double d2 = aside_m * aside_m + 0.02 * 0.02, cos_i = 0.02 / std::sqrt(d2);
  const double irradiance = kPi * params.ball_lights.rim_radiance_w_m2_sr * 0.0004 / d2 * cos_i;
  // the other balls, far away to the sides, lie behind the face's horizon
  EXPECT_NEAR(MiddleOfLeft(params, rig, surfaces, {})[1], 0.5 / kPi * irradiance,
              1e-5 * irradiance);
}

// L = b I / (4 pi h) [atan((z - t_p) / h) + atan(t_p / h)] without extinction, isotropic
// scattering.
TEST(Veil, WithoutExtinctionIsAnAngle) {
  Medium medium;
  medium.scattering_per_m = {0.5, 1, 2};
  Lamp lamp;
  lamp.beam.beam = BeamShape::kIsotropic;
  lamp.beam.intensity_w_sr = {3, 3, 3};
  lamp.p_HE = {0.2, 0.1, 0};
  for (const double z : {0.1, 0.7, kInfinity}) {
    const Rgb veil = VeilAlongRay(medium, Rgb::Zero(), lamp, {0, 0, 0}, {1, 0, 0}, {0, z}, 8);
    const double angle = std::atan((z - 0.2) / 0.1) + std::atan(0.2 / 0.1);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(veil[k], medium.scattering_per_m[k] * 3 / (4 * kPi * 0.1) * angle, 1e-9);
  }
}

// Isotropic source and scattering with extinction, against F(u, v) = Int_0^v exp(-u tan x) dx
// (Sun, Ramamoorthi, Narasimhan & Nayar 2005), and three values of that form.
TEST(Veil, HasTheClosedFormOfSunEtAl) {
  struct Case {
    double beta_per_m, s_m, gamma_rad, z_m, expected;
  };
  const auto F = [](double u, double v) {
    constexpr int kSteps = 20000;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) sum += std::exp(-u * std::tan((i + 0.5) * v / kSteps));
    return sum * v / kSteps;
  };
  for (const Case& c : {Case{2, 0.1, 1.4, 0.6, 1.52614}, Case{1, 0.6, 0.1, 1.0, 1.91552},
                        Case{3, 0.15, 2.0, 0.8, 0.582720}}) {
    Medium medium;
    medium.scattering_per_m.setConstant(c.beta_per_m);
    Lamp lamp;
    lamp.beam.beam = BeamShape::kIsotropic;
    lamp.beam.intensity_w_sr = {1, 1, 1};
    lamp.p_HE = c.s_m * Vector3d(std::cos(c.gamma_rad), std::sin(c.gamma_rad), 0);
    const Rgb veil =
        VeilAlongRay(medium, medium.Diffuse(0), lamp, {0, 0, 0}, {1, 0, 0}, {0, c.z_m}, 4000);
    EXPECT_NEAR(veil[0], c.expected, 1e-5 * c.expected);

    const double ts = c.beta_per_m * c.s_m, tz = c.beta_per_m * c.z_m;
    const double a1 = ts * std::sin(c.gamma_rad);
    const double upper = kPi / 4 + 0.5 * std::atan((tz - ts * std::cos(c.gamma_rad)) / a1);
    const double closed = c.beta_per_m * c.beta_per_m * std::exp(-ts * std::cos(c.gamma_rad)) /
                          (2 * kPi * a1) * (F(a1, upper) - F(a1, c.gamma_rad / 2));
    EXPECT_NEAR(veil[0], closed, 1e-6 * closed);
    // and with few samples nearly as well
    EXPECT_NEAR(
        VeilAlongRay(medium, medium.Diffuse(0), lamp, {0, 0, 0}, {1, 0, 0}, {0, c.z_m}, 16)[0],
        closed, 0.005 * closed);
  }
}

// Light that turned more than once, of an isotropic lamp in a medium without extinction: of the
// fluence of light scattered once, summed over the medium, b' / (4 pi) enters the ray.
TEST(Veil, OfLightThatTurnedTwice) {
  Medium medium;
  medium.scattering_per_m.setConstant(0.7);
  Lamp lamp;
  lamp.beam.beam = BeamShape::kIsotropic;
  lamp.beam.intensity_w_sr = {1, 1, 1};
  lamp.p_HE = {0.1, 0.2, 0};
  // Int b I / (4 pi y^2 z^2) dV about the axis from the lamp to a point at r, with y + z = r s and
  // y - z = r t, is b I / r times this.
  constexpr int kSums = 200000;
  double sum = 0;
  for (int i = 0; i < kSums; ++i) {
    const double inverse_s = (i + 0.5) / kSums;
    sum += 1 / inverse_s * std::log((1 + inverse_s) / (1 - inverse_s)) / kSums;
  }
  constexpr int kSteps = 2000;
  double expected = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double t_m = 0.6 * (i + 0.5) / kSteps;
    const double fluence = 0.7 / (Vector3d(t_m, 0, 0) - lamp.p_HE).norm() * sum;
    expected += 0.7 / (4 * kPi) * fluence * 0.6 / kSteps;
  }
  const auto veil = [&](bool multiple) {
    medium.multiple_scattering = multiple;
    return VeilAlongRay(medium, Rgb::Zero(), lamp, {0, 0, 0}, {1, 0, 0}, {0, 0.6}, 2000)[0];
  };
  EXPECT_NEAR(veil(true) - veil(false), expected, 1e-4 * expected);
}

// Isotropic scattering and no extinction: b I / (4 pi h) times the angle that the ray subtends at
// the ball, for a ball so small that it is a point.
TEST(Halo, WithoutExtinctionIsAnAngle) {
  Medium medium;
  medium.scattering_per_m = {0.5, 1, 2};
  const Glow glow{.radius_m = 1e-5, .intensity_w_sr = {2, 2, 2}};
  for (const double range_m : {0.3, 0.8, kInfinity}) {
    const Rgb halo = HaloAlongRay(medium, Rgb::Zero(), glow, 0.5, 0.1, {0, range_m}, 64);
    const double angle = std::atan((range_m - 0.5) / 0.1) + std::atan(0.5 / 0.1);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(halo[k], medium.scattering_per_m[k] * 2 / (4 * kPi * 0.1) * angle, 1e-6);
  }
}

// Far from a ball it is a point lamp whose light starts at the ball's surface: exp(G R) more of it
// arrives.
TEST(Halo, IsTheVeilOfALampFarFromTheBall) {
  const Medium medium = MakeMedium({.milk_ml_m3 = 100, .multiple_scattering = false});
  const Rgb diffuse_per_m = medium.Diffuse(0.5);
  const Glow glow{.radius_m = 0.01, .intensity_w_sr = {2, 2, 2}};
  Lamp lamp;
  lamp.beam.beam = BeamShape::kIsotropic;
  lamp.beam.intensity_w_sr = {2, 2, 2};
  lamp.p_HE = {0.5, 0.3, 0};
  const Rgb veil = VeilAlongRay(medium, diffuse_per_m, lamp, {0, 0, 0}, {1, 0, 0}, {0, 0.8}, 1000);
  const Rgb halo = HaloAlongRay(medium, diffuse_per_m, glow, 0.5, 0.3, {0, 0.8}, 1000);
  // the sphere's fluence is q^2 / 4 larger than the point's
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(halo[k] / veil[k], std::exp(0.01 * diffuse_per_m[k]), 0.0005);
}

// Fluence at distance r from a uniform Lambertian sphere: its radiance times its solid angle.
TEST(Halo, IsFedByTheFluenceOfASphere) {
  for (const double q : {1e-4, 0.1, 0.5, 0.9, 1.0}) {
    const double solid_angle = 2 * kPi * (1 - std::sqrt(1 - q * q));
    EXPECT_NEAR(FluenceRatio(q) * kPi * q * q, solid_angle, 1e-6 * q * q);
  }
}

}  // namespace
}  // namespace turbidock::light
