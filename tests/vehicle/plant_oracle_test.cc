// The plant against closed forms. The free vehicle's (inertia, drag, righting, currents, waves) are
// in tests/check.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/vehicle/plant.h"
#include "tests/check/simple_scene.h"

namespace turbidock::vehicle {
namespace {

using Eigen::Vector3d;

constexpr double kGravity_mps2 = 9.81;

Rng SeaStream() { return SeedTree(1).Stream("sea"); }

// Neutrally buoyant, so that only what a test is about moves the vehicle.
VehicleParams Neutral() {
  VehicleParams params;
  params.hydrodynamics.displaced_volume_m3 = params.rigid_body.mass_kg / 1025;
  return params;
}

VehicleParams WithoutDamping(VehicleParams params) {
  params.hydrodynamics.linear_damping_diagonal.setZero();
  params.hydrodynamics.quadratic_damping_diagonal.setZero();
  return params;
}

void Advance(Plant& plant, double seconds) {
  const int64_t ticks = std::llround(seconds / plant.model().opt.timestep);
  for (int64_t i = 0; i < ticks; ++i) {
    const auto fault = plant.Step({});
    ASSERT_FALSE(fault.has_value()) << *fault;
  }
}

// Without damping and turning, (m + A) v' = (rho V + A) u': a neutral body follows the water, a
// heavy one lags by the ratio of masses.
TEST(Waves, MoveAnUndampedBodyByTheRatioOfMasses) {
  SeaParams sea;
  sea.random_phases = false;
  sea.waves = {{.height_m = 0.02, .period_s = 2.5, .direction_rad = std::numbers::pi / 2}};
  for (const double volume_share : {1.0, 0.6}) {
    VehicleParams params = WithoutDamping(Neutral());
    params.hydrodynamics.displaced_volume_m3 *= volume_share;
    params.hydrodynamics.p_BBcb_m.setZero();
    // Weight off: only the pressure of the waves counts.
    const Scene scene = check::OpenWater(check::kWeightless);
    Plant plant(scene, params, {}, Sea(sea, SeaStream()));
    plant.Reset(Pose::Translation(0, 0, -1));
    const Sea water(sea, SeaStream());
    const double ratio = (15 * volume_share + 10) / (15 + 10);
    const double heave_ratio = (15 * volume_share + 9) / (15 + 9);
    const Vector3d start = water.At({0, 0, -1}, 0).v_W;
    plant.SetVelocity({.v = {0, ratio * start.y(), heave_ratio * start.z()}});
    double worst = 0, largest = 0;
    for (int i = 1; i <= 480 * 5; ++i) {
      ASSERT_FALSE(plant.Step({}).has_value());
      const double expected = ratio * water.At({0, 0, -1}, i / 480.0).v_W.y();
      worst = std::max(worst, std::abs(plant.truth().V_WB_B.v.y() - expected));
      largest = std::max(largest, std::abs(expected));
    }
    // It wanders off the fixed point of the formula by its own small excursions (k times 1 cm: 0.6
    // %), and the step adds w dt / 2 = 0.3 %.
    EXPECT_LT(worst, 0.01 * largest) << volume_share;
  }
}

TEST(Thrust, ActsAtItsMount) {
  VehicleParams params = WithoutDamping(Neutral());
  params.thrusters.lag_s = 0;
  const Scene scene = check::OpenWater();
  Plant plant(scene, params, check::TicksPerTenth(50), Sea());
  // The left surge thruster alone: forward and a turn to the right.
  ThrusterCommand command = ThrusterCommand::Neutral(4);
  command.volts[0] = 5;
  ASSERT_FALSE(plant.Step(command).has_value());
  Twist V = plant.truth().V_WB_B;
  EXPECT_NEAR(V.v.x() / 0.002, 4.9 / 21, 1e-9);
  EXPECT_NEAR(V.w.z() / 0.002, -4.9 * 0.10 / 0.28, 1e-9);
  command.volts = {2.5, 2.5, 5, 0};
  plant.Reset(Pose::Translation(0, 0, -5));
  ASSERT_FALSE(plant.Step(command).has_value());
  V = plant.truth().V_WB_B;
  EXPECT_NEAR(V.v.y() / 0.002, 4.9 / 25, 1e-9);
  EXPECT_NEAR(V.v.z() / 0.002, -0.9 * 4.9 / 24, 1e-9);
  EXPECT_NEAR(V.w.norm(), 0, 1e-9);
}

// B g l sin(theta) = F d: the vehicle then moves along its own x axis, where drag has no moment.
TEST(Thrust, BelowTheCentreOfMassPitchesTheVehicle) {
  std::string body = check::kVehicleBody;
  for (const std::string place : {"-0.13 0.10 0", "-0.13 -0.10 0"})
    body.replace(body.find(place), place.size(), place.substr(0, place.size() - 1) + "-0.05");
  VehicleParams params = Neutral();
  params.thrusters.inflow_loss_s_per_m = 0;
  // Equal in all directions: the Munk moment would turn the vehicle out of its course, which has no
  // fin.
  params.hydrodynamics.added_mass_diagonal.head<3>().setConstant(6);
  const Scene scene = check::MakeScene(body);
  Plant plant(scene, params, check::TicksPerTenth(50), Sea());
  plant.Reset(Pose::Translation(0, 0, -50));
  for (int i = 0; i < 500 * 60; ++i)
    ASSERT_FALSE(plant.Step({.volts = {5, 5, 2.5, 2.5}}).has_value());
  const double nose_up = (plant.truth().X_WB.q * Vector3d::UnitX()).z();
  EXPECT_NEAR(nose_up, 2 * 4.9 * 0.05 / (15 * kGravity_mps2 * 0.03), 1e-6);
}

// The left thruster sits 0.10 m left of the middle: turning left it moves back, against a current
// forward.
TEST(Thrust, IsLostToTheFlowAtEachMount) {
  VehicleParams params = Neutral();
  params.thrusters.lag_s = 0;
  SeaParams sea;
  sea.current.surface_velocity_mps = {-0.2, 0, 0};
  const Scene scene = check::OpenWater();
  Plant plant(scene, params, check::TicksPerTenth(50), Sea(sea, SeaStream()));
  plant.SetVelocity({.w = {0, 0, 0.5}, .v = {0.1, 0, 0}});
  ASSERT_FALSE(plant.Step({.volts = {5, 5, 2.5, 2.5}}).has_value());
  const ThrusterForces thrust = plant.truth().thrust_newton;
  EXPECT_NEAR(thrust[0], 4.9 * (1 - 0.3 * (0.1 + 0.2 - 0.05)), 1e-12);
  EXPECT_NEAR(thrust[1], 4.9 * (1 - 0.3 * (0.1 + 0.2 + 0.05)), 1e-12);
}

TEST(Tether, TurnsTheVehicleAndTradesEnergyLikeASpring) {
  VehicleParams params = WithoutDamping(Neutral());
  SeaParams sea;
  sea.tether = {.enabled = true,
                .p_BQ_m = {-0.2, 0.1, 0},
                .p_WAnchor_m = {-5.2, 0.1, -5},
                .length_m = 4.8,
                .drag_coefficient = 0,
                .net_weight_newton_per_m = 0,
                .stiffness_newton_per_m = 50,
                .stretch_damping_newton_s_per_m = 0};
  const Scene scene = check::OpenWater();
  Plant plant(scene, params, check::TicksPerTenth(200), Sea(sea, SeaStream()));
  ASSERT_FALSE(plant.Step({}).has_value());
  // Stretched by 0.2 m: 10 N backwards, 0.1 m left of the middle.
  EXPECT_NEAR(plant.truth().V_WB_B.v.x() / 0.0005, -10.0 / 21, 1e-9);
  EXPECT_NEAR(plant.truth().V_WB_B.w.z() / 0.0005, 10 * 0.1 / 0.28, 1e-9);
  Advance(plant, 0.5);
  const Pose X_WB = plant.truth().X_WB;
  const double stretch_m =
      std::max(0.0, (X_WB * sea.tether.p_BQ_m - sea.tether.p_WAnchor_m).norm() - 4.8);
  const double released_joule = 0.5 * 50 * (0.2 * 0.2 - stretch_m * stretch_m);
  EXPECT_GT(released_joule, 0.1);
  EXPECT_NEAR(plant.energy().tether_work, released_joule, 0.005 * released_joule);
  EXPECT_NEAR(plant.energy().kinetic_change + plant.energy().potential_change, released_joule,
              0.005 * released_joule);
}

// A round pole at the centre of mass against a wall, in vacuum: nothing but the contact acts.
Scene RoundPoleBesideAWall(const std::string& wall) {
  return check::MakeScene(R"(
  <body name="vehicle" pos="0 0 -5">
    <freejoint/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <geom name="pole" type="sphere" size="0.1"/>
    <site name="surge_left"/><site name="surge_right"/><site name="sway"/><site name="heave"/>
  </body>)" + wall,
                          check::kWeightless);
}

VehicleParams InVacuum() {
  VehicleParams params = WithoutDamping(VehicleParams());
  params.hydrodynamics.water_density_kg_m3 = 0;
  return params;
}

// What the tolerance leaves is MuJoCo's: an impedance that grows from 0.9 to 0.95 within the first
// millimetre, and steps of a tenth of the contact's time constant. Measured: within 0.003.
TEST(Contact, ANormalImpactGivesBackItsRestitution) {
  const Scene scene =
      RoundPoleBesideAWall(R"(<geom name="dock_face" type="box" size="0.05 1 1" pos="0.2 0 -5"/>)");
  for (const double restitution : {0.05, std::exp(-2.0), 0.3, 0.5, 0.8, 0.95}) {
    VehicleParams params = InVacuum();
    params.contact.restitution = restitution;
    Plant plant(scene, params, {}, Sea());
    constexpr double kSpeed_mps = 0.1;
    plant.SetVelocity({.v = {kSpeed_mps, 0, 0}});
    Advance(plant, 2);
    EXPECT_NEAR(-plant.truth().V_WB_B.v.x() / kSpeed_mps, restitution, 0.005) << restitution;
  }
}

// Sliding along a wall it is pressed onto, the vehicle loses mu N. MuJoCo's friction pyramid makes
// it hop, so the impulses of a second are compared, each read off the momentum.
TEST(Contact, SlidingFrictionIsTheCoefficientTimesTheNormalForce) {
  const Scene scene = RoundPoleBesideAWall(
      R"(<geom name="dock_face" type="box" size="0.05 9 9" pos="0.15 0 -5"/>)");
  for (const double friction : {0.0, 0.2, 0.6}) {
    VehicleParams params = InVacuum();
    params.contact.friction = friction;
    params.hydrodynamics.added_mass_diagonal.setZero();
    params.rigid_body.inertia_kg_m2.setConstant(1e4);  // it slides and does not roll
    constexpr double kPress_newton = 5, kSlide_s = 1;
    for (const Vector3d& along : {Vector3d(0, 1, 0), Vector3d(0, 0, 1)}) {
      Plant plant(scene, params, {}, Sea());
      plant.SetVelocity({.v = along});
      plant.SetExtraWrench({.f = {kPress_newton, 0, 0}});
      Advance(plant, kSlide_s);
      const Vector3d gained = 15 * (plant.truth().V_WB_B.v - along);
      const double normal_newton_s = kPress_newton * kSlide_s - gained.x();
      EXPECT_GT(normal_newton_s, 3);
      EXPECT_NEAR(-gained.dot(along) / normal_newton_s, friction, 0.001) << friction;
    }
  }
}

TEST(Contact, PushingAgainstADockBalancesTheThrust) {
  const std::string dock =
      R"(<geom name="dock_face" type="box" size="0.05 0.5 0.5" pos="0.6 0 -5.11"/>
         <site name="dock_mouth" pos="0.55 0 -5.11"/>)";
  VehicleParams params = Neutral();
  params.hydrodynamics.p_BBcb_m.z() = 1;  // stiff in pitch: it stays square to the face
  const Scene scene = check::MakeScene(check::kVehicleBody + dock);
  Plant plant(scene, params, {}, Sea());
  plant.SetExtraWrench({.tau = {0, -0.11 * 4, 0}, .f = {4, 0, 0}});  // as if at the pole
  bool touched_before = false;
  double first_contact_s = -1;
  for (int i = 0; i < 480 * 20; ++i) {
    ASSERT_FALSE(plant.Step({}).has_value());
    const bool touches = plant.contacts().dock_force_newton > 0;
    if (touches && !touched_before) {
      touched_before = true;
      first_contact_s = plant.time_s();
    }
  }
  EXPECT_GT(first_contact_s, 0.3);  // 5 cm under 4 N on 21 kg: 0.73 s without drag
  EXPECT_LT(first_contact_s, 2);
  EXPECT_NEAR(plant.contacts().dock_force_newton, 4, 0.005 * 4);
  EXPECT_EQ(plant.contacts().collision, "");
  EXPECT_NEAR(plant.pole().insertion_depth_m, 0, 0.003);
}

}  // namespace
}  // namespace turbidock::vehicle
