// The world as a trial wires it: each eye has noise of its own, and contacts of a frame are those
// of all its ticks.

#include "experiments/trial/world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "experiments/trial/scenario.h"
#include "sim/vehicle/scene.h"
#include "sim/vehicle/sea.h"

namespace turbidock::trial {
namespace {

TEST(World, EachEyeAndEachFrameHasNoiseOfItsOwn) {
  // The passive marker without lamps: both perception look into the dark and see their noise alone.
  const Scenario scenario = LoadScenario(
      "pool_passive", {"lights.lamps.enabled=false", "cameras.sensor.read_noise_electrons=50",
                       "cameras.rig.width_px=64", "cameras.rig.height_px=48"});
  World world(scenario, {});
  Snapshot snapshot;
  world.Capture(&snapshot);
  StereoImage first, second, again;
  world.RenderImages(snapshot, 0, std::nullopt, nullptr, &first);
  world.RenderImages(snapshot, 1, std::nullopt, nullptr, &second);
  world.RenderImages(snapshot, 0, std::nullopt, nullptr, &again);
  const auto share_equal = [](const Image3u8& a, const Image3u8& b) {
    size_t equal = 0, lit = 0;
    for (size_t i = 0; i < 3 * a.pixels(); ++i) {
      lit += a.data()[i] != 0 || b.data()[i] != 0;
      equal += a.data()[i] == b.data()[i] && a.data()[i] != 0;
    }
    EXPECT_GT(lit, a.pixels() / 4);
    return static_cast<double>(equal) / static_cast<double>(lit);
  };
  EXPECT_EQ(share_equal(first.left, again.left), 1);
  EXPECT_LT(share_equal(first.left, first.right), 0.5);
  EXPECT_LT(share_equal(first.left, second.left), 0.5);
  EXPECT_LT(share_equal(first.right, second.right), 0.5);
}

TEST(World, TheVehicleStaysInTheOutsideView) {
  TrialOptions options;
  options.spectator = true;
  World world(LoadScenario("pool_active", {"cameras.rig.width_px=64", "cameras.rig.height_px=48"}),
              options);
  // Far to the side the picture shows how the vehicle is turned.
  const auto seen_at = [&](double yaw_rad) {
    world.PlaceVehicle({FromYawPitchRoll(yaw_rad, 0, 0), {-1.5, 2.5, 0.3}});
    return *world.DrawSpectator();
  };
  const Image3u8 ahead = seen_at(0), across = seen_at(1.5);
  size_t differing = 0;
  for (size_t i = 0; i < 3 * ahead.pixels(); ++i)
    differing += std::abs(ahead.data()[i] - across.data()[i]) > 10;
  EXPECT_GT(differing, 300u);
}

TEST(World, AFramesContactsAreTheStrongestOfItsTicks) {
  // Full ahead from half a metre, until the pole rattles in the dock.
  const Scenario scenario = LoadScenario(
      "pool_active", {"estimator.pose_source=true_pose", "trial.seed=3", "start.distance_min_m=0.6",
                      "start.distance_max_m=0.6", "start.lateral_m=0.02", "start.vertical_m=0.02",
                      "start.heading_rad=0.05"});
  World world(scenario, {});
  const SeedTree seeds(static_cast<uint64_t>(scenario.seed));
  const vehicle::Scene scene = vehicle::LoadScene(SceneFilesOf(scenario), scenario.rig);
  vehicle::Plant plant(scene, scenario.vehicle, scenario.clock,
                       vehicle::Sea(scenario.sea, seeds.Stream("sea")));
  plant.Reset(StartOf(scenario, scene, scene.X_WM).X_WB);
  ThrusterCommand ahead = ThrusterCommand::Neutral(4);
  ahead.volts[0] = ahead.volts[1] = 5;
  int touched = 0, stronger_before_the_end = 0;
  for (int frame = 0; frame < 300; ++frame) {
    vehicle::ContactReport contacts;
    ASSERT_FALSE(world.Advance(ahead, &contacts));
    double dock = 0, collision = 0, last = 0;
    for (int i = 0; i < scenario.clock.ticks_per_frame; ++i) {
      ASSERT_FALSE(plant.Step(ahead));
      const vehicle::ContactReport now = plant.contacts();
      last = now.dock_force_newton;
      dock = std::max(dock, now.dock_force_newton);
      collision = std::max(collision, now.collision_force_newton);
    }
    EXPECT_EQ(contacts.dock_force_newton, dock) << frame;
    EXPECT_EQ(contacts.collision_force_newton, collision) << frame;
    touched += dock > 0;
    stronger_before_the_end += dock > last;
  }
  EXPECT_GT(touched, 10);
  EXPECT_GT(stronger_before_the_end, 5);
}

}  // namespace
}  // namespace turbidock::trial
