#include "sim/vehicle/mooring.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace turbidock::vehicle {
namespace {

constexpr double kTurn_rad = 2 * std::numbers::pi;

}  // namespace

Mooring::Mooring(const MooringParams& params, double heading_rad, Rng rng)
    : params_(params), heading_rad_(heading_rad) {
  CheckFields(params, "station.mooring");
  for (double& phase_rad : phase_rad_) phase_rad = rng.Uniform(0, kTurn_rad);
}

void Mooring::Reset(const Sea& sea, const Eigen::Vector3d& p_WK) {
  p_WK_ = p_WK;
  drawn_m_.setZero();
  drawn_mps_.setZero();
  yaw_rad_ = 0;
  if (params_.turns()) {
    const Eigen::Vector2d against = -sea.Current(p_WK).head<2>();
    if (!against.isZero(0)) {
      const double yaw_rad = std::atan2(against.y(), against.x()) - heading_rad_;
      yaw_rad_ = std::remainder(yaw_rad, kTurn_rad);
    }
  }
  displacement_ = {0, 0, yaw_rad_};
  if (params_.drawn()) {
    // Until what it began with has died away (e^-8), or for 2000 s.
    const double decay_s = params_.natural_period_s / (kTurn_rad * params_.damping_ratio);
    const double dt_s = std::min(0.005, params_.natural_period_s / 200);
    const auto ticks =
        static_cast<int64_t>(std::ceil(std::min(8 * std::max(decay_s, 1.0), 2000.0) / dt_s));
    drawn_m_ = 2 * params_.damping_ratio * params_.natural_period_s / kTurn_rad *
               sea.Current(p_WK).head<2>();
    for (int64_t tick = -ticks; tick < 0; ++tick) Step(sea, static_cast<double>(tick) * dt_s, dt_s);
  }
  Displace(0);
}

void Mooring::Step(const Sea& sea, double time_s, double dt_s) {
  if (params_.drawn() || params_.turns()) {
    const Eigen::Vector3d p_W = p_WK_ + Eigen::Vector3d(displacement_.x(), displacement_.y(), 0);
    const WaterMotion water = sea.At(p_W, time_s + dt_s / 2);
    const Eigen::Vector2d u_mps = water.v_W.head<2>();
    if (params_.drawn()) {
      const double w = kTurn_rad / params_.natural_period_s;
      drawn_mps_ +=
          dt_s * (water.a_W.head<2>() + 2 * params_.damping_ratio * w * (u_mps - drawn_mps_) -
                  w * w * drawn_m_);
      drawn_m_ += dt_s * drawn_mps_;
    }
    if (params_.turns()) {
      // |u| sin(psi_u - psi) is how far the flow's opposite is across the vane.
      const double across = heading_rad_ + yaw_rad_;
      const double turning_mps = std::sin(across) * u_mps.x() - std::cos(across) * u_mps.y();
      yaw_rad_ += dt_s * turning_mps / params_.weathervane_arm_m;
    }
  }
  Displace(time_s + dt_s);
}

void Mooring::Displace(double time_s) {
  const Eigen::Array2d swing_m(params_.swing_x_m, params_.swing_y_m);
  const Eigen::Array2d angle_rad = kTurn_rad * time_s / params_.swing_period_s + phase_rad_;
  displacement_.head<2>() = drawn_m_ + (swing_m * angle_rad.sin()).matrix();
  displacement_.z() = yaw_rad_;
}

}  // namespace turbidock::vehicle
