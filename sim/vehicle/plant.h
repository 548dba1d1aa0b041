#pragma once
// The vehicle in the water: MuJoCo's multibody dynamics and contacts with our own hydrodynamics.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/base/clock.h"
#include "sim/base/pose.h"
#include "sim/base/thruster_command.h"
#include "sim/vehicle/energy_balance.h"
#include "sim/vehicle/hydrodynamics.h"
#include "sim/vehicle/mooring.h"
#include "sim/vehicle/scene.h"
#include "sim/vehicle/sea.h"
#include "sim/vehicle/thruster_fault.h"
#include "sim/vehicle/thrusters.h"
#include "sim/vehicle/vehicle_params.h"

namespace turbidock::vehicle {

// The vehicle's true state, for the simulation and its records only; vision and control never see
// it.
struct VehicleTruth {
  int64_t tick = 0;
  Pose X_WB;
  Twist V_WB_B;  // of B in W, expressed in B
  ThrusterForces thrust_newton;
};

// What touches what. Forces are the sum of the contacts' magnitudes in the last tick.
struct ContactReport {
  double dock_force_newton = 0;       // pole against the dock's lead-in and throat: wanted
  double collision_force_newton = 0;  // anything else between the vehicle and the rest
  std::string collision;  // the strongest of these: "hull_front against station_plate", or empty
};

// Where the pole's tip is relative to the dock.
struct PoleInDock {
  Eigen::Vector3d p_DQ = Eigen::Vector3d::Zero();  // tip in the dock's frame (mouth)
  double insertion_depth_m = 0;                    // past the mouth plane; negative in front of it
  bool inserted = false;  // tip inside the straight hole, past its beginning
};

// One vehicle in one scene. The step is semi-implicit Euler with the added mass in MuJoCo's inertia
// matrix, so that contacts feel it too and any ratio of added to rigid mass is stable; all other
// forces of the water are explicit and constant over the tick. No callbacks: several plants may run
// side by side.
class Plant {
 public:
  // Keeps a reference to `scene` (which must outlive it) and works on its own copy of the model.
  // The parameters are checked (ConfigError). The mass and inertia of the vehicle's body and of
  // whatever is fixed to it give way to the parameters', and so do friction and bounce of pole and
  // dock (against anything else MuJoCo takes the larger friction and the mean bounce). A scene
  // without thrusters, dock or pole is allowed. The station moves as `station.mooring` says, for
  // which the scene must have the joints (ConfigError).
  Plant(const Scene& scene, const VehicleParams& params, const ClockParams& clock, const Sea& sea,
        const Mooring& mooring = {});

  // At rest in the world at X_WB, thrusters off, the sea as it was given. Time begins with `tick`,
  // which tells waves and a measured current where they are.
  void Reset(const Pose& X_WB, int64_t tick = 0);

  // Puts the vehicle elsewhere at once, at rest; time, thrusters and sea go on.
  void MoveTo(const Pose& X_WB);

  // Gives the vehicle a velocity at the present instant, for tests and canned states; the energy
  // balance starts anew.
  void SetVelocity(const Twist& V_WB_B);

  // A constant wrench on the vehicle at B's origin, in B, besides all others, until changed or
  // Reset.
  void SetExtraWrench(const Wrench& F_B_B) { extra_F_B_ = F_B_B; }

  // The sea becomes this one (Sea::Become), until Reset.
  void SetSea(const SeaParams& params) { sea_.Become(params); }

  // What will be wrong with the thrusters, and when; also after Reset. ConfigError below `path` for
  // a thruster that the vehicle does not have.
  void SetThrusterFaults(const std::vector<ThrusterFault>& faults, const std::string& path) {
    thruster_faults_ = Numbered(faults, NamesOf(scene_.thrusters), path);
  }

  // Advances one tick under a constant command for each of the scene's thrusters. Returns why the
  // state is no longer usable (not finite, MuJoCo warning), or nothing when all is well. After a
  // failure only Reset helps.
  std::optional<std::string> Step(const ThrusterCommand& command);

  int64_t tick() const { return tick_; }
  double time_s() const { return clock_.TimeOfTick(tick_); }
  VehicleTruth truth() const;
  ContactReport contacts() const;
  PoleInDock pole() const;
  Pose X_WM() const { return SitePose(*data_, scene_.marker_site); }  // the marker, now
  const Mooring& mooring() const { return mooring_; }
  EnergyBalance energy() const;
  WaterMotion water() const;  // at the centre of buoyancy, now
  // How far the current has carried the water at the marker's depth (Sea::Drift).
  Eigen::Vector3d water_drift_m() const { return sea_.Drift(X_WM().p); }
  const mjModel& model() const { return *model_; }
  const mjData& data() const { return *data_; }  // for rendering: positions of the current state

 private:
  void CheckModel() const;
  void CheckMooredBody() const;
  void HoldMooredBody();
  void MoveMooredBody();
  void OverwriteRigidBody();
  void WeighConstraints();
  void OverwriteContacts(const ContactParams& contact);
  void AddAddedMass();
  void UpdatePositions();
  PerThruster ThrusterInflow(const Eigen::Vector3d& water_v_W) const;
  BodyInWater CurrentBody(const WaterMotion& water) const;
  void SumContacts();
  void AddWork(const Twist& V_before, const HydroWrenches& hydro, const Wrench& tether_F_B,
               const Eigen::Vector3d& water_v_W);
  double KineticEnergy() const;
  double PotentialEnergy() const;
  void StartEnergyBalance();
  std::optional<std::string> Fault() const;

  const Scene& scene_;
  ClockParams clock_;
  RigidBodyParams body_;  // with loads
  HydroModel hydro_;      // with loads
  Matrix6d total_mass_;   // rigid and added, about B's origin, SNAME order
  Sea initial_sea_, sea_;
  Mooring initial_mooring_, mooring_;
  Thrusters thrusters_;
  std::vector<NumberedThrusterFault> thruster_faults_;
  MjModelPtr model_;
  MjDataPtr data_;
  int qpos_adr_ = 0, dof_adr_ = 0;  // of the vehicle's free joint

  int64_t tick_ = 0;
  Wrench extra_F_B_;
  EnergyBalance work_;  // its work terms
  double kinetic_start_joule_ = 0, potential_start_joule_ = 0;
  double dock_force_newton_ = 0, collision_force_newton_ = 0;
  int collision_geom_a_ = -1, collision_geom_b_ = -1;
};

}  // namespace turbidock::vehicle
