#pragma once
// The vehicle as data: what it weighs, what it displaces, what pushes it. models/vehicle.yaml holds
// these numbers with their sources; geometry and the places of the thrusters are the MJCF's.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "sim/base/fields.h"
#include "sim/vehicle/hydrodynamics.h"
#include "sim/vehicle/thrusters.h"

namespace turbidock::vehicle {

struct RigidBodyParams {
  double mass_kg = 15;
  Eigen::Vector3d p_BBcm_m{0, 0, 0};
  Eigen::Vector3d inertia_kg_m2{0.18, 0.25, 0.23};
  Eigen::Vector3d inertia_products_kg_m2{0, 0, 0};

  static void Fields(auto& self, auto&& field) {
    field("mass_kg", self.mass_kg, Above(0),
          "dry mass of the vehicle, with the water trapped in it; it sinks where that is more than "
          "the water displaced (hydrodynamics.displaced_volume_m3)");
    field("p_BBcm_m", self.p_BBcm_m, InRange(-10, 10),
          "vehicle's centre of mass: x, y, z in the vehicle's frame B");
    field("inertia_kg_m2", self.inertia_kg_m2, Above(0),
          "vehicle's moments of inertia Ixx, Iyy, Izz about its centre of mass, along the axes of "
          "its frame B");
    field("inertia_products_kg_m2", self.inertia_products_kg_m2, Finite(),
          "elements xy, xz, yz of the vehicle's inertia matrix about its centre of mass, along the "
          "axes of its frame B");
  }

  Eigen::Matrix3d Inertia() const;  // about the centre of mass, B's axes

  // Refuses an inertia that no body has.
  void Check(const std::string& path) const;
};

// A payload, a ballast or a float fixed to the vehicle: a point mass that may displace water.
struct LoadParams {
  double mass_kg = 0;
  double volume_m3 = 0;
  Eigen::Vector3d p_BQ_m{0, 0, 0};

  static void Fields(auto& self, auto&& field) {
    field("mass_kg", self.mass_kg, AtLeast(0),
          "mass of a load (payload or ballast); in water less what its volume_m3 displaces");
    field("volume_m3", self.volume_m3, AtLeast(0),
          "volume of water that a load (payload or ballast) displaces");
    field("p_BQ_m", self.p_BQ_m, InRange(-10, 10),
          "point where a load is fixed: x, y, z in the vehicle's frame B");
  }
};

// How the pole and the dock touch each other: Coulomb friction, and a spring with a damper that let
// go before they would have to pull. Such a contact with natural frequency w = 1 / time_constant_s
// and damping ratio z gives back the share exp(-2 z acos(z) / sqrt(1 - z^2)) of the speed of a
// normal impact (Schwager and Poeschel 2007; acosh and z^2 - 1 beyond z = 1). It always gives
// something back: 0 would take an infinite damping ratio.
struct ContactParams {
  double friction = 0.2;
  double restitution = 0.1353352832366127;  // exp(-2): z = 1
  double time_constant_s = 0.02;

  static void Fields(auto& self, auto&& field) {
    field("friction", self.friction, InRange(0, 2),
          "contact of pole and dock: ratio of the force of sliding to the normal force; up to 30 % "
          "less between the axes of MuJoCo's friction pyramid");
    field("restitution", self.restitution, InRange(0.05, 0.95),
          "contact of pole and dock: ratio of the speed after to that before a normal impact; "
          "exp(-2) when critically damped");
    field("time_constant_s", self.time_constant_s, InRange(1e-3, 1),
          "contact of pole and dock: time constant of its spring; an impact lasts two to three of "
          "them, and dents by the speed times this");
  }

  double DampingRatio() const;  // that gives the restitution
};

// What a vehicle is in open water.
struct VehicleData {
  RigidBodyParams rigid_body;
  HydrodynamicsParams hydrodynamics;
  ThrusterParams thrusters;
  std::vector<LoadParams> loads;

  static void Fields(auto& self, auto&& field) {
    field("rigid_body", self.rigid_body, Finite(), "mass and inertia of the vehicle without loads");
    field("hydrodynamics", self.hydrodynamics, Finite(), "forces of the water on the vehicle");
    field("thrusters", self.thrusters, Finite(), "properties of the vehicle's thrusters");
    field("loads", self.loads, Finite(), "payload and ballast of the vehicle");
  }

  // Mass, centre of mass and inertia of vehicle and loads together.
  RigidBodyParams LoadedRigidBody() const;
  // Displaced volume and centre of buoyancy of vehicle and loads together; the rest unchanged.
  HydrodynamicsParams LoadedHydrodynamics() const;

  // Refuses a rigid plus added mass that is not positive definite.
  void Check(const std::string& path) const;
};

struct VehicleParams : VehicleData {
  ContactParams contact;

  static void Fields(auto& self, auto&& field) {
    VehicleData::Fields(self, field);
    field("contact", self.contact, Finite(), "contact of the pole with the dock");
  }
};

// Inertia matrix of a rigid body about B's origin, SNAME order (Fossen 2011, eq. 3.44).
Matrix6d RigidBodyInertia(const RigidBodyParams& body);

}  // namespace turbidock::vehicle
