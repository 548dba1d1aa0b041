// A station that moves, in the plant: where it is, what it does to the vehicle, what is refused.
#include "sim/vehicle/mooring.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "sim/base/check.h"
#include "sim/vehicle/plant.h"
#include "tests/support/message_of.h"
#include "tests/vehicle/posed_scene.h"

namespace turbidock::vehicle {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using testing::ModelPath;

Mooring WithParams(const MooringParams& params) {
  return {params, 0, SeedTree(5).Stream("mooring")};
}

// Bodies and joints have their numbers in the file's order.
Scene StationBeforeVehicle() {
  const std::string file = ::testing::TempDir() + "station_first.xml";
  std::ofstream(file) << R"(<mujoco>
    <include file="sea.xml"/>
    <worldbody>
      <body name="moored_body" pos="0 0 -1">
        <inertial pos="0 0 0" mass="200" diaginertia="20 20 20"/>
        <joint name="mooring_x" type="slide" axis="1 0 0"/>
        <joint name="mooring_y" type="slide" axis="0 1 0"/>
        <include file="station.xml"/>
        <include file="marker_active.xml"/>
      </body>
    </worldbody>
    <include file="vehicle.xml"/>
  </mujoco>)";
  SceneFiles files{.scene = file};
  for (const char* part : {"sea", "common", "station", "marker_active", "vehicle"})
    files.shared[part + std::string(".xml")] = ModelPath(part);
  Scene scene = LoadScene(files, {});
  std::filesystem::remove(file);
  return scene;
}

TEST(Mooring, SwingsNoFasterThanPhysicsFollow) {
  EXPECT_THAT(testing::MessageOf([] { WithParams({.natural_period_s = 1e-9}); }),
              HasSubstr("station.mooring.natural_period_s: 1e-09 must be 0 or in [0.5, 600]"));
  EXPECT_EQ(testing::MessageOf([] { WithParams({.natural_period_s = 0.5}); }), "no error");
}

TEST(MovingStation, IsWhereTheMooringHasItWhateverTouchesIt) {
  const Scene scene = LoadScene({ModelPath("sea_moored_active")}, {});
  Plant plant(scene, {}, {}, Sea(),
              WithParams({.swing_x_m = 0.01, .swing_y_m = 0.1, .swing_period_s = 4}));
  Mooring alone = WithParams(plant.mooring().params());
  alone.Reset(Sea(), scene.X_WM.p);
  // the pole deep in the hole: the station takes the vehicle along
  const Pose X_HM = Pose::Translation(0.33, 0, 0);
  plant.Reset(plant.X_WM() * (scene.X_BH * X_HM).Inverse());
  double most_newton = 0, farthest_m = 0;
  const ThrusterCommand idle = ThrusterCommand::Neutral(scene.thrusters.size());
  for (int tick = 0; tick < 2000; ++tick) {
    ASSERT_EQ(plant.Step(idle), std::nullopt);
    alone.Step(Sea(), tick * ClockParams().dt_s(), ClockParams().dt_s());
    most_newton = std::max(most_newton, plant.contacts().dock_force_newton);
    farthest_m = std::max(farthest_m, std::abs(plant.pole().p_DQ.y()));
    const Vector3d moved = plant.X_WM().p - scene.X_WM.p;
    ASSERT_LT((moved - Vector3d(alone.displacement().x(), alone.displacement().y(), 0)).norm(),
              1e-6)
        << tick;
  }
  EXPECT_GT(most_newton, 1) << "they touched";
  EXPECT_LT(farthest_m, scene.dock_throat_half_width_m) << "the hole kept the pole";
}

// Friction is against the station, not against the world: a plate that slides past takes along
// whoever leans on it.
TEST(MovingStation, RubsWithItsOwnVelocity) {
  const Scene scene = LoadScene({ModelPath("sea_moored_active")}, {});
  const auto sway_mps = [&](double swing_y_m) {
    MooringParams params{.swing_y_m = swing_y_m, .swing_period_s = 60};
    VehicleParams vehicle;
    vehicle.contact.friction = 0.8;
    Plant plant(scene, vehicle, {}, Sea(), WithParams(params));
    // the tip on the lead-in's lower plate, pressed down
    const Pose X_HM = Pose::Translation(0.43, 0, 0.028);
    plant.Reset(plant.X_WM() * (scene.X_BH * X_HM).Inverse());
    plant.SetExtraWrench({.tau = Vector3d::Zero(), .f = {0, 0, -8}});
    const double before_m = plant.X_WM().p.y();
    double pressed_s = 0;
    for (int tick = 0; tick < 720; ++tick) {
      EXPECT_EQ(plant.Step(ThrusterCommand::Neutral(scene.thrusters.size())), std::nullopt);
      pressed_s += plant.contacts().dock_force_newton > 1 ? ClockParams().dt_s() : 0;
    }
    EXPECT_GT(pressed_s, 0.1);
    const double station_mps = (plant.X_WM().p.y() - before_m) / (720 * ClockParams().dt_s());
    return std::pair(plant.truth().X_WB.q * plant.truth().V_WB_B.v, station_mps);
  };
  const auto [still, none] = sway_mps(0);
  EXPECT_NEAR(none, 0, 1e-12);
  EXPECT_NEAR(still.y(), 0, 2e-3);
  const auto [taken, station_mps] = sway_mps(0.5);
  EXPECT_GT(std::abs(station_mps), 0.02);
  EXPECT_GT(taken.y() / station_mps, 0.1) << "of the station's velocity";
}

TEST(MovingStation, NeedsItsJoints) {
  const Scene fixed = LoadScene({ModelPath("sea_active")}, {});
  const auto refusal = [&](const MooringParams& params) -> std::string {
    try {
      Plant(fixed, {}, {}, Sea(), WithParams(params));
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(refusal({}), "accepted");
  EXPECT_THAT(refusal({.swing_x_m = 0.1}), HasSubstr("station.mooring.swing_x_m"));
  EXPECT_THAT(refusal({.swing_y_m = 0.1}), HasSubstr("mooring_y"));
  EXPECT_THAT(refusal({.natural_period_s = 3}), HasSubstr("station.mooring.natural_period_s"));
  EXPECT_THAT(refusal({.weathervane_arm_m = 3}), HasSubstr("mooring_yaw"));
}

TEST(MovingStation, IsWhereTheMooringHasItAlsoBeforeTheVehicle) {
  const Scene scene = StationBeforeVehicle();
  ASSERT_EQ(scene.moored_body.joints[0], 0);
  Plant plant(scene, {}, {}, Sea(), WithParams({.swing_x_m = 0.2, .swing_y_m = 0.1}));
  plant.Reset(plant.truth().X_WB);
  const Vector3d displacement = plant.mooring().displacement();
  EXPECT_GT(std::abs(displacement.x()), 0.01);
  const Vector3d moved = plant.X_WM().p - scene.X_WM.p;
  EXPECT_LT((moved - Vector3d(displacement.x(), displacement.y(), 0)).norm(), 1e-12);
}

// A station that could move and does not is one that stands: the same trial, tick by tick.
TEST(MovingStation, ThatStandsIsAnyOther) {
  const Scene fixed = LoadScene({ModelPath("sea_active")}, {});
  SeaParams sea_params;
  sea_params.current.surface_velocity_mps = {0.1, 0.05, 0};
  const Sea sea(sea_params, SeedTree(1).Stream("sea"));
  const Pose X_WB = fixed.X_WM * (fixed.X_BH * Pose::Translation(0.43, 0.02, 0)).Inverse();
  const Scene behind = LoadScene({ModelPath("sea_moored_active")}, {});
  const Scene in_front = StationBeforeVehicle();
  for (const Scene* free : {&behind, &in_front}) {
    Plant first(*free, {}, {}, sea), second(fixed, {}, {}, sea);
    first.Reset(X_WB);
    second.Reset(X_WB);
    double touched_newton = 0;
    for (int tick = 0; tick < 1500; ++tick) {
      const ThrusterCommand ahead{.volts = {3.2, 3.2, 2.5, 2.5}};
      ASSERT_EQ(first.Step(ahead), std::nullopt);
      ASSERT_EQ(second.Step(ahead), std::nullopt);
      touched_newton = std::max(touched_newton, second.contacts().dock_force_newton);
    }
    EXPECT_GT(touched_newton, 1);
    EXPECT_LT((first.truth().X_WB.p - second.truth().X_WB.p).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace turbidock::vehicle
