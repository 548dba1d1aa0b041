// The plant against MuJoCo's own step, and against itself by other routes.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "sim/vehicle/plant.h"
#include "tests/check/simple_scene.h"

namespace turbidock::vehicle {
namespace {

using Eigen::Vector3d;

VehicleParams InVacuum() {
  VehicleParams params;
  auto& hydro = params.hydrodynamics;
  hydro.water_density_kg_m3 = 0;
  hydro.added_mass_diagonal.setZero();
  hydro.linear_damping_diagonal.setZero();
  hydro.quadratic_damping_diagonal.setZero();
  return params;
}

// Falls onto an inclined plate and a box, tumbles and comes to rest: contacts, friction, warm
// starts.
TEST(PlantAndMujoco, WithoutWaterTheStepIsMujocosBitForBit) {
  const Scene scene =
      check::MakeScene(std::string(check::kVehicleBody) +
                       R"(<geom name="plate" type="box" size="2 2 0.1" pos="0 0 -6" euler="12 7 0"/>
         <geom name="box" type="box" size="0.3 0.2 0.2" pos="0.4 0.1 -5.7"/>)");
  Plant plant(scene, InVacuum(), check::TicksPerTenth(50), Sea());
  plant.Reset({FromYawPitchRoll(0.3, 0.2, -0.1), {0, 0, -5}});

  // MuJoCo alone, on the model as the plant prepared it.
  const MjModelPtr model(mj_copyModel(nullptr, &plant.model()));
  const MjDataPtr data(mj_makeData(model.get()));
  std::memcpy(data->qpos, plant.data().qpos, sizeof(mjtNum) * model->nq);
  const ThrusterCommand command{.volts = {4, 3.5, 1, 4.5}};
  int ticks_in_contact = 0;
  for (int i = 0; i < 1500; ++i) {
    ASSERT_FALSE(plant.Step(command).has_value());
    const ThrusterForces thrust = plant.truth().thrust_newton;
    for (size_t k = 0; k < thrust.size(); ++k) data->ctrl[k] = thrust[k];
    mj_step(model.get(), data.get());
    ticks_in_contact += plant.contacts().collision_force_newton > 0;
    // MuJoCo normalises the quaternion when the next step begins, the plant when this one ends.
    std::vector<mjtNum> qpos(data->qpos, data->qpos + model->nq);
    mj_normalizeQuat(model.get(), qpos.data());
    ASSERT_EQ(std::memcmp(qpos.data(), plant.data().qpos, sizeof(mjtNum) * model->nq), 0) << i;
    ASSERT_EQ(std::memcmp(data->qvel, plant.data().qvel, sizeof(mjtNum) * model->nv), 0) << i;
  }
  EXPECT_GT(ticks_in_contact, 100);
}

// Isotropic added mass without weight is a heavier body; both through the whole step.
TEST(PlantAndMujoco, IsotropicAddedMassIsAHeavierBody) {
  VehicleParams added = InVacuum(), heavy = InVacuum();
  added.hydrodynamics.added_mass_diagonal << 10, 10, 10, 0.05, 0.02, 0.04;
  heavy.rigid_body.mass_kg += 10;
  heavy.rigid_body.inertia_kg_m2 += Vector3d(0.05, 0.02, 0.04);
  const Scene scene = check::MakeScene(
      std::string(check::kVehicleBody) +
          R"(<geom name="wall" type="box" size="0.1 3 3" pos="1.2 0 -5" euler="0 0 20"/>)",
      check::kWeightless);
  Plant a(scene, added, check::TicksPerTenth(50), Sea()),
      b(scene, heavy, check::TicksPerTenth(50), Sea());
  double largest_force = 0;
  for (Plant* plant : {&a, &b}) {
    plant->SetVelocity({.w = {0.4, -0.3, 0.5}, .v = {0.5, 0.1, 0}});
    plant->SetExtraWrench({.tau = {0.05, 0.02, -0.03}, .f = {2, 0.5, -0.2}});
  }
  for (int i = 0; i < 1500; ++i) {
    ASSERT_FALSE(a.Step({}).has_value());
    ASSERT_FALSE(b.Step({}).has_value());
    largest_force = std::max(largest_force, a.contacts().collision_force_newton);
    // Rounding, amplified while bouncing and sliding.
    ASSERT_LT((a.truth().X_WB.p - b.truth().X_WB.p).norm(), 1e-8) << i;
    ASSERT_LT(AngleBetween(a.truth().X_WB.q, b.truth().X_WB.q), 1e-7) << i;
  }
  EXPECT_GT(largest_force, 5) << "the wall was to be hit";
}

// The inertia that MuJoCo uses is the one of the parameters, off the diagonal too.
TEST(PlantAndMujoco, InertiaMatrixHoldsTheCoupledAddedMass) {
  VehicleParams params;
  params.rigid_body.p_BBcm_m = {0.02, -0.03, 0.04};
  params.hydrodynamics.added_mass_coupling = {{Dof::kSway, Dof::kRoll, 0.3},
                                              {Dof::kRoll, Dof::kSway, 0.3},
                                              {Dof::kSurge, Dof::kHeave, -1},
                                              {Dof::kHeave, Dof::kSurge, -1}};
  const Scene scene = check::OpenWater();
  Plant plant(scene, params, {}, Sea());
  const Eigen::Quaterniond q_WB = FromYawPitchRoll(0.5, -0.4, 1.1);
  plant.Reset({q_WB, {0, 0, -5}});
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> M;
  mj_fullM(&plant.model(), M.data(), plant.data().qM);
  Matrix6d turn = Matrix6d::Identity();
  turn.topLeftCorner<3, 3>() = q_WB.toRotationMatrix().transpose();
  const Matrix6d expected =
      turn.transpose() *
      (RigidBodyInertia(params.rigid_body) + HydroModel(params.hydrodynamics).added_mass) * turn;
  EXPECT_LT((M - expected).norm(), 1e-12 * expected.norm());
}

// Water at rest seen from a steadily moving frame is a uniform current: Galileo.
TEST(Plant, ACurrentIsStillWaterSeenFromAMovingFrame) {
  VehicleParams params;
  params.hydrodynamics.displaced_volume_m3 = 15.0 / 1025;
  const Vector3d current(0.2, -0.1, 0);
  SeaParams sea;
  sea.current.surface_velocity_mps = current;
  const Scene scene = check::OpenWater();
  Plant moving(scene, params, {}, Sea(sea, SeedTree(1).Stream("sea")));
  Plant still(scene, params, {}, Sea());
  const Pose start{FromYawPitchRoll(0.4, 0.3, -0.2), {0, 0, -5}};
  moving.Reset(start);
  still.Reset(start);
  moving.SetVelocity({.w = {0.3, 0.1, -0.4}, .v = {0, 0, 0}});
  still.SetVelocity({.w = {0.3, 0.1, -0.4}, .v = -(start.q.conjugate() * current)});
  for (int i = 1; i <= 480 * 5; ++i) {
    ASSERT_FALSE(moving.Step({}).has_value());
    ASSERT_FALSE(still.Step({}).has_value());
    const Vector3d seen = still.truth().X_WB.p + current * (i / 480.0);
    ASSERT_LT((moving.truth().X_WB.p - seen).norm(), 1e-10) << i;
  }
  EXPECT_GT((moving.truth().X_WB.p - start.p).norm(), 0.3);
}

// Drag alone: all kinetic energy that is lost went there.
TEST(Energy, CoastingDownLosesItToDrag) {
  VehicleParams params;
  params.hydrodynamics.displaced_volume_m3 = 15.0 / 1025;
  const Scene scene = check::OpenWater();
  Plant plant(scene, params, {}, Sea());
  plant.SetVelocity({.w = {0, 0, 0.5}, .v = {0.5, 0, 0}});
  for (int i = 0; i < 480 * 10; ++i) ASSERT_FALSE(plant.Step({}).has_value());
  const EnergyBalance e = plant.energy();
  EXPECT_LT(e.kinetic_change, -2.5);
  EXPECT_NEAR(e.drag_loss, -e.kinetic_change - e.potential_change, 0.002 * e.drag_loss);
  EXPECT_NEAR(e.water_work, 0, 0.002 * e.drag_loss);
}

}  // namespace
}  // namespace turbidock::vehicle
