#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/check/fossen_reference.h"
#include "tests/check/physics_cases.h"
#include "tests/check/simple_scene.h"

namespace turbidock::check {

using Eigen::Vector3d;
using vehicle::Dof;
using vehicle::Plant;
using vehicle::Scene;
using vehicle::Sea;
using vehicle::SeaState;
using vehicle::Vector6d;
using vehicle::VehicleParams;

namespace {

// The largest relative change of kinetic energy, momentum and angular momentum (about W's origin,
// with the entrained water) over 10 s at 1 rad/s.
struct Drift {
  double energy = 0, linear = 0, angular = 0;
};

Drift FreeMotionDrift(const ClockParams& clock) {
  VehicleParams params = Coupled(WithoutDamping(Neutral()));
  params.rigid_body.p_BBcm_m = {0.02, -0.01, -0.03};
  const vehicle::Matrix6d mass = vehicle::RigidBodyInertia(params.rigid_body) +
                                 vehicle::HydroModel(params.hydrodynamics).added_mass;
  const Scene scene = OpenWater(kWeightless);
  Plant plant(scene, params, clock, Sea());
  plant.SetVelocity({.w = Vector3d(0.5, -0.7, 0.6).normalized(), .v = {0.2, -0.1, 0.15}});

  struct Motion {
    double energy;
    Vector3d linear, angular;
  };
  const auto motion_now = [&] {
    const vehicle::VehicleTruth now = plant.truth();
    Vector6d v;
    v << now.V_WB_B.v, now.V_WB_B.w;
    const Vector6d momentum_B = mass * v;
    const Vector3d linear = now.X_WB.q * momentum_B.head<3>();
    return Motion{0.5 * v.dot(momentum_B), linear,
                  now.X_WB.q * momentum_B.tail<3>() + now.X_WB.p.cross(linear)};
  };
  const Motion start = motion_now();
  Drift drift;
  for (int i = 0; i < 100; ++i) {
    Advance(plant, 0.1);
    const Motion now = motion_now();
    const auto grow = [](double change, double whole, double* worst) {
      *worst = std::max(*worst, std::abs(change) / whole);
    };
    grow(now.energy - start.energy, start.energy, &drift.energy);
    grow((now.linear - start.linear).norm(), start.linear.norm(), &drift.linear);
    grow((now.angular - start.angular).norm(), start.angular.norm(), &drift.angular);
  }
  return drift;
}

}  // namespace

// The integrator is of first order: small at 1 ms, and half of it at half the step.
void FreeMotion(const Scene&, Report* report) {
  const Drift at_1ms = FreeMotionDrift(TicksPerTenth(100)),
              half = FreeMotionDrift(TicksPerTenth(200));
  const auto compare = [&](const std::string& what, double coarse, double fine) {
    report->AtMost("free motion, drift of " + what, "conserved; 1 ms steps, 10 s", "", coarse,
                   2e-3);
    report->Near("free motion, " + what + " at half the step", "first order", "", coarse / fine, 2,
                 0.1);
  };
  compare("kinetic energy", at_1ms.energy, half.energy);
  compare("momentum", at_1ms.linear, half.linear);
  compare("angular momentum", at_1ms.angular, half.angular);
}

// One step from rest.
void AnisotropicAddedMass(const Scene& scene, Report* report) {
  VehicleParams params = WithoutDamping(Neutral());
  Couple(Dof::kSurge, Dof::kSway, 2, &params);
  Plant plant(scene, params, kTick2ms, Sea());
  const Eigen::Quaterniond q_WB = FromYawPitchRoll(std::numbers::pi / 6, 0, 0);
  plant.Reset({q_WB, {0, 0, -5}});
  const Vector3d force_W(3, -2, 0);
  plant.SetExtraWrench({.f = q_WB.conjugate() * force_W});
  Step(plant);
  Eigen::Matrix3d mass;
  mass << 15 + 6, 2, 0, 2, 15 + 10, 0, 0, 0, 15 + 9;
  const Vector3d expected_W = q_WB * mass.inverse() * (q_WB.conjugate() * force_W);
  const vehicle::VehicleTruth now = plant.truth();
  const Vector3d got_W = now.X_WB.q * now.V_WB_B.v / kTick2ms.dt_s();
  for (const int axis : {0, 1})
    report->Near(std::string("anisotropic added mass at 30 deg, world ") + "xy"[axis],
                 "R (M + A)^-1 R^T F", "m/s^2", got_W[axis], expected_W[axis], 1e-6);
}

// A push and a twist that change every second, in a wave; an instability would be off by orders.
void HeavyAddedMass(const Scene& scene, Report* report) {
  VehicleParams params = Neutral();
  params.hydrodynamics.added_mass_diagonal << 75, 75, 75, 0.9, 1.25, 1.15;
  const Sea sea({.state = SeaState::kModerate, .random_phases = false}, SeaStream());
  const auto push = [](int second) {
    const double sign = second % 2 ? 1 : -1;
    return Wrench{.tau = {sign * 0.5, 0.3, sign}, .f = {sign * 9, 5, -sign * 5}};
  };
  constexpr int kDuration_s = 60;
  FossenReference reference(params, sea);
  reference.SetState({.eta = (Vector6d() << 0, 0, -5, 0, 0, 0).finished()});
  double expected_mps = 0, expected_rad_s = 0;
  for (int second = 0; second < kDuration_s; ++second) {
    reference.SetExtraWrench(push(second));
    for (int i = 0; i < 100; ++i) reference.Step(0.01);
    expected_mps = std::max(expected_mps, reference.state().nu.head<3>().norm());
    expected_rad_s = std::max(expected_rad_s, reference.state().nu.tail<3>().norm());
  }
  for (const int ticks_per_tenth : {100, 50, 20}) {
    Plant plant(scene, params, TicksPerTenth(ticks_per_tenth), sea);
    double speed_mps = 0, turn_rad_s = 0;
    for (int second = 0; second < kDuration_s; ++second) {
      plant.SetExtraWrench(push(second));
      Advance(plant, 1);
      speed_mps = std::max(speed_mps, plant.truth().V_WB_B.v.norm());
      turn_rad_s = std::max(turn_rad_s, plant.truth().V_WB_B.w.norm());
    }
    const std::string name =
        "added mass 5 x mass, " + std::to_string(100 / ticks_per_tenth) + " ms, ";
    report->Near(name + "top speed", "Runge-Kutta, 60 s", "m/s", speed_mps, expected_mps,
                 kHalfPercent * expected_mps);
    report->Near(name + "top turn rate", "Runge-Kutta, 60 s", "rad/s", turn_rad_s, expected_rad_s,
                 kHalfPercent * expected_rad_s);
  }
}

}  // namespace turbidock::check
