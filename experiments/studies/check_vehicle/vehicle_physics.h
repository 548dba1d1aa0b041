#pragma once
// What follows from a vehicle's data without a trial: how it floats and how fast it gets.
// Deep in still water.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "control/vehicle_model.h"
#include "sim/base/result_fields.h"
#include "sim/vehicle/hydrodynamics.h"
#include "sim/vehicle/scene.h"
#include "sim/vehicle/vehicle_params.h"

namespace turbidock::check_vehicle {

// At rest in the water, thrusters off.
struct Floating {
  double buoyancy_newton = 0;  // less the weight
  // In which it comes to rest: positive roll lifts the left side, positive pitch lowers the bow.
  double roll_rad = 0, pitch_rad = 0;
  // Moment that rights it, per radian away from there; about the centre of mass.
  double righting_newton_m = 0;

  TURBIDOCK_FIELDS(buoyancy_newton, roll_rad, pitch_rad, righting_newton_m)
};
Floating FloatingOf(const vehicle::VehicleData& data, double gravity_mps2);

// Force or moment along an axis at rest when the thrusters are commanded these volts, N or N m.
double ForceAlong(control::Axis axis, const vehicle::VehicleData& data,
                  const std::vector<vehicle::ThrusterInScene>& thrusters,
                  const ThrusterCommand& command);

// How it goes in the end when the thrusters are commanded these volts: steady velocity and tilt at
// which weight, buoyancy, drag, Coriolis forces and the thrust that the inflow leaves add up to
// nothing. Its buoyancy is trimmed away.
struct SteadyMotion {
  Twist V_WB_B;  // w along z only
  double roll_rad = 0, pitch_rad = 0;

  double on(control::Axis axis) const {
    return axis == control::kYaw ? V_WB_B.w.z() : V_WB_B.v[axis];
  }
};
// With the thrusters driven along one axis: from the speed at which that axis alone is in balance,
// by Newton's method; that speed where there is no such motion near by.
SteadyMotion SteadyMotionOf(const vehicle::VehicleData& data,
                            const std::vector<vehicle::ThrusterInScene>& thrusters,
                            const ThrusterCommand& command, control::Axis axis,
                            double gravity_mps2);

}  // namespace turbidock::check_vehicle
