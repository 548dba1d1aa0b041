#pragma once
// What the cases of physics_checks.cc share: what they find, and the vehicles that they find it
// with.

#include <cmath>
#include <string>
#include <vector>

#include "sim/vehicle/plant.h"
#include "tests/check/physics_checks.h"
#include "tests/check/simple_scene.h"

namespace turbidock::check {

inline constexpr double kHalfPercent = 0.005;
inline constexpr ClockParams kTick2ms = TicksPerTenth(50);

inline Rng SeaStream() { return SeedTree(1).Stream("sea"); }

// What a case has found.
struct Report {
  void Near(const std::string& name, const std::string& reference, const std::string& unit,
            double measured, double expected, double tolerance) {
    checks.push_back({name, reference, unit, measured, Relation::kNear, expected, tolerance});
  }
  void AtMost(const std::string& name, const std::string& reference, const std::string& unit,
              double measured, double limit) {
    checks.push_back({name, reference, unit, measured, Relation::kAtMost, limit, 0});
  }
  std::vector<PhysicsCheck> checks;
};

// Neutrally buoyant, so that only what a case is about moves the vehicle.
inline vehicle::VehicleParams Neutral() {
  vehicle::VehicleParams params;
  params.hydrodynamics.displaced_volume_m3 =
      params.rigid_body.mass_kg / params.hydrodynamics.water_density_kg_m3;
  return params;
}

inline vehicle::VehicleParams WithoutDamping(vehicle::VehicleParams params) {
  params.hydrodynamics.linear_damping_diagonal.setZero();
  params.hydrodynamics.quadratic_damping_diagonal.setZero();
  return params;
}

inline void Couple(vehicle::Dof a, vehicle::Dof b, double value, vehicle::VehicleParams* params) {
  params->hydrodynamics.added_mass_coupling.push_back({a, b, value});
  params->hydrodynamics.added_mass_coupling.push_back({b, a, value});
}

// Added mass with every kind of coupling, positive definite by a wide margin.
inline vehicle::VehicleParams Coupled(vehicle::VehicleParams params) {
  Couple(vehicle::Dof::kSurge, vehicle::Dof::kSway, 1.5, &params);
  Couple(vehicle::Dof::kSway, vehicle::Dof::kHeave, -0.8, &params);
  Couple(vehicle::Dof::kSway, vehicle::Dof::kRoll, 0.3, &params);
  Couple(vehicle::Dof::kSway, vehicle::Dof::kYaw, 0.25, &params);
  Couple(vehicle::Dof::kHeave, vehicle::Dof::kPitch, -0.2, &params);
  Couple(vehicle::Dof::kRoll, vehicle::Dof::kYaw, 0.01, &params);
  return params;
}

inline void Step(vehicle::Plant& plant, const ThrusterCommand& command = {}) {
  if (const auto fault = plant.Step(command)) throw SimulatorFault(*fault);
}

inline void Advance(vehicle::Plant& plant, double seconds, const ThrusterCommand& command = {}) {
  const int64_t ticks = std::llround(seconds / plant.model().opt.timestep);
  for (int64_t i = 0; i < ticks; ++i) Step(plant, command);
}

// Inertia (inertia_checks.cc).
void FreeMotion(const vehicle::Scene& scene, Report* report);
void AnisotropicAddedMass(const vehicle::Scene& scene, Report* report);
void HeavyAddedMass(const vehicle::Scene& scene, Report* report);

}  // namespace turbidock::check
