// Lights that die, flicker or rise, against closed forms.

#include "sim/light/light_fault.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/light/water.h"
#include "tests/light/optics_scene.h"

namespace turbidock::light {
namespace {

using testing::Block;
using testing::Cast;
using testing::LampsAt;
using testing::SmallRig;

LightFault Fault(const std::string& light, double factor, double flicker_hz, double begin_s) {
  return {{begin_s, /*end_s=*/10}, light, factor, flicker_hz};
}

TEST(LightFault, IsDeadFromItsBeginningToItsEnd) {
  const LightFault fault = Fault("red", 0, 0, 2);
  EXPECT_EQ(FactorAt(fault, 1.99), 1);
  for (const double time_s : {2.0, 5.3, 9.99}) EXPECT_EQ(FactorAt(fault, time_s), 0);
  EXPECT_EQ(FactorAt(fault, 10), 1);
}

TEST(LightFault, FlickersForHalfOfEachPeriod) {
  const LightFault fault = Fault("red", 0.1, 2, 1);
  EXPECT_EQ(FactorAt(fault, 1), 0.1);
  EXPECT_EQ(FactorAt(fault, 1.24), 0.1);
  EXPECT_EQ(FactorAt(fault, 1.26), 1);
  EXPECT_EQ(FactorAt(fault, 1.49), 1);
  EXPECT_EQ(FactorAt(fault, 1.51), 0.1);
}

TEST(LightFault, DimsTheLightsThatItNames) {
  const LightsNow now = LightsAt({}, {Fault("green", 0.5, 0, 0), Fault("lamp_right", 0, 0, 0)}, 3);
  EXPECT_EQ(now.lamp_factors, (std::vector<double>{1, 0}));
  for (const BallLight& ball : now.balls.balls)
    EXPECT_EQ(ball.current_factor, ball.name == "green" ? 0.5 : 1) << ball.name;
}

TEST(LightFault, RefusesALightThatIsNotThere) {
  const std::vector<BallLight> balls = BallLightParams{}.balls;
  EXPECT_NO_THROW(Fault("blue", 0, 0, 0).CheckLight("a", balls));
  EXPECT_NO_THROW(Fault("lamp_left", 0, 0, 0).CheckLight("a", balls));
  try {
    Fault("lamp", 0, 0, 0).CheckLight("a", balls);
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("a.light"));
    EXPECT_THAT(error.what(), ::testing::HasSubstr("lamp_left, lamp_right, red, green, blue"));
  }
}

OpticsParams Dark() {
  OpticsParams params;
  params.ball_lights.enabled = false;
  params.shading.tile_px = 1;
  params.water.milk_ml_m3 = 10;
  return params;
}

// Light adds: what one lamp alone gives and what the other one gives are what both give.
TEST(LampFactors, LeaveTheOtherLampsLight) {
  OpticsParams params = Dark();
  params.lamps.enabled = true;
  params.water.surface_halos = false;
  const StereoRig rig = SmallRig();
  const std::vector<Surface> wall = {
      Block("wall", Pose::Translation(1, 0, 0), {0.01, 0.3, 0.3}, 0.5, false)};
  const auto seen = Cast(wall, rig);
  const auto light = [&](const std::vector<double>& factors) {
    RadianceStereo images;
    Water(params, rig, SurfaceTable(wall), LampsAt(0.2), factors).Apply(seen, &images);
    return images;
  };
  const RadianceStereo both = light({}), left = light({1, 0}), right = light({0, 0.5}),
                       none = light({0, 0});
  int compared = 0;
  for (int v = 0; v < 120; v += 7)
    for (int u = 0; u < 160; u += 7)
      for (int k = 0; k < 3; ++k) {
        const float whole = both.left.at(u, v)[k];
        EXPECT_GT(whole, 0);
        EXPECT_NEAR(left.left.at(u, v)[k] + 2 * right.left.at(u, v)[k], whole, 1e-4 * whole);
        EXPECT_EQ(none.left.at(u, v)[k], 0);
        ++compared;
      }
  EXPECT_GT(compared, 1000);
}

TEST(AmbientLightFault, GrowsInProportionToTheFull) {
  AmbientLightFault day;
  day.begin_s = 5;
  day.end_s = 100;
  day.rise_s = 20;
  day.irradiance_w_m2 = {1, 2, 4};
  EXPECT_TRUE((DaylightAt({day}, 4.9) == 0).all());
  EXPECT_TRUE((DaylightAt({day}, 10) == Eigen::Array3d(0.25, 0.5, 1)).all());
  EXPECT_TRUE((DaylightAt({day}, 60) == Eigen::Array3d(1, 2, 4)).all());
  EXPECT_TRUE((DaylightAt({day, day}, 60) == Eigen::Array3d(2, 4, 8)).all());
  EXPECT_TRUE((DaylightAt({day}, 100) == 0).all());
}

// An upright face has half of what comes from above; endless water has b / c E / (2 pi).
// The brighter, the more a surface looks up, however the vehicle lies in the water.
TEST(Daylight, ComesFromAbove) {
  const OpticsParams params = Dark();
  const StereoRig rig = SmallRig();
  const Eigen::Array3d day_w_m2(0.1, 0.2, 0.3);
  const Medium medium = MakeMedium(params.water);
  const Eigen::Array3d c = medium.extinction_per_m();
  const Eigen::Array3d veil = medium.scattering_per_m / c * day_w_m2 / (2 * std::numbers::pi);
  for (const Pose& X_WH : {Pose(), Pose{FromYawPitchRoll(2.0, 0.4, -0.3), {5, -3, -2}}})
    for (const double pitch_rad : {-0.6, 0.0, 0.6}) {
      const Pose X_WS = X_WH * Pose{FromYawPitchRoll(0, pitch_rad, 0), {1, 0, 0}};
      const std::vector<Surface> wall = {Block("wall", X_WS, {1e-5, 0.2, 0.2}, 0.5, false)};
      const auto seen = Cast(wall, rig, X_WH);
      Water water(params, rig, SurfaceTable(wall), {});
      water.SetDaylight(day_w_m2);
      RadianceStereo images;
      water.Apply(seen, &images);
      const double share = 0.5 + 0.5 * -(X_WS.q * Eigen::Vector3d::UnitX()).z();
      int walls = 0;
      for (int v = 0; v < 120; v += 5)
        for (int u = 0; u < 160; u += 5) {
          if (*seen.left.surface.at(u, v) == 0) continue;
          ++walls;
          const Eigen::Array3d left =
              (-c * *seen.left.depth_m.at(u, v) * rig.left.RayAt(u, v).norm()).exp();
          const Eigen::Array3d expected =
              veil * (1 - left) + share / std::numbers::pi * 0.5 * day_w_m2 * left;
          for (int k = 0; k < 3; ++k)
            EXPECT_NEAR(images.left.at(u, v)[k], expected[k], 2e-3 * expected[k]) << u << " " << v;
        }
      EXPECT_GT(walls, 30);
    }
}

TEST(Daylight, LightsSurfacesAndWater) {
  const OpticsParams params = Dark();
  const StereoRig rig = SmallRig();
  const std::vector<Surface> wall = {
      Block("wall", Pose::Translation(1.01, 0, 0), {0.01, 0.2, 0.2}, 0.5, false)};
  const auto seen = Cast(wall, rig);
  Water water(params, rig, SurfaceTable(wall), {});
  RadianceStereo images;
  water.Apply(seen, &images);
  EXPECT_EQ(images.left, Image3f(160, 120));
  const Eigen::Array3d day_w_m2(0.1, 0.2, 0.3);
  water.SetDaylight(day_w_m2);
  water.Apply(seen, &images);
  const Medium medium = MakeMedium(params.water);
  const Eigen::Array3d c = medium.extinction_per_m();
  const Eigen::Array3d veil = medium.scattering_per_m / c * day_w_m2 / (2 * std::numbers::pi);
  int walls = 0, waters = 0;
  for (int v = 0; v < 120; v += 5)
    for (int u = 0; u < 160; u += 5) {
      const bool hit = *seen.left.surface.at(u, v) != 0;
      const double range_m = *seen.left.depth_m.at(u, v) * rig.left.RayAt(u, v).norm();
      Eigen::Array3d expected = veil;
      if (hit) {
        const Eigen::Array3d left = (-c * range_m).exp();
        expected = veil * (1 - left) + 0.5 / std::numbers::pi * 0.5 * day_w_m2 * left;
      }
      ++(hit ? walls : waters);
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(images.left.at(u, v)[k], expected[k], 2e-3 * expected[k]) << u << " " << v;
    }
  EXPECT_GT(walls, 50);
  EXPECT_GT(waters, 50);
}

// What has a ball's light shines as that ball does where it is.
TEST(ShinesAs, HasTheBallsLight) {
  OpticsParams params = Dark();
  params.ball_lights.enabled = true;
  params.ball_lights.balls = {{"red", {1, 0.03, 0.03}}};
  params.water.milk_ml_m3 = 0;
  const StereoRig rig = SmallRig();
  // to both sides of what is straight ahead of the left camera: mirror images of each other
  const double ahead_m = rig.left.X_HC.p.y();
  std::vector<Surface> balls = {
      testing::Ball("ball_red", Pose::Translation(1, ahead_m + 0.15, 0), 0.02, {0.5, 0.1, 0.1}),
      testing::Ball("fish", Pose::Translation(1, ahead_m - 0.15, 0), 0.02, {0.5, 0.1, 0.1})};
  balls[1].casts_shadow = false;
  balls[1].shines_as = "red";
  view::RenderedStereo seen = Cast(balls, rig);
  seen.distractors = {{true, balls[1].X_AS}};
  Water water(params, rig, SurfaceTable(balls), {});
  RadianceStereo images;
  water.Apply(seen, &images);
  int lit = 0;
  for (int v = 0; v < 120; ++v)
    for (int u = 0; u < 80; ++u) {
      if (*seen.left.surface.at(u, v) != 1 || *seen.left.surface.at(159 - u, v) != 2) continue;
      const float ball = images.left.at(u, v)[0];
      EXPECT_GT(ball, 0.03);
      EXPECT_NEAR(images.left.at(159 - u, v)[0], ball, 1e-4 * ball);
      ++lit;
    }
  EXPECT_GT(lit, 15);

  // One that is not there lights nothing.
  view::RenderedStereo gone = Cast({balls[0]}, rig);
  gone.distractors = {{false, balls[1].X_AS}};
  RadianceStereo alone, with_absent;
  Water(params, rig, SurfaceTable({balls[0]}), {}).Apply(Cast({balls[0]}, rig), &alone);
  water.Apply(gone, &with_absent);
  EXPECT_EQ(alone.left, with_absent.left);
}

}  // namespace
}  // namespace turbidock::light
