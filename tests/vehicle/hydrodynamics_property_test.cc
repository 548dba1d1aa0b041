#include <gtest/gtest.h>

#include "sim/base/random.h"
#include "sim/vehicle/hydrodynamics.h"
#include "tests/support/awkward.h"

namespace turbidock::vehicle {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d Skew(const Vector3d& a) {
  Matrix3d S;
  S << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return S;
}

Vector3d RandomVector(Rng& rng) { return {rng.Normal(), rng.Normal(), rng.Normal()}; }

HydroModel RandomModel(Rng& rng) {
  HydroModel model((HydrodynamicsParams()));
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root(i) = rng.Normal();
  model.added_mass = root * root.transpose();
  return model;
}

Vector6d Stacked(const Wrench& F) { return (Vector6d() << F.f, F.tau).finished(); }

// Sums of some fifty products of order 10: rounding.
constexpr double kRounding = 1e-12;

// Fossen (2011), eq. 6.43: C_A as a matrix, and M_A d(v_r)/dt with the derivative in rotating axes.
TEST(Hydrodynamics, InertialForcesAreFossensMatrices) {
  Rng rng = SeedTree(1).Stream("hydrodynamics");
  int checked = 0;
  for (const Pose& X_WB : testing::AwkwardPoses()) {
    const HydroModel model = RandomModel(rng);
    const Matrix6d& A = model.added_mass;
    BodyInWater body{.X_WB = X_WB};
    body.X_WB.p.z() = -5;
    body.V_WB_B = {.w = RandomVector(rng), .v = RandomVector(rng)};
    body.water_v_W = RandomVector(rng);
    body.water_a_W = RandomVector(rng);
    const Matrix3d R_BW = X_WB.R().transpose();
    Vector6d v_rel;
    v_rel << body.V_WB_B.v - R_BW * body.water_v_W, body.V_WB_B.w;

    Matrix6d C;
    const Matrix3d top = Skew(A.topRows<3>() * v_rel), bottom = Skew(A.bottomRows<3>() * v_rel);
    C << Matrix3d::Zero(), -top, -top, -bottom;
    EXPECT_LT(std::abs(v_rel.dot(C * v_rel)), 1e-10) << "skew: does no work";
    Vector6d rotating = Vector6d::Zero();
    rotating.head<3>() = R_BW * body.water_a_W + body.V_WB_B.w.cross(v_rel.head<3>());
    const Vector3d pressure =
        model.water_density_kg_m3 * model.displaced_volume_m3 * (R_BW * body.water_a_W);
    Vector6d expected = -C * v_rel + A * rotating;
    expected.head<3>() += pressure;
    expected.tail<3>() += model.p_BBcb.cross(pressure);

    const Vector6d got = Stacked(ComputeHydroWrenches(model, body).inertial);
    EXPECT_LT((got - expected).norm(), kRounding * (1 + expected.norm()) * 10);
    ++checked;
  }
  EXPECT_GT(checked, 50);
}

TEST(Hydrodynamics, WaterThatMovesWithTheVehicleIsNotFelt) {
  Rng rng = SeedTree(2).Stream("hydrodynamics");
  for (const Pose& X_WB : testing::AwkwardPoses()) {
    const HydroModel model = RandomModel(rng);
    BodyInWater body{.X_WB = X_WB};
    body.V_WB_B.v = RandomVector(rng);
    body.water_v_W = X_WB.q * body.V_WB_B.v;
    const HydroWrenches out = ComputeHydroWrenches(model, body);
    EXPECT_LT(Stacked(out.damping).norm(), kRounding);
    EXPECT_LT(Stacked(out.inertial).norm(), kRounding);
  }
}

// Turned together, vehicle and water feel the same in the vehicle's axes.
TEST(Hydrodynamics, DoesNotKnowWhereNorthIs) {
  Rng rng = SeedTree(3).Stream("hydrodynamics");
  for (const Pose& X_WB : testing::AwkwardPoses()) {
    const HydroModel model = RandomModel(rng);
    BodyInWater body;
    body.X_WB.p.z() = -5;
    body.V_WB_B = {.w = RandomVector(rng), .v = RandomVector(rng)};
    body.water_v_W = RandomVector(rng);
    body.water_a_W = RandomVector(rng);
    body.gravity_W = RandomVector(rng);
    BodyInWater turned = body;
    turned.X_WB.q = X_WB.q;
    turned.X_WB.p.z() = -5;
    turned.water_v_W = X_WB.q * body.water_v_W;
    turned.water_a_W = X_WB.q * body.water_a_W;
    turned.gravity_W = X_WB.q * body.gravity_W;
    const HydroWrenches a = ComputeHydroWrenches(model, body);
    const HydroWrenches b = ComputeHydroWrenches(model, turned);
    EXPECT_LT((Stacked(a.damping) - Stacked(b.damping)).norm(), 1e-10);
    EXPECT_LT((Stacked(a.buoyancy) - Stacked(b.buoyancy)).norm(), 1e-10);
    EXPECT_LT((Stacked(a.inertial) - Stacked(b.inertial)).norm(), 1e-10);
  }
}

TEST(Hydrodynamics, AcceptedDampingNeverDrives) {
  HydrodynamicsParams params;
  params.linear_damping_coupling = {{Dof::kSurge, Dof::kSway, 10}, {Dof::kYaw, Dof::kSway, 0.5}};
  params.quadratic_damping_coupling = {{Dof::kPitch, Dof::kSurge, 55 * 0.05},
                                       {Dof::kSurge, Dof::kPitch, -0.02}};
  ASSERT_NO_THROW(CheckFields(params, ""));
  const HydroModel model(params);
  Rng rng = SeedTree(4).Stream("hydrodynamics");
  for (int i = 0; i < 2000; ++i) {
    BodyInWater body;
    body.V_WB_B = {.w = std::exp(3 * rng.Normal()) * RandomVector(rng), .v = RandomVector(rng)};
    const HydroWrenches out = ComputeHydroWrenches(model, body);
    EXPECT_LE(Stacked(out.damping).dot(out.v_rel_B), 0);
  }
}

}  // namespace
}  // namespace turbidock::vehicle
