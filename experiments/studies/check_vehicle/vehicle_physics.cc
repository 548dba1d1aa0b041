#include "experiments/studies/check_vehicle/vehicle_physics.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::check_vehicle {
namespace {

using Eigen::Vector3d;
using vehicle::Matrix6d;
using vehicle::Vector6d;

// Unknowns of a steady motion: velocity of B's origin, roll, pitch, rate of yaw.
SteadyMotion MotionOf(const Vector6d& x) {
  return {.V_WB_B = {.w = {0, 0, x[5]}, .v = x.head<3>()}, .roll_rad = x[3], .pitch_rad = x[4]};
}

// In SNAME order.
int DofOf(control::Axis axis) { return axis == control::kYaw ? 5 : static_cast<int>(axis); }

// What thrusters push with under one command.
class Thrust {
 public:
  Thrust(const vehicle::VehicleData& data, const std::vector<vehicle::ThrusterInScene>& thrusters,
         const ThrusterCommand& command)
      : thrusters_(thrusters),
        kinds_(data.thrusters.Of(NamesOf(thrusters), "vehicle.thrusters")),
        effectiveness_(data.thrusters.Effectiveness(thrusters.size())),
        command_(command) {}

  // Force and moment on B, in B, of what the inflow leaves at this velocity.
  Vector6d At(const Twist& V_WB_B) const {
    Vector6d sum = Vector6d::Zero();
    for (size_t i = 0; i < thrusters_.size(); ++i) {
      const vehicle::ThrusterInScene& t = thrusters_[i];
      const double still = kinds_[i].Thrust(command_.volts[i]);
      const double advance = std::max(
          0.0, std::copysign(1.0, still) * t.axis_B.dot(V_WB_B.v + V_WB_B.w.cross(t.p_BT)));
      const double kept = std::max(0.0, 1 - kinds_[i].inflow_loss_s_per_m * advance);
      const Vector3d f_B = effectiveness_[i] * kept * still * t.axis_B;
      sum.head<3>() += f_B;
      sum.tail<3>() += t.p_BT.cross(f_B);
    }
    return sum;
  }

 private:
  const std::vector<vehicle::ThrusterInScene>& thrusters_;
  std::vector<vehicle::ThrusterKind> kinds_;
  PerThruster effectiveness_;
  const ThrusterCommand& command_;
};

}  // namespace

Floating FloatingOf(const vehicle::VehicleData& data, double gravity_mps2) {
  const vehicle::RigidBodyParams body = data.LoadedRigidBody();
  const vehicle::HydrodynamicsParams hydro = data.LoadedHydrodynamics();
  const double displaced_kg = hydro.water_density_kg_m3 * hydro.displaced_volume_m3;
  // What would lift the vehicle if only moments counted: it rests with this vector upwards.
  const Vector3d righting =
      gravity_mps2 * (displaced_kg * hydro.p_BBcb_m - body.mass_kg * body.p_BBcm_m);
  Floating floating;
  floating.buoyancy_newton = gravity_mps2 * (displaced_kg - body.mass_kg);
  floating.righting_newton_m = righting.norm() * (righting.z() < 0 ? -1 : 1);
  if (righting.norm() > 0) {
    floating.roll_rad = std::atan2(righting.y(), righting.z());
    floating.pitch_rad = std::asin(std::clamp(-righting.x() / righting.norm(), -1.0, 1.0));
  }
  return floating;
}

double ForceAlong(control::Axis axis, const vehicle::VehicleData& data,
                  const std::vector<vehicle::ThrusterInScene>& thrusters,
                  const ThrusterCommand& command) {
  return Thrust(data, thrusters, command).At({})[DofOf(axis)];
}

SteadyMotion SteadyMotionOf(const vehicle::VehicleData& data,
                            const std::vector<vehicle::ThrusterInScene>& thrusters,
                            const ThrusterCommand& command, control::Axis axis,
                            double gravity_mps2) {
  const vehicle::RigidBodyParams body = data.LoadedRigidBody();
  const vehicle::HydroModel hydro(data.LoadedHydrodynamics());
  const Matrix6d rigid = vehicle::RigidBodyInertia(body), mass = rigid + hydro.added_mass;
  const Thrust thrust(data, thrusters, command);
  const double trim_newton =
      gravity_mps2 * (hydro.water_density_kg_m3 * hydro.displaced_volume_m3 - body.mass_kg);

  // What is left of all forces and moments: SNAME order, in B.
  const auto left_at = [&](const Vector6d& x) {
    const SteadyMotion motion = MotionOf(x);
    const Twist& V = motion.V_WB_B;
    const vehicle::BodyInWater in_water{
        .X_WB = {FromYawPitchRoll(0, motion.pitch_rad, motion.roll_rad), {0, 0, -1e3}},
        .V_WB_B = V,
        .gravity_W = {0, 0, -gravity_mps2}};
    const vehicle::HydroWrenches water = ComputeHydroWrenches(hydro, in_water);
    const Vector3d down_B = in_water.X_WB.q.conjugate() * Vector3d(0, 0, -1);
    const Vector3d weight = body.mass_kg * gravity_mps2 * down_B;
    Vector6d sum;
    sum << water.damping.f + water.buoyancy.f + water.inertial.f + weight + trim_newton * down_B,
        water.damping.tau + water.buoyancy.tau + water.inertial.tau + body.p_BBcm_m.cross(weight);
    sum += thrust.At(V);
    // A velocity that is steady in B turns with it.
    sum -= mass.leftCols<3>() * V.w.cross(V.v);
    sum.head<3>() -= body.mass_kg * V.w.cross(V.w.cross(body.p_BBcm_m));
    sum.tail<3>() -= V.w.cross(rigid.bottomRightCorner<3, 3>() * V.w);
    return sum;
  };

  // The axis alone.
  const int own = DofOf(axis);
  const auto alone = [&](double speed) { return left_at(speed * Vector6d::Unit(own))[own]; };
  const double sign = alone(0) < 0 ? -1 : 1;
  double low = 0, high = 100;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (sign * alone(sign * middle) > 0 ? low : high) = middle;
  }
  const Vector6d start = sign * low * Vector6d::Unit(own);

  Vector6d x = start;
  for (int i = 0; i < 50; ++i) {
    const Vector6d left = left_at(x);
    if (left.norm() < 1e-9) return MotionOf(x);
    constexpr double kSmall = 1e-6;
    Matrix6d jacobian;
    for (int k = 0; k < 6; ++k)
      jacobian.col(k) = (left_at(x + kSmall * Vector6d::Unit(k)) - left) / kSmall;
    const Vector6d step = jacobian.fullPivLu().solve(left);
    double share = 1;
    while (share > 1e-3 && !(left_at(x - share * step).norm() < left.norm())) share /= 2;
    x -= share * step;
  }
  return MotionOf(left_at(x).norm() < 1e-6 ? x : start);
}

}  // namespace turbidock::check_vehicle
