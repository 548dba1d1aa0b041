#pragma once
// The vehicle in the water: MuJoCo's multibody dynamics and contacts with our own hydrodynamics.

#include <cstdint>
#include <optional>
#include <string>

#include "sim/base/clock.h"
#include "sim/base/pose.h"
#include "sim/base/random.h"
#include "sim/scene.h"
#include "sim/sea.h"
#include "sim/thrusters.h"
#include "sim/vehicle_params.h"

namespace turbidock::sim {

// The vehicle's true state, for the simulation and its records only; vision and control never see it.
struct VehicleTruth {
  int64_t tick = 0;
  Pose X_WB;
  Twist V_WB_B;  // of B in W, expressed in B
  ThrusterForces thrust_newton{};
};

// What touches what. Forces are the sum over the contacts of the last tick.
struct ContactReport {
  double dock_force_newton = 0;       // pole against the dock's lead-in and throat: wanted
  double collision_force_newton = 0;  // anything else between the vehicle and the rest
  std::string collision;              // "hull_front against station_plate", empty if none
};

// Where the pole's tip is relative to the dock.
struct PoleInDock {
  Eigen::Vector3d p_DQ;         // tip in the dock's frame (mouth)
  double insertion_depth_m = 0; // past the mouth plane; negative in front of it
  bool inserted = false;        // tip inside the straight hole, past its beginning
};

class Plant {
 public:
  // Keeps a reference to `scene` (which must outlive it) and works on its own mjData. The parameters
  // are checked (ConfigError).
  Plant(const Scene& scene, const VehicleParams& params, const ClockParams& clock, const Sea& sea);

  // At rest in the world at X_WB, thrusters off, tick 0.
  void Reset(const Pose& X_WB);

  // Advances one tick under a constant command. Returns why the state is no longer usable (not finite,
  // MuJoCo warning), or nothing when all is well.
  std::optional<std::string> Step(const ThrusterCommand& command);

  VehicleTruth truth() const;
  ContactReport contacts() const;
  PoleInDock pole() const;
  const mjModel& model() const { return *model_; }
  const mjData& data() const { return *data_; }  // for rendering: positions of the current state
};

}  // namespace turbidock::sim
