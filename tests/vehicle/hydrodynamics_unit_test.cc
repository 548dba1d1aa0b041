#include "sim/vehicle/hydrodynamics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sim/vehicle/vehicle_params.h"

namespace turbidock::vehicle {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

std::string Refusal(const VehicleParams& params) {
  try {
    CheckFields(params, "vehicle");
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(VehicleParams, DefaultsAreValid) { EXPECT_EQ(Refusal({}), "accepted"); }

TEST(VehicleParams, WrongSignsAreRefusedWithTheKey) {
  VehicleParams params;
  params.rigid_body.mass_kg = -15;
  EXPECT_THAT(Refusal(params), HasSubstr("vehicle.rigid_body.mass_kg: -15 must be > 0"));
  params = {};
  params.hydrodynamics.added_mass_diagonal[2] = -9;
  EXPECT_THAT(Refusal(params), HasSubstr("vehicle.hydrodynamics.added_mass_diagonal: -9"));
  params = {};
  params.hydrodynamics.linear_damping_diagonal[5] = -0.07;
  EXPECT_THAT(Refusal(params), HasSubstr("linear_damping_diagonal: -0.07"));
  params = {};
  params.hydrodynamics.quadratic_damping_diagonal[0] = -55;
  EXPECT_THAT(Refusal(params), HasSubstr("quadratic_damping_diagonal: -55"));
  params = {};
  params.loads.push_back({.mass_kg = -1});
  EXPECT_THAT(Refusal(params), HasSubstr("vehicle.loads[0].mass_kg"));
}

TEST(VehicleParams, ImpossibleInertiasAreRefused) {
  VehicleParams params;
  params.rigid_body.inertia_kg_m2 = {0.1, 0.1, 0.3};  // no body: 0.3 > 0.1 + 0.1
  EXPECT_THAT(Refusal(params), HasSubstr("no body has that"));
  params.rigid_body.inertia_kg_m2 = {0.1, 0.1, 0.2};  // a plate
  EXPECT_EQ(Refusal(params), "accepted");
  params.rigid_body.inertia_kg_m2 = {0.2, 0.2, 0.2};
  params.rigid_body.inertia_products_kg_m2 = {0.25, 0, 0};
  EXPECT_THAT(Refusal(params), HasSubstr("positive definiteness"));
}

TEST(VehicleParams, AsymmetricAddedMassIsRefused) {
  VehicleParams params;
  auto& coupling = params.hydrodynamics.added_mass_coupling;
  coupling = {{Dof::kSway, Dof::kRoll, 0.2}};
  EXPECT_THAT(Refusal(params), HasSubstr("roll-sway is 0 but sway-roll is 0.2"));
  coupling.push_back({Dof::kRoll, Dof::kSway, 0.2});
  EXPECT_EQ(Refusal(params), "accepted");
  coupling.push_back({Dof::kRoll, Dof::kSway, 0.2});
  EXPECT_THAT(Refusal(params), HasSubstr("coupling[2]: gives the same element as entry 1"));
  coupling = {{Dof::kSway, Dof::kSway, 0.2}};
  EXPECT_THAT(Refusal(params), HasSubstr("on the diagonal"));
}

TEST(VehicleParams, IndefiniteTotalInertiaIsRefused) {
  VehicleParams params;
  // Roll has 0.18 + 0.03, sway 15 + 10: their coupling must stay below sqrt(0.21 * 25) = 2.29.
  for (const auto& [value, verdict] :
       {std::pair{2.2, "accepted"}, {2.4, "not positive definite"}}) {
    params.hydrodynamics.added_mass_coupling = {{Dof::kSway, Dof::kRoll, value},
                                                {Dof::kRoll, Dof::kSway, value}};
    EXPECT_THAT(Refusal(params), HasSubstr(verdict)) << value;
  }
}

TEST(VehicleParams, DampingThatCouldDriveTheVehicleIsRefused) {
  VehicleParams params;
  auto& hydro = params.hydrodynamics;
  hydro.linear_damping_diagonal << 5, 6, 8, 0.1, 0.15, 0.07;
  hydro.linear_damping_coupling = {
      {Dof::kSurge, Dof::kSway, 12}};  // symmetric part 6 > sqrt(5 * 6)
  EXPECT_THAT(Refusal(params), HasSubstr("linear_damping_coupling"));
  hydro.linear_damping_coupling[0].value = 10;
  EXPECT_EQ(Refusal(params), "accepted");
  // Drag that acts 5 cm off the origin is sound, a metre off it is not.
  hydro.quadratic_damping_coupling = {{Dof::kPitch, Dof::kSurge, 55 * 0.05}};
  EXPECT_EQ(Refusal(params), "accepted");
  hydro.quadratic_damping_coupling[0].value = 55;
  EXPECT_THAT(Refusal(params), HasSubstr("quadratic_damping_coupling"));
}

TEST(VehicleParams, LoadsMoveMassVolumeAndCentres) {
  VehicleParams params;
  params.loads = {{.mass_kg = 5, .volume_m3 = 0, .p_BQ_m = {0.4, 0, 0}},
                  {.mass_kg = 0, .volume_m3 = 0.014654, .p_BQ_m = {0, 0, 0.13}}};
  const RigidBodyParams body = params.LoadedRigidBody();
  EXPECT_DOUBLE_EQ(body.mass_kg, 20);
  EXPECT_DOUBLE_EQ(body.p_BBcm_m.x(), 0.1);
  EXPECT_DOUBLE_EQ(body.inertia_kg_m2.x(), 0.18);
  // 15 kg at 0.1 m and 5 kg at 0.3 m.
  EXPECT_NEAR(body.inertia_kg_m2.y(), 0.25 + 15 * 0.01 + 5 * 0.09, 1e-12);
  const HydrodynamicsParams water = params.LoadedHydrodynamics();
  EXPECT_DOUBLE_EQ(water.displaced_volume_m3, 2 * 0.014654);
  EXPECT_NEAR(water.p_BBcb_m.z(), 0.08, 1e-12);
}

TEST(Buoyancy, FallsWithTheSubmergedHeightAndHasThatPotential) {
  EXPECT_EQ(SubmergedFraction(-0.2, 0.3), 1);
  EXPECT_EQ(SubmergedFraction(0, 0.3), 0.5);
  EXPECT_EQ(SubmergedFraction(0.2, 0.3), 0);
  const HydroModel model((HydrodynamicsParams()));
  const double full_newton = 1025 * 0.014654 * 9.81;
  constexpr double kStep_m = 1e-4;
  for (int i = -8; i <= 8; ++i) {
    const double z_m = 0.05 * i;
    const double slope = (BuoyancyPotential(model, Pose::Translation(0, 0, z_m + kStep_m), 9.81) -
                          BuoyancyPotential(model, Pose::Translation(0, 0, z_m - kStep_m), 9.81)) /
                         (2 * kStep_m);
    // The potential is quadratic in parts: central differences are exact but at the two joints.
    EXPECT_NEAR(-slope, full_newton * SubmergedFraction(z_m + 0.03, 0.31), full_newton * 1e-4);
  }
  // and in one piece: what it gains from the deep to half out of the water, and to the air
  const auto potential = [&](double z_m) {
    return BuoyancyPotential(model, Pose::Translation(0, 0, z_m - 0.03), 9.81);
  };
  EXPECT_NEAR(potential(-1) - potential(0), full_newton * (1 - 0.31 / 8), 1e-9);
  EXPECT_NEAR(potential(-1) - potential(1), full_newton, 1e-9);
}

// A hull that pierces the surface loses the buoyancy of what is out of the water, and the waves'
// push on it, and its moment.
TEST(Buoyancy, IsThatOfTheHullsSubmergedPart) {
  HydrodynamicsParams params;
  params.hull_height_m = 0.4;
  params.p_BBcb_m = {0.1, 0, 0.05};
  const HydroModel model(params);
  const double full_newton = params.water_density_kg_m3 * params.displaced_volume_m3 * 9.81;
  for (const auto& [z_m, share] : {std::pair(-1.0, 1.0),
                                   {-0.25, 1.0},
                                   {-0.15, 0.75},
                                   {-0.05, 0.5},
                                   {0.05, 0.25},
                                   {0.2, 0.0}}) {
    BodyInWater body;
    body.X_WB = Pose::Translation(0, 0, z_m);
    body.gravity_W = {0, 0, -9.81};
    body.water_a_W = {0.3, 0, 0};
    const HydroWrenches out = ComputeHydroWrenches(model, body);
    EXPECT_NEAR(out.buoyancy.f.z(), share * full_newton, 1e-9) << z_m;
    EXPECT_NEAR(out.buoyancy.tau.y(), -0.1 * share * full_newton, 1e-9) << z_m;
    const double added_kg = model.added_mass(0, 0);
    EXPECT_NEAR(out.inertial.f.x(), (added_kg + share * full_newton / 9.81) * 0.3, 1e-9) << z_m;
  }
}

TEST(Damping, FollowsThePublishedFormPerAxis) {
  HydrodynamicsParams params;
  params.linear_damping_diagonal << 5, 6, 8, 0.1, 0.15, 0.07;
  params.quadratic_damping_diagonal << 55, 90, 70, 0.1, 0.15, 0.2;
  params.quadratic_damping_coupling = {{Dof::kPitch, Dof::kSurge, 2.0}};
  const HydroModel model(params);
  BodyInWater body;
  body.V_WB_B = {.w = {0, 0, -0.5}, .v = {0.3, -0.2, 0}};
  const HydroWrenches out = ComputeHydroWrenches(model, body);
  EXPECT_DOUBLE_EQ(out.damping.f.x(), -(5 * 0.3 + 55 * 0.09));
  EXPECT_DOUBLE_EQ(out.damping.f.y(), 6 * 0.2 + 90 * 0.04);
  EXPECT_DOUBLE_EQ(out.damping.tau.z(), 0.07 * 0.5 + 0.2 * 0.25);
  EXPECT_DOUBLE_EQ(out.damping.tau.y(), -2.0 * 0.09);
}

}  // namespace
}  // namespace turbidock::vehicle
