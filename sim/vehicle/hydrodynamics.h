#pragma once
// Fossen's six-degree-of-freedom model of a body in moving water: added mass with its Coriolis and
// centripetal terms, damping, buoyancy, and the forces of water that accelerates. Pure functions.
//
// T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control (2011), chapters 6 to 8.
// Order of the 6-vectors and matrices is SNAME's (surge, sway, heave, roll, pitch, yaw: linear part
// first), about B's origin and along B's axes; B is x forward, y left, z up, so a coefficient that
// couples an odd number of {sway, heave, pitch, yaw} has the opposite sign of one given for axes
// with y to starboard and z down.
//
// The rigid body itself (mass, weight, its own Coriolis terms, contacts) is MuJoCo's.

#include <Eigen/Core>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "sim/base/fields.h"
#include "sim/base/pose.h"

namespace turbidock::vehicle {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

enum class Dof { kSurge, kSway, kHeave, kRoll, kPitch, kYaw };
constexpr auto Names(Dof) {
  using enum Dof;
  return EnumList<Dof>({{kSurge, "surge"},
                        {kSway, "sway"},
                        {kHeave, "heave"},
                        {kRoll, "roll"},
                        {kPitch, "pitch"},
                        {kYaw, "yaw"}});
}

// One element off the diagonal of a 6 x 6 matrix.
struct MatrixEntry {
  Dof row = Dof::kSurge, column = Dof::kSway;
  double value = 0;

  static void Fields(auto& self, auto&& field) {
    field("row", self.row, Finite(),
          "matrix of added mass or damping, element off the diagonal: axis of the force or moment");
    field("column", self.column, Finite(),
          "matrix of added mass or damping, element off the diagonal: axis of the acceleration or "
          "velocity that causes the force or moment");
    field("value", self.value, Finite(),
          "matrix of added mass or damping, value of an element off the diagonal [N or N m by its "
          "row, per m/s^2 or rad/s^2 (added mass), m/s or rad/s (linear damping) or the square "
          "of these (quadratic damping) by its column]");
  }
};

// Positive values resist the motion: added mass is M_A = -(X_udot, ...), damping is D = -(X_u, ...)
// and D_q = -(X_|u|u, ...). Sources of the numbers: models/vehicle.yaml.
struct HydrodynamicsParams {
  double water_density_kg_m3 = 1025;
  double displaced_volume_m3 = 0.014654;
  Eigen::Vector3d p_BBcb_m{0, 0, 0.03};
  double hull_height_m = 0.31;
  Vector6d added_mass_diagonal = (Vector6d() << 6, 10, 9, 0.03, 0.03, 0.05).finished();
  std::vector<MatrixEntry> added_mass_coupling;
  Vector6d linear_damping_diagonal = (Vector6d() << 12, 7, 13, 0.1, 0.15, 0.8).finished();
  std::vector<MatrixEntry> linear_damping_coupling;
  Vector6d quadratic_damping_diagonal = (Vector6d() << 55, 145, 76, 0.1, 0.15, 0.5).finished();
  std::vector<MatrixEntry> quadratic_damping_coupling;

  static void Fields(auto& self, auto&& field) {
    field("water_density_kg_m3", self.water_density_kg_m3, InRange(0, 2000),
          "density of the water that the vehicle displaces");
    field("displaced_volume_m3", self.displaced_volume_m3, InRange(0, 1e3),
          "volume of water that the submerged vehicle displaces");
    field("p_BBcb_m", self.p_BBcb_m, InRange(-10, 10),
          "centre of buoyancy: x, y, z in the vehicle's frame B");
    field("hull_height_m", self.hull_height_m, InRange(1e-3, 100),
          "height of the hull: buoyancy falls linearly to zero while that much leaves the water");
    field(
        "added_mass_diagonal", self.added_mass_diagonal, AtLeast(0),
        "added mass on the matrix's diagonal: surge, sway, heave [kg], roll, pitch, yaw [kg m^2]");
    field("added_mass_coupling", self.added_mass_coupling, Finite(),
          "added mass off the matrix's diagonal [kg, kg m, kg m^2]; give both halves, it must be "
          "symmetric");
    field("linear_damping_diagonal", self.linear_damping_diagonal, AtLeast(0),
          "linear damping on the matrix's diagonal: surge, sway, heave [N s/m], roll, pitch, yaw "
          "[N m s]");
    field(
        "linear_damping_coupling", self.linear_damping_coupling, Finite(),
        "linear damping off the matrix's diagonal [N s/m, N s, N m s]; multiplies v of its column");
    field("quadratic_damping_diagonal", self.quadratic_damping_diagonal, AtLeast(0),
          "quadratic damping on the matrix's diagonal: surge, sway, heave [N s^2/m^2], roll, "
          "pitch, yaw [N m s^2]");
    field(
        "quadratic_damping_coupling", self.quadratic_damping_coupling, Finite(),
        "quadratic damping off the matrix's diagonal [N s^2/m^2, N s^2, N m s^2]; multiplies |v| v "
        "of its column");
  }

  // Refuses an asymmetric added mass and damping that could feed energy into the vehicle.
  void Check(const std::string& path) const;
};

// The parameters as matrices, ready for use.
struct HydroModel {
  explicit HydroModel(const HydrodynamicsParams& params);

  Matrix6d added_mass, linear_damping, quadratic_damping;
  double water_density_kg_m3, displaced_volume_m3, hull_height_m;
  Eigen::Vector3d p_BBcb;
};

// The vehicle and the water around it at one instant. The water is taken as uniform over the
// vehicle's length: waves are long against it.
struct BodyInWater {
  Pose X_WB{};
  Twist V_WB_B{};
  Eigen::Vector3d water_v_W = Eigen::Vector3d::Zero();  // of the water, at the centre of buoyancy
  Eigen::Vector3d water_a_W = Eigen::Vector3d::Zero();  // its acceleration
  Eigen::Vector3d gravity_W = Eigen::Vector3d::Zero();
};

// Wrenches on the vehicle at B's origin, expressed in B, by cause. To be used with the equation of
// motion in MuJoCo's coordinates of a free joint (linear acceleration of B's origin in W, angular
// acceleration in B) and with the added mass in its inertia matrix.
struct HydroWrenches {
  Wrench damping;
  Wrench buoyancy;
  // What is left of the added mass besides M_A times the acceleration above, and the pressure
  // gradient of accelerating water: -C_A(v_r) v_r + M_A (w x v_r + du/dt) + rho V du/dt.
  Wrench inertial;
  Wrench frame;      // the part of `inertial` that only turns M_A with the body: M_A (w x v)
  Vector6d v_rel_B;  // velocity relative to the water, SNAME order
};

HydroWrenches ComputeHydroWrenches(const HydroModel& model, const BodyInWater& body);

// Share of the volume under water when the centre of buoyancy is at height z_m (0: surface).
double SubmergedFraction(double z_m, double hull_height_m);

// Potential energy of buoyancy, 0 with the centre of buoyancy at the surface.
double BuoyancyPotential(const HydroModel& model, const Pose& X_WB, double gravity_mps2);

}  // namespace turbidock::vehicle
