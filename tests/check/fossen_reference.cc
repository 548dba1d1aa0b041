#include "tests/check/fossen_reference.h"

#include <Eigen/Dense>
#include <cmath>

namespace turbidock::check {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using vehicle::Matrix6d;
using vehicle::Vector6d;

Matrix3d Skew(const Vector3d& a) {
  Matrix3d S;
  S << 0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0;
  return S;
}

Matrix6d Coriolis(const Matrix6d& M, const Vector6d& nu) {
  Matrix6d C = Matrix6d::Zero();
  const Matrix3d S = Skew(M.topRows<3>() * nu);
  C.topRightCorner<3, 3>() = -S;
  C.bottomLeftCorner<3, 3>() = -S;
  C.bottomRightCorner<3, 3>() = -Skew(M.bottomRows<3>() * nu);
  return C;
}

}  // namespace

FossenReference::FossenReference(const vehicle::VehicleParams& params, const vehicle::Sea& sea)
    : rigid_(vehicle::RigidBodyInertia(params.rigid_body)),
      added_(params.hydrodynamics.added_mass_diagonal.asDiagonal()),
      params_(params),
      sea_(sea) {
  TD_CHECK(params.loads.empty(), "the reference carries no loads");
  for (const vehicle::MatrixEntry& e : params.hydrodynamics.added_mass_coupling)
    added_(static_cast<int>(e.row), static_cast<int>(e.column)) = e.value;
  inverse_ = (rigid_ + added_).inverse();
}

void FossenReference::SetExtraWrench(const Wrench& F_B_B) { tau_ << F_B_B.f, F_B_B.tau; }

Pose FossenReference::X_WB() const {
  return {FromYawPitchRoll(state_.eta[5], state_.eta[4], state_.eta[3]), state_.eta.head<3>()};
}

FossenReference::State FossenReference::Rate(double time_s, const State& s) const {
  const double cr = std::cos(s.eta[3]), sr = std::sin(s.eta[3]);
  const double cp = std::cos(s.eta[4]), sp = std::sin(s.eta[4]);
  const double cy = std::cos(s.eta[5]), sy = std::sin(s.eta[5]);
  Matrix3d R, T;
  R << cy * cp, -sy * cr + cy * sp * sr, sy * sr + cy * cr * sp,  //
      sy * cp, cy * cr + sr * sp * sy, -cy * sr + sp * sy * cr,   //
      -sp, cp * sr, cp * cr;
  T << 1, sr * sp / cp, cr * sp / cp, 0, cr, -sr, 0, sr / cp, cr / cp;

  const vehicle::HydrodynamicsParams& h = params_.hydrodynamics;
  const vehicle::WaterMotion water = sea_.At(s.eta.head<3>() + R * h.p_BBcb_m, time_s);
  const Vector3d flow = R.transpose() * water.v_W, flow_rate = R.transpose() * water.a_W;
  Vector6d nu_c = Vector6d::Zero(), nu_c_dot = Vector6d::Zero();
  nu_c.head<3>() = flow;
  nu_c_dot.head<3>() = flow_rate - Skew(s.nu.tail<3>()) * flow;
  const Vector6d nu_r = s.nu - nu_c;

  // g(eta) in components (eq. 4.6, with the signs of axes whose z is up)
  const double weight = params_.rigid_body.mass_kg * kGravity_mps2;
  const double buoyancy = h.water_density_kg_m3 * h.displaced_volume_m3 * kGravity_mps2;
  const double f = buoyancy - weight;
  const Vector3d lever = params_.rigid_body.p_BBcm_m * weight - h.p_BBcb_m * buoyancy;
  Vector6d g;
  g << f * sp, -f * cp * sr, -f * cp * cr,  //
      lever.y() * cp * cr - lever.z() * cp * sr, -lever.x() * cp * cr - lever.z() * sp,
      lever.x() * cp * sr + lever.y() * sp;

  Vector6d froude_krylov;
  froude_krylov.head<3>() = h.water_density_kg_m3 * h.displaced_volume_m3 * flow_rate;
  froude_krylov.tail<3>() = Skew(h.p_BBcb_m) * froude_krylov.head<3>();
  const Vector6d drag = (h.linear_damping_diagonal.array() +
                         h.quadratic_damping_diagonal.array() * nu_r.array().abs()) *
                        nu_r.array();
  State rate;
  rate.eta << R * s.nu.head<3>(), T * s.nu.tail<3>();
  rate.nu = inverse_ * (tau_ + froude_krylov + added_ * nu_c_dot - Coriolis(rigid_, s.nu) * s.nu -
                        Coriolis(added_, nu_r) * nu_r - drag - g);
  return rate;
}

void FossenReference::Step(double dt_s) {
  const State& s = state_;
  const auto shifted = [&s](const State& rate, double by_s) {
    return State{s.eta + by_s * rate.eta, s.nu + by_s * rate.nu};
  };
  const double t = time_s_, half_s = dt_s / 2;
  const State a = Rate(t, s), b = Rate(t + half_s, shifted(a, half_s));
  const State c = Rate(t + half_s, shifted(b, half_s)), d = Rate(t + dt_s, shifted(c, dt_s));
  state_ = {s.eta + dt_s / 6 * (a.eta + 2 * b.eta + 2 * c.eta + d.eta),
            s.nu + dt_s / 6 * (a.nu + 2 * b.nu + 2 * c.nu + d.nu)};
  time_s_ += dt_s;
}

}  // namespace turbidock::check
