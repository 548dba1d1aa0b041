#pragma once
// From what a controller asks for on each axis to a voltage for each thruster.

#include <Eigen/Core>
#include <array>

#include "control/axes.h"
#include "control/axis_volts.h"
#include "control/levelling.h"
#include "control/vehicle_model.h"
#include "sim/base/fields.h"
#include "sim/base/thruster_command.h"

namespace turbidock::control {

// What the thrusters are given, and what that is of the demand.
struct Allocated {
  Axes given = Axes::Zero();
  ThrusterCommand command;
};

// A demand on the four axes shared out to the thrusters. Its unit is the controller's: forces and
// moments, or the published controller's volts.
class Allocation {
 public:
  virtual ~Allocation() = default;

  // The part of the demand that the thrusters can give, and the voltages for it and for what can be
  // given of a moment that levels the vehicle.
  virtual Allocated Share(const Axes& demand, const RollPitch& level) const = 0;
  Allocated Share(const Axes& demand) const { return Share(demand, RollPitch::Zero()); }

  // The demand on each axis that is all that the vehicle has, alone: the mean of both ways.
  virtual Axes authority() const = 0;
};

// ------------------------------------------------------------------------------------------------

struct ForceAllocationParams {
  double ramp_share = 0.02;  // guess; several times the noise of a command, so it cannot chatter

  static void Fields(auto& self, auto&& field) {
    field("ramp_share", self.ramp_share, InRange(1e-4, 1),
          "share of a thruster's full thrust below which its voltage is proportional to the "
          "thrust, instead of jumping over the dead band");
  }
};

// Forces [N] and the moment about z [N m] in B. With thrusters that push along the columns of a
// matrix (4 x n), the least thrust that gives the demand, each counted in shares of its full
// thrust; where there is a choice, that which rolls and pitches least. Failed thrusters drop out.
// Where the thrusters saturate the level is kept first, then the heading, heave, sway and surge: a
// vehicle that loses the horizon or its heading loses the marker. Only what moves the vehicle along
// no axis levels it. Voltages by the inverse of each thruster's own curve.
class ForceAllocation final : public Allocation {
 public:
  // ConfigError for a vehicle that cannot push along one of the axes even when all its thrusters
  // are sound, unless it may lack some: it gives nothing there. So does one that cannot because of
  // failed thrusters.
  ForceAllocation(const ForceAllocationParams& params, const VehicleModel& vehicle,
                  bool may_lack_axes = false);

  using Allocation::Share;
  Allocated Share(const Axes& demand, const RollPitch& level) const override;

  // The most that a sound vehicle gives on each axis alone, ahead and back (negative).
  const Axes& most() const { return most_; }
  const Axes& most_back() const { return most_back_; }
  Axes authority() const override { return (most_ - most_back_) / 2; }
  // The voltages for a thrust of each thruster [N], as far as it has it, and what voltages settle
  // to along the axes.
  ThrusterCommand CommandOf(const PerThruster& thrust_newton) const;
  Axes GivenBy(const ThrusterCommand& command) const;
  // Whether the thrusters that are left can roll and pitch it without moving it along an axis.
  bool levels() const { return thrust_per_level_.col(0).any() && thrust_per_level_.col(1).any(); }

 private:
  using ByThruster = Eigen::Matrix<double, Eigen::Dynamic, kAxisCount, 0, kMaxThrusters>;

  double Volts(size_t thruster, double thrust_newton) const;

  ForceAllocationParams params_;
  std::vector<ThrusterModel> thrusters_;
  PerThruster least_newton_, most_newton_;  // what each gives
  ByThruster thrust_per_demand_;
  Eigen::Matrix<double, Eigen::Dynamic, 2, 0, kMaxThrusters> thrust_per_level_;
  std::array<bool, kAxisCount> reached_{};
  Axes most_ = Axes::Zero(), most_back_ = Axes::Zero();
};

// ------------------------------------------------------------------------------------------------

// Inverse of the thrusters' static curve, so that a demand gives thrust in proportion: over the
// dead band, then as the root of what the curve raises. Published is none of it (0 and 1).
struct VoltsAllocationParams {
  double dead_band_v = 0;
  double curve_exponent = 1;
  double ramp_v = 0.05;  // guess; several times the command's noise, so that it cannot chatter

  static void Fields(auto& self, auto&& field) {
    field("dead_band_v", self.dead_band_v, InRange(0, 1),
          "voltage added to every thruster's demand to cross the thruster's dead band; 0 as "
          "published");
    field("curve_exponent", self.curve_exponent, InRange(1, 4),
          "exponent of the voltage with which the thrusters' force grows, as the controller "
          "assumes; 1 as published");
    field("ramp_v", self.ramp_v, InRange(0.001, 1),
          "demand below which a thruster's voltage is proportional to it");
  }
};

// The part of a demand that the thrusters can give. Where surge and yaw, which share two thrusters,
// together ask for more than there is, yaw is kept first and surge gets what remains: a vehicle
// that loses its heading loses the marker. Allocate gives the same command for the demand and its
// part.
AxisVolts Attainable(const VoltsAllocationParams& params, const AxisVolts& axes);

// The published vehicle's thrusters. Surge: left = surge - yaw, right = surge + yaw; sway and heave
// have one each. Every voltage of the result is in [0, 5].
ThrusterCommand Allocate(const VoltsAllocationParams& params, const AxisVolts& axes);

// The two above for a controller that asks for volts.
class VoltsAllocation final : public Allocation {
 public:
  // ConfigError for a vehicle whose thrusters are not the published ones.
  VoltsAllocation(const VoltsAllocationParams& params, const VehicleModel& vehicle);

  using Allocation::Share;
  Allocated Share(const Axes& demand, const RollPitch& level) const override;
  Axes authority() const override { return Axes::Constant(kNeutralVolts); }

 private:
  VoltsAllocationParams params_;
};

}  // namespace turbidock::control
