#pragma once
// A second formulation of the vehicle's dynamics, to check the plant against: Fossen's vector form
// (2011, eq. 6.42 and 6.91) in Euler angles, integrated by the classical Runge-Kutta method. Shares
// the parameters and the sea with the plant, and no equation of motion.

#include "sim/vehicle/hydrodynamics.h"
#include "sim/vehicle/sea.h"
#include "sim/vehicle/vehicle_params.h"

namespace turbidock::check {

inline constexpr double kGravity_mps2 = 9.81;

// Free motion only: no contacts, thrusters, tether, loads or coupled damping, fully submerged. Not
// for a pitch near 90 degrees.
class FossenReference {
 public:
  struct State {
    vehicle::Vector6d eta =
        vehicle::Vector6d::Zero();  // x, y, z of B in W [m]; roll, pitch, yaw (z-y-x)
    vehicle::Vector6d nu = vehicle::Vector6d::Zero();  // velocity in B, SNAME order
  };

  FossenReference(const vehicle::VehicleParams& params, const vehicle::Sea& sea);

  // A constant wrench at B's origin, in B, until changed.
  void SetExtraWrench(const Wrench& F_B_B);

  void SetState(const State& state) { state_ = state; }
  const State& state() const { return state_; }
  Pose X_WB() const;

  void Step(double dt_s);

 private:
  State Rate(double time_s, const State& state) const;

  vehicle::Matrix6d rigid_, added_, inverse_;
  vehicle::VehicleParams params_;
  vehicle::Sea sea_;
  vehicle::Vector6d tau_ = vehicle::Vector6d::Zero();
  double time_s_ = 0;
  State state_;
};

}  // namespace turbidock::check
