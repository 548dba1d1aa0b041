#pragma once
// The account of the vehicle's energy, which shows whether the physics is sound.

#include <cmath>

#include "sim/base/fields.h"

namespace turbidock::vehicle {

// Where the energy went since a plant's Reset, in joules. Kinetic energy is that of the vehicle and
// its added mass; potential energy that of weight and buoyancy.
struct EnergyBalance {
  double kinetic_change = 0, potential_change = 0;
  double thruster_work = 0;
  double extra_work = 0;  // of SetExtraWrench
  double drag_loss = 0;   // dissipated by damping
  double water_work = 0;  // done by moving water, through damping and pressure
  double tether_work = 0;
  double contact_work = 0;  // of all constraint forces; negative when contacts dissipate

  // What the terms leave unexplained: the integrator's error.
  double residual() const {
    return kinetic_change + potential_change -
           (thruster_work + extra_work + water_work + tether_work + contact_work - drag_loss);
  }
  // What passed through the vehicle: the scale to judge the residual by.
  double turnover() const {
    return std::abs(thruster_work) + std::abs(extra_work) + std::abs(water_work) +
           std::abs(tether_work) + std::abs(contact_work) + drag_loss;
  }
  bool operator==(const EnergyBalance&) const = default;

  static void Fields(auto& self, auto&& field) {
    field("thruster_work_joule", self.thruster_work, Finite(), "work done by the thrusters");
    field("drag_loss_joule", self.drag_loss, Finite(), "loss dissipated by damping");
    field("water_work_joule", self.water_work, Finite(), "work done by moving water");
    field("tether_work_joule", self.tether_work, Finite(), "work done by the tether");
    field("contact_work_joule", self.contact_work, Finite(), "work of all contacts");
    field("kinetic_change_joule", self.kinetic_change, Finite(),
          "change of kinetic energy of vehicle and added mass");
    field("potential_change_joule", self.potential_change, Finite(),
          "change of potential energy of weight and buoyancy");
    field("residual_joule", self.residual(), Finite(),
          "residual that work, loss and changes leave unexplained");
  }
};

}  // namespace turbidock::vehicle
