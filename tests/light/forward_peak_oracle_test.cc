// Balls in the sea against light that scatters as often as it likes: walks from the camera to the
// ball (Monte Carlo) with the whole phase function, narrow peak and all.
#include "sim/light/forward_peak.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <tuple>
#include <vector>

#include "sim/base/random.h"
#include "sim/light/water.h"
#include "tests/light/optics_scene.h"
#include "tests/light/turns.h"

namespace turbidock::light {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr double kRadius_m = 0.02;
constexpr int kGreen = 1;

OpticsParams InSea(Background background, bool multiple_scattering = true) {
  OpticsParams params;
  params.water.multiple_scattering = multiple_scattering;
  params.water.background = background;
  params.shading.tile_px = 1;
  return params;
}

// The same without the peak: what is left of the water, and its light neither spread nor lost.
OpticsParams WithoutPeak(const OpticsParams& params) {
  const Medium medium = MakeMedium(params.water);
  OpticsParams plain = params;
  plain.water.background = Background::kCustom;
  plain.water.absorption_per_m = medium.absorption_per_m;
  plain.water.scattering_per_m = medium.scattering_per_m;
  plain.water.asymmetry = medium.asymmetry;
  return plain;
}

// The green ball straight ahead of the left camera; the others out of sight.
std::vector<Surface> GreenBall(double distance_m, const StereoRig& rig) {
  const auto ball = [](const char* name, const Vector3d& p) {
    return testing::Ball(name, {Eigen::Quaterniond::Identity(), p}, kRadius_m, Vector3d::Zero());
  };
  const Vector3d ahead = rig.left.X_HC.p + distance_m * Vector3d::UnitX();
  return {ball("ball_green", ahead), ball("ball_red", {-9, 9, 0}), ball("ball_blue", {-9, -9, 0})};
}

Image3f Left(const OpticsParams& params, const std::vector<Surface>& surfaces,
             const StereoRig& rig) {
  Water water(params, rig, SurfaceTable(surfaces), {});
  RadianceStereo out;
  water.Apply(testing::Cast(surfaces, rig), &out);
  return out.left;
}

double Within(double g, double angle_rad) {
  const double mu = std::cos(angle_rad);
  return (1 - g * g) / (2 * g) * (1 / (1 - g) - 1 / std::sqrt(1 + g * g - 2 * g * mu));
}

// Petzold (1972) at 514 nm, as tabulated by Mobley (Light and Water, 1994): what turns by less than
// 1 and 2 degrees, integrated over the table, below 0.1 degree as the power of the angle there.
TEST(ForwardPeak, HasTheMeasuredSharesOfSmallAngles) {
  const struct {
    Background background;
    double scattering_per_m, within_1_deg, within_2_deg;
  } waters[] = {{Background::kClear, 0.037, 0.200, 0.301},
                {Background::kCoastal, 0.219, 0.352, 0.461},
                {Background::kHarbor, 1.824, 0.231, 0.341}};
  for (const auto& water : waters) {
    const Medium medium = MakeMedium(InSea(water.background).water);
    const double peak_per_m = medium.peak.scattering_per_m, g = 1 - medium.peak.width_rad;
    const double rest_per_m = medium.scattering_per_m[kGreen], rest_g = medium.asymmetry[kGreen];
    const double all_per_m = peak_per_m + rest_per_m;
    EXPECT_NEAR(all_per_m, water.scattering_per_m, 1e-12);
    const auto within = [&](double degrees) {
      const double angle_rad = degrees * kPi / 180;
      return (peak_per_m * Within(g, angle_rad) + rest_per_m * Within(rest_g, angle_rad)) /
             all_per_m;
    };
    EXPECT_NEAR(within(1), water.within_1_deg, 0.003);
    EXPECT_NEAR(within(2), water.within_2_deg, 0.003);
    EXPECT_NEAR(1 - within(90), 0.018, 0.001);
    EXPECT_NEAR((peak_per_m * g + rest_per_m * rest_g) / all_per_m, 0.924, 1e-12);
  }
}

TEST(ForwardPeak, IsTheSeasAlone) {
  for (const Background background : {Background::kPure, Background::kCustom}) {
    OpticsParams params = InSea(background);
    params.water.milk_ml_m3 = 60;
    const Medium medium = MakeMedium(params.water);
    EXPECT_EQ(medium.peak.scattering_per_m, 0);
    EXPECT_TRUE((medium.image_loss_per_m() == medium.extinction_per_m()).all());
  }
}

// What walks see of a ball along a ray.
class BallWalk {
 public:
  BallWalk(const Medium& medium, const BallLightParams& lights, const Vector3d& p_HBall)
      : medium_(medium), lights_(lights), p_HBall_(p_HBall) {}

  double Mean(const Vector3d& p, const Vector3d& u, int walks, Rng rng) const {
    double sum = 0;
    for (int i = 0; i < walks; ++i) sum += Walk(p, u, &rng);
    return sum / walks;
  }

 private:
  double Walk(Vector3d p, Vector3d u, Rng* rng) const {
    const double peak_per_m = medium_.peak.scattering_per_m;
    const double b_per_m = medium_.scattering_per_m[kGreen] + peak_per_m;
    double way_m = 0;
    // what has gone far past the ball does not come back
    while ((p - p_HBall_).norm() < p_HBall_.norm() + 0.5) {
      const double free_m = -std::log(1 - rng->Uniform()) / b_per_m;
      const Vector3d to_ball = p_HBall_ - p;
      const double foot_m = to_ball.dot(u), offset_m = (to_ball - foot_m * u).norm();
      if (foot_m > 0 && offset_m < kRadius_m) {
        const double hit_m = foot_m - std::sqrt(kRadius_m * kRadius_m - offset_m * offset_m);
        if (hit_m < free_m)
          return std::exp(-medium_.absorption_per_m[kGreen] * (way_m + hit_m)) *
                 (lights_.rim_radiance_w_m2_sr +
                  lights_.core_radiance_w_m2_sr *
                      std::exp(-0.5 * std::pow(offset_m / lights_.core_width_m, 2)));
      }
      way_m += free_m;
      p += free_m * u;
      const bool narrow = rng->Uniform() * b_per_m < peak_per_m;
      const double g = narrow ? 1 - medium_.peak.width_rad : medium_.asymmetry[kGreen];
      u = testing::Turned(u, testing::HenyeyGreenstein(g, rng), rng);
    }
    return 0;
  }

  Medium medium_;
  BallLightParams lights_;
  Vector3d p_HBall_;
};

class ForwardPeakAt : public ::testing::TestWithParam<std::tuple<Background, double>> {};
INSTANTIATE_TEST_SUITE_P(Seas, ForwardPeakAt,
                         ::testing::Combine(::testing::Values(Background::kCoastal,
                                                              Background::kHarbor),
                                            ::testing::Values(0.5, 1.0, 2.0)));

TEST_P(ForwardPeakAt, ABallIsSeenAsByWalks) {
  const auto [background, distance_m] = GetParam();
  const StereoRig rig = RigParams{}.MakeRig();
  const std::vector<Surface> surfaces = GreenBall(distance_m, rig);
  const OpticsParams params = InSea(background);
  const Image3f image = Left(params, surfaces, rig);
  const Vector3d p_HBall = surfaces[0].X_AS.p;
  const BallWalk walk(MakeMedium(params.water), params.ball_lights, p_HBall);
  for (const double radii : {0.0, 0.5, 0.8, 1.2, 1.5, 2.0, 3.0}) {
    const double aside_px = rig.left.fx_px * radii * kRadius_m / distance_m;
    const int u = static_cast<int>(std::round(rig.left.cx_px + aside_px));
    const int v = static_cast<int>(std::round(rig.left.cy_px));
    const Vector3d ray_H = rig.left.X_HC.q * rig.left.RayAt(u, v).normalized();
    const double at_radii = (p_HBall - rig.left.X_HC.p).cross(ray_H).norm() / kRadius_m;
    const double walked =
        walk.Mean(rig.left.X_HC.p, ray_H, radii > 1 ? 400000 : 20000, SeedTree(1).Stream("walks"));
    // the halo of two mean free paths of water is the limit, not the peak
    const double bound = background == Background::kHarbor && distance_m == 2 ? 0.13 : 0.1;
    EXPECT_NEAR(image.at(u, v)[kGreen] / walked, 1, bound) << at_radii << " radii";
  }
}

// Nothing is lost and nothing is won: over the image the ball has the light it has without a peak.
TEST_P(ForwardPeakAt, LightIsConserved) {
  const auto [background, distance_m] = GetParam();
  const StereoRig rig = RigParams{}.MakeRig();
  const std::vector<Surface> surfaces = GreenBall(distance_m, rig);
  const OpticsParams params = InSea(background, false);
  const Image3f with = Left(params, surfaces, rig);
  const Image3f without = Left(WithoutPeak(params), surfaces, rig);
  double change = 0;
  for (int v = 0; v < 480; ++v)
    for (int u = 0; u < 640; ++u)
      change += (double{with.at(u, v)[kGreen]} - without.at(u, v)[kGreen]) /
                std::pow(rig.left.RayAt(u, v).norm(), 3);
  const Medium medium = MakeMedium(params.water);
  const BallLightParams& lights = params.ball_lights;
  const double two_var_m2 = 2 * std::pow(lights.core_width_m, 2);
  const double intensity_w_sr =
      kPi * (std::pow(kRadius_m, 2) * lights.rim_radiance_w_m2_sr +
             two_var_m2 * (1 - std::exp(-std::pow(kRadius_m, 2) / two_var_m2)) *
                 lights.core_radiance_w_m2_sr);
  const double sum = intensity_w_sr * std::pow(rig.left.fx_px / distance_m, 2) *
                     std::exp(-medium.image_loss_per_m()[kGreen] * (distance_m - kRadius_m));
  EXPECT_NEAR(change / sum, 0, 0.02);
}

// A box before the ball hides what is spread of it, too, and half a box half of it.
TEST(ForwardPeak, IsHiddenWithTheBall) {
  const StereoRig rig = RigParams{}.MakeRig();
  std::vector<Surface> surfaces = GreenBall(1, rig);
  const OpticsParams params = InSea(Background::kHarbor, false);
  const auto spread = [&](double aside_m) {
    std::vector<Surface> scene = surfaces;
    const Pose X_HS = Pose::Translation(0.9, rig.left.X_HC.p.y() + aside_m, 0);
    scene.push_back(testing::Block("marker_box", X_HS, {0.01, 0.1, 0.022}, 0, true));
    const int u = static_cast<int>(rig.left.cx_px), v = static_cast<int>(rig.left.cy_px) + 20;
    return double{Left(params, scene, rig).at(u, v)[kGreen]} -
           double{Left(WithoutPeak(params), scene, rig).at(u, v)[kGreen]};
  };
  const double open = spread(0.3);
  EXPECT_GT(open, 1e-5);
  EXPECT_NEAR(spread(0.1) / open, 0.5, 0.1);
  EXPECT_NEAR(spread(0) / open, 0, 1e-3);
}

}  // namespace
}  // namespace turbidock::light
