// Marine snow: its light, its places, and that there is none by default.

#include "sim/light/marine_snow.h"
#include "sim/light/water.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/base/random.h"
#include "tests/light/optics_scene.h"

namespace turbidock::light {
namespace {

constexpr double kFrame_s = 1.0 / 30;

// Nothing before the cameras but water that takes nothing away.
view::RenderedStereo Nothing(const Pose& X_WH) {
  view::RenderedStereo seen;
  seen.X_WH = X_WH;
  for (view::RenderedView* view : {&seen.left, &seen.right}) {
    view->surface.Resize(640, 480, 0);
    view->depth_m.Resize(640, 480, std::numeric_limits<float>::infinity());
  }
  return seen;
}

OpticsParams OneLamp(double absorption_per_m) {
  OpticsParams optics;
  optics.water.background = Background::kCustom;
  optics.water.absorption_per_m.setConstant(absorption_per_m);
  optics.water.scattering_per_m.setZero();
  optics.ball_lights.enabled = false;
  optics.lamps.enabled = true;
  optics.lamps.beam = BeamShape::kIsotropic;
  optics.lamps.intensity_w_sr = {1, 2, 3};
  return optics;
}

struct Snowfall {
  RadianceStereo images;
  explicit Snowfall(const SnowParams& params, const Pose& X_WH = {}, int64_t frame = 0,
                    double absorption_per_m = 0, uint64_t key = 5,
                    const Eigen::Vector3d& drift_m = Eigen::Vector3d::Zero()) {
    const StereoRig rig = RigParams{}.MakeRig();
    Water water(OneLamp(absorption_per_m), rig, SurfaceTable(std::vector<Surface>{}), {Pose()});
    images = {Image3f(640, 480), Image3f(640, 480)};
    MarineSnow snow(params, kFrame_s, key);
    view::RenderedStereo nothing = Nothing(X_WH);
    nothing.drift_m = drift_m;
    snow.Fall(nothing, water.whole(), frame, &water);
    snow.Paint(&images);
  }
  double Sum(int channel) const {
    double sum = 0;
    for (size_t i = 0; i < images.left.pixels(); ++i)
      sum += static_cast<double>(images.left.data()[3 * i + static_cast<size_t>(channel)]);
    return sum;
  }
};

// The mean radiance over the picture is that of a cloud of scatterers by integral over its volume:
// density x albedo R^2 / 4 x I Int Int dr dOmega / s^2, s the way from the lamp at the head.
TEST(MarineSnow, ShinesAsACloudOfItsDensity) {
  SnowParams params;
  params.particles_per_m3 = 5000;
  params.albedo = 0.5;
  constexpr int kFalls = 24;
  double got = 0;
  for (uint64_t key = 1; key <= kFalls; ++key)
    got += Snowfall(params, {}, 0, 0, key).Sum(0) / kFalls;
  const StereoRig rig = RigParams{}.MakeRig();
  const double strength =
      params.particles_per_m3 * params.albedo * std::pow(params.diameter_m / 2, 2) / 4;
  double expected = 0;
  constexpr double kStep_m = 0.004;
  const Eigen::Matrix3d R_HC = rig.left.X_HC.R();
  for (int v = 4; v < 480; v += 8)
    for (int u = 4; u < 640; u += 8) {
      const Eigen::Vector3d ray_C = rig.left.RayAt(u, v);
      for (double z = kStep_m / 2; z < 2; z += kStep_m) {
        const Eigen::Vector3d p_H = rig.left.X_HC.p + R_HC * (z * ray_C);
        if (p_H.x() < 0.08 || p_H.cwiseAbs().maxCoeff() > 1.5) continue;
        expected += 64 * strength * ray_C.norm() * kStep_m / p_H.squaredNorm();
      }
    }
  // most of the light is that of the nearest thousand particles
  EXPECT_NEAR(got / expected, 1, 0.06);
  const Snowfall snow(params);
  EXPECT_NEAR(snow.Sum(2) / snow.Sum(0), 3, 1e-3);
  // absorption only takes away
  const Snowfall absorbed(params, {}, 0, 1);
  EXPECT_LT(absorbed.Sum(0), 0.7 * snow.Sum(0));
  EXPECT_GT(absorbed.Sum(0), 0.05 * snow.Sum(0));
}

// Every particle that the left camera has before it shines at its place: those of the cube about
// the head, drawn one after the other, none left out with its neighbours.
TEST(MarineSnow, IsAllThatIsInSight) {
  SnowParams params;
  params.particles_per_m3 = 40;
  params.albedo = 0.5;
  const StereoRig rig = RigParams{}.MakeRig();
  Rng poses(3, 0);
  int found = 0;
  for (int fall = 0; fall < 12; ++fall) {
    const Eigen::Vector3d axis{poses.Uniform(-1, 1), poses.Uniform(-1, 1), 1};
    const Eigen::AngleAxisd turn{poses.Uniform(-3, 3), axis.normalized()};
    const Pose X_WH{Eigen::Quaterniond(turn), {poses.Uniform(-9, 9), poses.Uniform(-9, 9), 0.7}};
    const Image3f image = Snowfall(params, X_WH).images.left;
    Rng drawn(5, 0);
    for (int i = 0; i < 40 * 27; ++i) {
      Eigen::Vector3d p_WF;
      for (double& x : p_WF) x = drawn.Uniform(0, 3);
      Eigen::Vector3d way_W = p_WF - X_WH.p;
      way_W -= (3 * (way_W / 3).array().round()).matrix();
      const Eigen::Vector3d p_HF = X_WH.R().transpose() * way_W;
      const Eigen::Vector3d p_CF = rig.left.X_HC.Inverse() * p_HF;
      if (p_CF.z() < 0.1) continue;
      const double f_px = rig.left.fx_px, u = rig.left.cx_px + f_px * p_CF.x() / p_CF.z(),
                   v = rig.left.cy_px + f_px * p_CF.y() / p_CF.z();
      const double column = std::round(u), row = std::round(v);
      if (std::min(column, row) < 0 || column > 639 || row > 479) continue;
      const double size_px = f_px * params.diameter_m / (4 * p_CF.z());
      const double variance_px2 = 0.16 + size_px * size_px;
      const double peak = params.albedo * std::pow(params.diameter_m / 2, 2) / 4 /
                          p_HF.squaredNorm() * f_px * f_px * p_CF.norm() / std::pow(p_CF.z(), 3) /
                          (2 * std::numbers::pi * variance_px2);
      const double least =
          peak * std::exp(-(std::pow(column - u, 2) + std::pow(row - v, 2)) / (2 * variance_px2));
      EXPECT_GT(image.at(static_cast<int>(column), static_cast<int>(row))[0], 0.5 * least)
          << fall << " " << p_HF.transpose();
      ++found;
    }
  }
  EXPECT_GT(found, 500);
}

// The particles stay where they are in the water, but for their sinking.
TEST(MarineSnow, RestsInTheWater) {
  SnowParams params;
  params.particles_per_m3 = 500;
  params.sink_mps = 0.06;
  const Snowfall start(params);
  EXPECT_GT(start.Sum(0), 0);
  // the vehicle sinks as the snow does: 0.06 m/s for 30 frames
  EXPECT_NEAR(Snowfall(params, Pose::Translation(0, 0, -0.06), 30).Sum(0) / start.Sum(0), 1, 1e-4);
  EXPECT_NE(Snowfall(params, {}, 30).images.left, start.images.left);
  // and the vehicle drifts as the water does
  const Eigen::Vector3d drift_m(0.3, -0.7, 0.05);
  const Snowfall drifted(params, Pose::Translation(0.3, -0.7, 0.05), 0, 0, 5, drift_m);
  EXPECT_NEAR(drifted.Sum(0) / start.Sum(0), 1, 1e-4);
  EXPECT_NE(Snowfall(params, {}, 0, 0, 5, drift_m).images.left, start.images.left);
  // places repeat themselves after the cube's side
  EXPECT_NEAR(Snowfall(params, Pose::Translation(3, -3, 6)).Sum(0) / start.Sum(0), 1, 1e-4);
}

// A small particle is a Gaussian of 0.4 pixels, wherever between the pixels it lies: along a row
// the logarithm of its light bends by -1 / 0.4^2.
TEST(MarineSnow, IsAsSharpAsTheLens) {
  SnowParams params;
  params.particles_per_m3 = 20;
  params.diameter_m = 1e-4;
  const Snowfall snow(params);
  const Image3f& image = snow.images.left;
  int particles = 0;
  for (int v = 1; v < 479; ++v)
    for (int u = 1; u < 639; ++u) {
      const auto at = [&](int du, int dv) { return double{image.at(u + du, v + dv)[0]}; };
      if (!(at(0, 0) > at(-1, 0) && at(0, 0) >= at(1, 0) && at(0, 0) > at(0, -1) &&
            at(0, 0) >= at(0, 1)))
        continue;
      EXPECT_NEAR(std::log(at(-1, 0) * at(1, 0) / std::pow(at(0, 0), 2)), -1 / 0.16, 0.4);
      EXPECT_NEAR(std::log(at(0, -1) * at(0, 1) / std::pow(at(0, 0), 2)), -1 / 0.16, 0.4);
      ++particles;
    }
  EXPECT_GT(particles, 10);
}

TEST(MarineSnow, IsHiddenBySurfaces) {
  SnowParams params;
  params.particles_per_m3 = 2000;
  const StereoRig rig = RigParams{}.MakeRig();
  Water water(OneLamp(0), rig, SurfaceTable(std::vector<Surface>{}), {Pose()});
  view::RenderedStereo wall = Nothing({});
  wall.left.depth_m = Image1f(640, 480, 0.05f);
  RadianceStereo images{Image3f(640, 480), Image3f(640, 480)};
  MarineSnow snow(params, kFrame_s, 5);
  snow.Fall(wall, water.whole(), 0, &water);
  snow.Paint(&images);
  EXPECT_EQ(images.left, Image3f(640, 480));
  EXPECT_NE(images.right, Image3f(640, 480));
}

// At the edge of something near, each pixel by itself.
TEST(MarineSnow, IsHiddenPixelByPixel) {
  SnowParams params;
  params.particles_per_m3 = 20000;
  params.diameter_m = 0.005;
  const Snowfall open(params);
  const StereoRig rig = RigParams{}.MakeRig();
  Water water(OneLamp(0), rig, SurfaceTable(std::vector<Surface>{}), {Pose()});
  view::RenderedStereo post = Nothing({});
  for (int v = 0; v < 480; ++v)
    for (int u = 300; u < 340; ++u) *post.left.depth_m.at(u, v) = 0.05f;
  RadianceStereo images{Image3f(640, 480), Image3f(640, 480)};
  MarineSnow snow(params, kFrame_s, 5);
  snow.Fall(post, water.whole(), 0, &water);
  snow.Paint(&images);
  for (int v = 0; v < 480; ++v)
    for (int u = 290; u < 350; ++u)
      ASSERT_EQ(images.left.at(u, v)[1], u < 300 || u >= 340 ? open.images.left.at(u, v)[1] : 0);
}

// A particle between four pixels shows a quarter of its peak in each.
TEST(MarineSnow, IsNotPaintedWhereNoPixelWouldShowIt) {
  SnowParams params;
  params.particles_per_m3 = 200;
  params.diameter_m = 1e-4;
  const Snowfall snow(params, {}, 0, 5);
  const Image3f& image = snow.images.left;
  double least = std::numeric_limits<double>::infinity();
  for (int v = 1; v < 479; ++v)
    for (int u = 1; u < 639; ++u) {
      const float here = image.at(u, v)[2];
      bool is_peak = here > 0;
      for (int dv = -1; dv <= 1; ++dv)
        for (int du = -1; du <= 1; ++du) is_peak &= image.at(u + du, v + dv)[2] <= here;
      if (is_peak) least = std::min(least, double{here});
    }
  constexpr double kFaintest_w_m2_sr = 5e-5;
  EXPECT_GT(least, 0.15 * kFaintest_w_m2_sr);
  EXPECT_LT(least, 2 * kFaintest_w_m2_sr);
}

TEST(MarineSnow, IsNoneUnlessSet) {
  EXPECT_FALSE(MarineSnow({}, kFrame_s, 5).on());
  EXPECT_EQ(Snowfall({}).Sum(0), 0);
}

}  // namespace
}  // namespace turbidock::light
