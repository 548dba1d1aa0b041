#include "sim/vehicle/hydrodynamics.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace turbidock::vehicle {
namespace {

using Eigen::Vector3d;

// Elements within rounding of each other count as equal.
constexpr double kSymmetryTol = 1e-9;

Matrix6d MatrixOf(const Vector6d& diagonal, const std::vector<MatrixEntry>& coupling) {
  Matrix6d matrix = diagonal.asDiagonal();
  for (const MatrixEntry& entry : coupling)
    matrix(static_cast<int>(entry.row), static_cast<int>(entry.column)) = entry.value;
  return matrix;
}

std::string ElementName(int row, int column) {
  return std::string(NameOf(static_cast<Dof>(row))) + "-" + NameOf(static_cast<Dof>(column));
}

void CheckCoupling(const std::vector<MatrixEntry>& coupling, const std::string& key) {
  for (size_t i = 0; i < coupling.size(); ++i) {
    const MatrixEntry& entry = coupling[i];
    const std::string element = key + "[" + std::to_string(i) + "]";
    if (entry.row == entry.column)
      throw ConfigError(element, "is on the diagonal; give it in the list of six");
    for (size_t j = 0; j < i; ++j)
      if (coupling[j].row == entry.row && coupling[j].column == entry.column)
        throw ConfigError(element, "gives the same element as entry " + std::to_string(j));
  }
}

// Whether v . (Q |v| v) >= 0 for every v. With |v_i| |v_j|^2 <= |v_i|^3 / 3 + 2 |v_j|^3 / 3 the
// diagonal outweighs the coupling when q_kk >= sum_j (|q_kj| / 3 + 2 |q_jk| / 3). The bound is
// sufficient in any unit of length, so the best of several decides.
bool QuadraticDampingDissipates(const Matrix6d& quadratic) {
  for (int i = 0; i < 35; ++i) {
    const double unit_m = 0.01 * std::pow(1.25, i);  // to 20 m
    Vector6d scale = Vector6d::Ones();               // v = scale * v'
    scale.tail<3>().setConstant(1 / unit_m);
    const Matrix6d scaled = scale.asDiagonal() * quadratic * scale.cwiseAbs2().asDiagonal();
    bool holds = true;
    for (int k = 0; k < 6 && holds; ++k) {
      const double row = scaled.row(k).cwiseAbs().sum() - std::abs(scaled(k, k));
      const double column = scaled.col(k).cwiseAbs().sum() - std::abs(scaled(k, k));
      holds = scaled(k, k) >= row / 3 + 2 * column / 3;
    }
    if (holds) return true;
  }
  return false;
}

// -w x P and -(w x L + v x P) with the momenta (P, L) = M_A v of the water: Kirchhoff's form of
// -C_A v.
Wrench MinusCoriolis(const Matrix6d& added_mass, const Vector6d& v) {
  const Vector6d momentum = added_mass * v;
  const Vector3d linear = momentum.head<3>(), angular = momentum.tail<3>();
  const Vector3d velocity = v.head<3>(), w = v.tail<3>();
  return {.tau = -w.cross(angular) - velocity.cross(linear), .f = -w.cross(linear)};
}

}  // namespace

void HydrodynamicsParams::Check(const std::string& path) const {
  CheckCoupling(added_mass_coupling, Dotted(path, "added_mass_coupling"));
  CheckCoupling(linear_damping_coupling, Dotted(path, "linear_damping_coupling"));
  CheckCoupling(quadratic_damping_coupling, Dotted(path, "quadratic_damping_coupling"));

  const Matrix6d added = MatrixOf(added_mass_diagonal, added_mass_coupling);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < i; ++j)
      if (std::abs(added(i, j) - added(j, i)) > kSymmetryTol * added.cwiseAbs().maxCoeff())
        throw ConfigError(Dotted(path, "added_mass_coupling"),
                          ElementName(i, j) + " is " + FormatNumber(added(i, j)) + " but " +
                              ElementName(j, i) + " is " + FormatNumber(added(j, i)) +
                              ", added mass must be symmetric");

  const Matrix6d linear = MatrixOf(linear_damping_diagonal, linear_damping_coupling);
  const Matrix6d symmetric = 0.5 * (linear + linear.transpose());
  const double smallest = Eigen::SelfAdjointEigenSolver<Matrix6d>(symmetric, Eigen::EigenvaluesOnly)
                              .eigenvalues()
                              .minCoeff();
  if (smallest < -kSymmetryTol * symmetric.cwiseAbs().maxCoeff())
    throw ConfigError(Dotted(path, "linear_damping_coupling"),
                      "outweighs the diagonal: the damping would drive the vehicle");
  if (!QuadraticDampingDissipates(MatrixOf(quadratic_damping_diagonal, quadratic_damping_coupling)))
    throw ConfigError(Dotted(path, "quadratic_damping_coupling"),
                      "outweighs the diagonal: the damping could drive the vehicle");
}

HydroModel::HydroModel(const HydrodynamicsParams& params)
    : added_mass(MatrixOf(params.added_mass_diagonal, params.added_mass_coupling)),
      linear_damping(MatrixOf(params.linear_damping_diagonal, params.linear_damping_coupling)),
      quadratic_damping(
          MatrixOf(params.quadratic_damping_diagonal, params.quadratic_damping_coupling)),
      water_density_kg_m3(params.water_density_kg_m3),
      displaced_volume_m3(params.displaced_volume_m3),
      hull_height_m(params.hull_height_m),
      p_BBcb(params.p_BBcb_m) {}

double SubmergedFraction(double z_m, double hull_height_m) {
  return std::clamp(0.5 - z_m / hull_height_m, 0.0, 1.0);
}

double BuoyancyPotential(const HydroModel& model, const Pose& X_WB, double gravity_mps2) {
  // Minus the integral of the submerged fraction over the height, from the surface.
  const double z = (X_WB * model.p_BBcb).z(), h = model.hull_height_m;
  double integral;
  if (z <= -h / 2)
    integral = z + h / 8;
  else if (z >= h / 2)
    integral = h / 8;
  else
    integral = z / 2 - z * z / (2 * h);
  return -model.water_density_kg_m3 * model.displaced_volume_m3 * gravity_mps2 * integral;
}

HydroWrenches ComputeHydroWrenches(const HydroModel& model, const BodyInWater& body) {
  const Eigen::Matrix3d R_WB = body.X_WB.R();
  const Vector3d& w = body.V_WB_B.w;
  const Vector3d v_rel = body.V_WB_B.v - R_WB.transpose() * body.water_v_W;
  const Vector3d water_a_B = R_WB.transpose() * body.water_a_W;

  HydroWrenches out;
  out.v_rel_B << v_rel, w;

  const Vector6d damping =
      -(model.linear_damping * out.v_rel_B +
        model.quadratic_damping * out.v_rel_B.cwiseAbs().cwiseProduct(out.v_rel_B));
  out.damping = {.tau = damping.tail<3>(), .f = damping.head<3>()};

  const double z_cb_m = (body.X_WB * model.p_BBcb).z();
  const double displaced_kg = model.water_density_kg_m3 * model.displaced_volume_m3 *
                              SubmergedFraction(z_cb_m, model.hull_height_m);
  out.buoyancy.f = -displaced_kg * (R_WB.transpose() * body.gravity_W);
  out.buoyancy.tau = model.p_BBcb.cross(out.buoyancy.f);

  // Only the first three columns of M_A meet these accelerations, which have no angular part.
  const auto pushed = [&](const Vector3d& a_B) {
    const Vector6d force = model.added_mass.leftCols<3>() * a_B;
    return Wrench{.tau = force.tail<3>(), .f = force.head<3>()};
  };
  const Wrench coriolis = MinusCoriolis(model.added_mass, out.v_rel_B);
  const Wrench drawn_along = pushed(w.cross(v_rel) + water_a_B);
  const Vector3d pressure_f = displaced_kg * water_a_B;  // Froude-Krylov
  out.inertial.f = coriolis.f + drawn_along.f + pressure_f;
  out.inertial.tau = coriolis.tau + drawn_along.tau + model.p_BBcb.cross(pressure_f);
  out.frame = pushed(w.cross(body.V_WB_B.v));
  return out;
}

}  // namespace turbidock::vehicle
