#include "sim/vehicle/plant.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "tests/check/simple_scene.h"

namespace turbidock::vehicle {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

std::string Refusal(const std::function<void()>& make) {
  try {
    make();
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "accepted";
}

SeaParams LivelySea() {
  SeaParams params{.state = SeaState::kModerate};
  params.current = {.surface_velocity_mps = {0.05, 0.1, 0},
                    .decay_depth_m = 10,
                    .gust_std_mps = 0.03,
                    .gust_time_constant_s = 3};
  params.tether.enabled = true;
  return params;
}

TEST(Plant, RefusesBadParametersAndModels) {
  const Scene good = check::OpenWater();
  const auto with = [](const Scene& scene, const VehicleParams& params) {
    return Refusal([&] { Plant(scene, params, {}, Sea()); });
  };
  EXPECT_EQ(with(good, {}), "accepted");
  VehicleParams params;
  params.rigid_body.mass_kg = 0;
  EXPECT_THAT(with(good, params), HasSubstr("vehicle.rigid_body.mass_kg"));
  EXPECT_THAT(with(check::OpenWater("density='1000'"), {}), HasSubstr("density and viscosity"));

  params = {};
  params.contact.time_constant_s = 0.003;
  EXPECT_THAT(with(good, params), HasSubstr("vehicle.contact.time_constant_s"));

  std::string damped = check::kVehicleBody;
  damped.replace(damped.find("<freejoint/>"), 12, "<joint type='free' damping='1'/>");
  EXPECT_THAT(with(check::MakeScene(damped), {}), HasSubstr("no damping"));
  std::string hinged = check::kVehicleBody;
  hinged.replace(hinged.find("<freejoint/>"), 12, "<joint type='hinge'/>");
  EXPECT_THAT(with(check::MakeScene(hinged), {}), HasSubstr("free joint"));
}

TEST(Plant, StartsAtRestWhereItIsPut) {
  const Scene scene = check::OpenWater();
  Plant plant(scene, {}, {}, Sea(LivelySea(), SeedTree(1).Stream("sea")));
  const Pose X_WB{FromYawPitchRoll(0.3, -0.2, 0.1), {1, 2, -3}};
  plant.Reset(X_WB);
  const VehicleTruth now = plant.truth();
  EXPECT_EQ(now.tick, 0);
  EXPECT_EQ(now.X_WB.p, X_WB.p);
  EXPECT_LT(AngleBetween(now.X_WB.q, X_WB.q), 1e-7);
  EXPECT_EQ(now.V_WB_B.v, Vector3d::Zero());
  EXPECT_EQ(now.V_WB_B.w, Vector3d::Zero());
  EXPECT_EQ(now.thrust_newton, ThrusterForces(4, 0.0));
  EXPECT_EQ(plant.energy().residual(), 0);
}

TEST(Plant, ResetAndASecondPlantRepeatTheSameMotionBitForBit) {
  const Scene scene =
      check::MakeScene(std::string(check::kVehicleBody) +
                       R"(<geom name="floor" type="plane" size="5 5 1" pos="0 0 -5.3"/>)");
  const Sea sea(LivelySea(), SeedTree(1).Stream("sea"));
  Plant first(scene, {}, {}, sea), second(scene, {}, {}, sea);
  const auto run = [](Plant& plant) {
    plant.Reset(Pose::Translation(0, 0, -5));
    for (int i = 0; i < 1000; ++i)
      EXPECT_FALSE(plant.Step({.volts = {4, 3, 2, i < 500 ? 0.5 : 4.5}}).has_value());
    std::vector<double> state(plant.data().qpos, plant.data().qpos + plant.model().nq);
    state.insert(state.end(), plant.data().qvel, plant.data().qvel + plant.model().nv);
    return state;
  };
  const std::vector<double> once = run(first);
  EXPECT_GT(first.contacts().collision_force_newton + std::abs(once[0]), 0.1);
  EXPECT_EQ(run(first), once);
  EXPECT_EQ(run(second), once);
}

TEST(Plant, KeepsPositionsForRenderingUpToDate) {
  const Scene scene = check::OpenWater();
  Plant plant(scene, {}, {}, Sea());
  plant.SetVelocity({.v = {1, 0, 0}});
  for (int i = 0; i < 10; ++i) ASSERT_FALSE(plant.Step({}).has_value());
  const Vector3d drawn = Vector3d::Map(plant.data().xpos + 3 * scene.vehicle_body);
  EXPECT_EQ(drawn, plant.truth().X_WB.p);
  EXPECT_GT(drawn.x(), 0.01);
  EXPECT_DOUBLE_EQ(plant.data().time, 10.0 / 480);
}

TEST(Plant, TheMassIsTheParametersWhateverTheMjcfSays) {
  std::string body = check::kVehicleBody;
  body.insert(body.find("<geom name=\"hull\""),
              R"(<body name="camera_box"><geom name="hull_camera" type="box" size="0.05 0.05 0.05"
                 pos="0.1 0 0.2" mass="3"/></body>)");
  // A geom where the MJCF's centre of mass is: MuJoCo notes that their frames are equal.
  body.replace(body.find("inertial pos=\"0 0 0\""), 20, "inertial pos=\"0 0 0.1\"");
  body.insert(body.find("<geom name=\"hull\""),
              "<geom name='hull_top' type='sphere' size='0.01' pos='0 0 0.1'/>");
  const Scene scene = check::MakeScene(body);
  scene.model->stat.extent = 7;
  VehicleParams params;
  params.rigid_body.p_BBcm_m = {0.05, 0, -0.02};
  params.loads.push_back({.mass_kg = 1, .volume_m3 = 0, .p_BQ_m = {0, 0, 0}});
  Plant plant(scene, params, {}, Sea());
  EXPECT_DOUBLE_EQ(plant.model().body_subtreemass[scene.vehicle_body], 16);
  const Vector3d cm = Vector3d::Map(plant.data().subtree_com + 3 * scene.vehicle_body);
  EXPECT_LT((cm - Vector3d(0.05 * 15 / 16, 0, -5 - 0.02 * 15 / 16)).norm(), 1e-12);
  // Geoms stay where they were drawn although the inertial frame moved.
  const int hull = mj_name2id(&plant.model(), mjOBJ_GEOM, "hull");
  EXPECT_EQ(Vector3d(Vector3d::Map(plant.data().geom_xpos + 3 * hull)), Vector3d(0, 0, -5));
  const int top = mj_name2id(&plant.model(), mjOBJ_GEOM, "hull_top");
  EXPECT_EQ(Vector3d(Vector3d::Map(plant.data().geom_xpos + 3 * top)), Vector3d(0, 0, -4.9));
  EXPECT_EQ(plant.model().stat.extent, 7) << "rendering scales its depth range with it";
}

TEST(Plant, FrictionAndBounceOfPoleAndDockAreTheParameters) {
  const Scene scene =
      check::MakeScene(std::string(check::kVehicleBody) +
                       R"(<geom name="dock_face" type="box" size="1 1 1" pos="5 0 -5"/>)");
  VehicleParams params;
  params.contact = {.friction = 0.4, .restitution = std::exp(-2.0), .time_constant_s = 0.05};
  const Plant plant(scene, params, {}, Sea());
  const mjModel& m = plant.model();
  const auto expect = [&](const char* name, double friction, double time_s) {
    const int geom = mj_name2id(&m, mjOBJ_GEOM, name);
    EXPECT_EQ(m.geom_friction[3 * geom], friction) << name;
    EXPECT_EQ(m.geom_solref[mjNREF * geom], time_s) << name;
    EXPECT_EQ(m.geom_solref[mjNREF * geom + 1], 1) << name;  // exp(-2) is critical damping
  };
  expect("pole", 0.4, 0.05);
  expect("dock_face", 0.4, 0.05);
  expect("hull", 1, 0.02);  // MuJoCo's defaults
}

TEST(Plant, AnUnusableStateIsReportedWithItsReason) {
  const Scene scene = check::OpenWater();
  Plant plant(scene, {}, {}, Sea());
  ThrusterCommand broken = ThrusterCommand::Neutral(4);
  broken.volts[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(plant.Step(broken).value_or("fine"), HasSubstr("command is not finite"));
  EXPECT_EQ(plant.truth().tick, 0) << "nothing moved";

  plant.SetExtraWrench({.f = {1e9, 0, 0}});
  EXPECT_THAT(plant.Step({}).value_or("fine"), HasSubstr("diverged"));
  EXPECT_TRUE(plant.Step({}).has_value());
  plant.Reset(Pose::Translation(0, 0, -5));
  EXPECT_FALSE(plant.Step({}).has_value());

  plant.SetExtraWrench({.f = {std::numeric_limits<double>::infinity(), 0, 0}});
  EXPECT_THAT(plant.Step({}).value_or("fine"), HasSubstr("not finite"));
}

TEST(Plant, MujocosWarningsEndTheRun) {
  const Scene scene =
      check::MakeScene(std::string(check::kVehicleBody) +
                       R"(<geom name="floor" type="plane" size="5 5 1" pos="0 0 -5.2"/>)");
  scene.model->nconmax = 1;  // too few for a box on a plane
  Plant plant(scene, {}, {}, Sea());
  std::optional<std::string> fault;
  for (int i = 0; i < 960 && !fault; ++i) fault = plant.Step({.volts = {2.5, 2.5, 2.5, 0}});
  EXPECT_THAT(fault.value_or("fine"), HasSubstr("MuJoCo: "));
}

TEST(Contacts, AreSortedIntoDockingAndCollision) {
  const std::string dock =
      R"(<geom name="dock_face" type="box" size="0.05 0.3 0.1" pos="0.55 0 -5.11"/>)";
  const Scene scene =
      check::MakeScene(std::string(check::kVehicleBody) + dock +
                       R"(<geom name="rock" type="box" size="0.05 1 1" pos="-1 0 -5"/>)");
  Plant plant(scene, {}, {}, Sea());
  EXPECT_EQ(plant.contacts().dock_force_newton, 0);
  // The pole's end, which reaches 0.5 m ahead, meets the dock at once: wanted.
  double dock_newton = 0;
  for (int i = 0; i < 480; ++i) {
    ASSERT_FALSE(plant.Step({.volts = {4, 4, 2.5, 2.5}}).has_value());
    dock_newton = std::max(dock_newton, plant.contacts().dock_force_newton);
    EXPECT_EQ(plant.contacts().collision, "");
    EXPECT_EQ(plant.contacts().collision_force_newton, 0);
  }
  EXPECT_GT(dock_newton, 1);
  // Backwards into the rock: a collision with names.
  ContactReport hit;
  for (int i = 0; i < 480 * 8 && hit.collision.empty(); ++i) {
    ASSERT_FALSE(plant.Step({.volts = {0, 0, 2.5, 2.5}}).has_value());
    hit = plant.contacts();
  }
  EXPECT_EQ(hit.collision, "hull against rock");
  EXPECT_GT(hit.collision_force_newton, 0);
  for (int i = 0; i < 480 * 8 && hit.collision_force_newton > 0; ++i) {
    ASSERT_FALSE(plant.Step({.volts = {4, 4, 2.5, 2.5}}).has_value());
    hit = plant.contacts();
  }
  EXPECT_EQ(hit.collision_force_newton, 0);
  EXPECT_EQ(hit.collision, "") << "it is over";
  plant.Reset(Pose::Translation(0, 0, -5));
  EXPECT_EQ(plant.contacts().collision, "");
}

TEST(Contacts, HullAgainstTheDockIsACollision) {
  const Scene scene = check::MakeScene(
      std::string(check::kVehicleBody) +
      R"(<geom name="dock_face" type="box" size="0.1 0.1 0.1" pos="-0.35 0 -5"/>)");
  Plant plant(scene, {}, {}, Sea());
  ContactReport hit;
  for (int i = 0; i < 480 * 5 && hit.collision.empty(); ++i) {
    ASSERT_FALSE(plant.Step({.volts = {0, 0, 2.5, 2.5}}).has_value());
    hit = plant.contacts();
  }
  EXPECT_EQ(hit.collision, "hull against dock_face");
  EXPECT_EQ(hit.dock_force_newton, 0);
}

TEST(Pole, IsMeasuredInTheDocksFrame) {
  // A dock at (2, 1, -5) whose x axis points along W's y; its straight hole begins 50 mm in.
  Scene scene = check::MakeScene(std::string(check::kVehicleBody) +
                                 R"(<site name="dock_mouth" pos="2 1 -5" euler="0 0 90"/>)");
  scene.dock_throat_depth_m = 0.05;
  scene.dock_throat_half_width_m = 0.035;
  Plant plant(scene, {}, {}, Sea());
  const Eigen::Quaterniond facing = FromYawPitchRoll(std::numbers::pi / 2, 0, 0);
  // The tip is at (0.5, 0, -0.11) in B.
  const auto at = [&](double depth_m, double left_m, double up_m) {
    plant.Reset({facing, {2 - left_m, 1 + depth_m - 0.5, -5 + up_m + 0.11}});
    return plant.pole();
  };
  const PoleInDock before = at(-0.3, 0.02, -0.01);
  EXPECT_LT((before.p_DQ - Vector3d(-0.3, 0.02, -0.01)).norm(), 1e-12);
  EXPECT_NEAR(before.insertion_depth_m, -0.3, 1e-12);
  EXPECT_FALSE(before.inserted);
  EXPECT_FALSE(at(0.049, 0, 0).inserted);
  EXPECT_TRUE(at(0.051, 0, 0).inserted);
  EXPECT_TRUE(at(0.2, 0.034, -0.034).inserted);
  EXPECT_FALSE(at(0.2, 0.036, 0).inserted);
  EXPECT_FALSE(at(0.2, 0, -0.036).inserted);
}

TEST(Pole, SceneWithoutADockHasNone) {
  const Scene scene = check::OpenWater();
  const Plant plant(scene, {}, {}, Sea());
  EXPECT_FALSE(plant.pole().inserted);
}

}  // namespace
}  // namespace turbidock::vehicle
