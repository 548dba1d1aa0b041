#include "experiments/trial/known_vehicle.h"

#include <algorithm>

namespace turbidock::trial {

control::VehicleModel ModelOf(const vehicle::VehicleData& known, const vehicle::Scene& scene) {
  using vehicle::Dof;
  const auto axes = [](const vehicle::Vector6d& all) -> control::Axes {
    return {all[static_cast<int>(Dof::kSurge)], all[static_cast<int>(Dof::kSway)],
            all[static_cast<int>(Dof::kHeave)], all[static_cast<int>(Dof::kYaw)]};
  };
  const vehicle::HydroModel hydro(known.LoadedHydrodynamics());
  const vehicle::Matrix6d mass =
      vehicle::RigidBodyInertia(known.LoadedRigidBody()) + hydro.added_mass;
  control::VehicleModel model;
  model.inertia = axes(mass.diagonal());
  model.roll_pitch_inertia = {mass.diagonal()[static_cast<int>(Dof::kRoll)],
                              mass.diagonal()[static_cast<int>(Dof::kPitch)]};
  model.linear_damping = axes(hydro.linear_damping.diagonal());
  model.quadratic_damping = axes(hydro.quadratic_damping.diagonal());
  model.thruster_lag_s = 0;
  model.head_ahead_m = scene.X_BH.p.x();
  const std::vector<std::string> names = NamesOf(scene.thrusters);
  const auto kinds = known.thrusters.Of(names, "known_vehicle.thrusters");
  const PerThruster effectiveness = known.thrusters.Effectiveness(names.size());
  for (size_t i = 0; i < names.size(); ++i) {
    model.thrusters.push_back({.name = names[i],
                               .p_BT = scene.thrusters[i].p_BT,
                               .axis_B = scene.thrusters[i].axis_B,
                               .curve = kinds[i],
                               .effectiveness = effectiveness[i]});
    model.thruster_lag_s = std::max(model.thruster_lag_s, kinds[i].lag_s);
  }
  return model;
}

control::VehicleModel ModelOf(const Scenario& scenario) {
  return ModelOf(scenario.known_vehicle, vehicle::LoadScene(SceneFilesOf(scenario), scenario.rig));
}

}  // namespace turbidock::trial
