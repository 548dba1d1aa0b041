#include "sim/vehicle/vehicle_params.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace turbidock::vehicle {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d Skew(const Vector3d& a) {
  Matrix3d S;
  S << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return S;
}

// Inertia of a point mass at p about the origin.
Matrix3d PointInertia(double mass_kg, const Vector3d& p) {
  return mass_kg * (p.squaredNorm() * Matrix3d::Identity() - p * p.transpose());
}

}  // namespace

Matrix3d RigidBodyParams::Inertia() const {
  const Vector3d& d = inertia_kg_m2;
  const Vector3d& p = inertia_products_kg_m2;
  Matrix3d I;
  I << d.x(), p.x(), p.y(), p.x(), d.y(), p.z(), p.y(), p.z(), d.z();
  return I;
}

void RigidBodyParams::Check(const std::string& path) const {
  const Vector3d principal =
      Eigen::SelfAdjointEigenSolver<Matrix3d>(Inertia(), Eigen::EigenvaluesOnly).eigenvalues();
  if (principal.x() <= 0)
    throw ConfigError(JoinKey(path, "inertia_products_kg_m2"),
                      "make the inertia lose positive definiteness (principal moment " +
                          FormatNumber(principal.x()) + ")");
  // A plate is the limit; leave room for rounding.
  if (principal.z() > (principal.x() + principal.y()) * (1 + 1e-9))
    throw ConfigError(JoinKey(path, "inertia_kg_m2"),
                      "one principal moment (" + FormatNumber(principal.z()) +
                          ") exceeds the sum of the others (" +
                          FormatNumber(principal.x() + principal.y()) + "): no body has that");
}

double ContactParams::DampingRatio() const {
  const auto log_restitution = [](double z) {
    const double s = std::abs((1 - z) * (1 + z));
    if (s == 0) return -2.0;
    return -2 * z * (z < 1 ? std::acos(z) : std::acosh(z)) / std::sqrt(s);
  };
  // It falls from 0 at no damping to -4.3, a restitution of 0.014, at 4.
  const double wanted = std::log(restitution);
  double low = 0, high = 4;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2, got = log_restitution(middle);
    if (got == wanted) return middle;
    (got > wanted ? low : high) = middle;
  }
  return high;
}

RigidBodyParams VehicleData::LoadedRigidBody() const {
  if (loads.empty()) return rigid_body;
  double mass_kg = rigid_body.mass_kg;
  Vector3d moment = rigid_body.mass_kg * rigid_body.p_BBcm_m;
  for (const LoadParams& load : loads) {
    mass_kg += load.mass_kg;
    moment += load.mass_kg * load.p_BQ_m;
  }
  const Vector3d p_BBcm = moment / mass_kg;
  Matrix3d I =
      rigid_body.Inertia() + PointInertia(rigid_body.mass_kg, rigid_body.p_BBcm_m - p_BBcm);
  for (const LoadParams& load : loads) I += PointInertia(load.mass_kg, load.p_BQ_m - p_BBcm);
  return {.mass_kg = mass_kg,
          .p_BBcm_m = p_BBcm,
          .inertia_kg_m2 = I.diagonal(),
          .inertia_products_kg_m2 = {I(0, 1), I(0, 2), I(1, 2)}};
}

HydrodynamicsParams VehicleData::LoadedHydrodynamics() const {
  HydrodynamicsParams loaded = hydrodynamics;
  Vector3d moment = hydrodynamics.displaced_volume_m3 * hydrodynamics.p_BBcb_m;
  for (const LoadParams& load : loads) {
    loaded.displaced_volume_m3 += load.volume_m3;
    moment += load.volume_m3 * load.p_BQ_m;
  }
  // Without a displaced load the sum would only round the centre.
  if (loaded.displaced_volume_m3 > hydrodynamics.displaced_volume_m3)
    loaded.p_BBcb_m = moment / loaded.displaced_volume_m3;
  return loaded;
}

void VehicleData::Check(const std::string& path) const {
  const Matrix6d total = RigidBodyInertia(LoadedRigidBody()) + HydroModel(hydrodynamics).added_mass;
  const double smallest =
      Eigen::SelfAdjointEigenSolver<Matrix6d>(total, Eigen::EigenvaluesOnly).eigenvalues()[0];
  if (smallest <= 0)
    throw ConfigError(JoinKey(path, "hydrodynamics.added_mass_coupling"),
                      "rigid plus added mass is not positive definite (smallest eigenvalue " +
                          FormatNumber(smallest) + ")");
}

Matrix6d RigidBodyInertia(const RigidBodyParams& body) {
  const Matrix3d S = Skew(body.p_BBcm_m);
  Matrix6d M;
  M.topLeftCorner<3, 3>() = body.mass_kg * Matrix3d::Identity();
  M.topRightCorner<3, 3>() = -body.mass_kg * S;
  M.bottomLeftCorner<3, 3>() = body.mass_kg * S;
  M.bottomRightCorner<3, 3>() = body.Inertia() - body.mass_kg * S * S;
  return M;
}

}  // namespace turbidock::vehicle
