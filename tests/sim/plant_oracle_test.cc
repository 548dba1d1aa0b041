// The plant against closed forms and against an independent integration.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "sim/plant.h"
#include "tests/sim/plant_scene.h"

namespace turbidock::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using testing::kWeightless;
using testing::OpenWater;
using testing::TicksPerTenth;

constexpr double kGravity_mps2 = 9.81;

Rng SeaStream() { return SeedTree(1).Stream("sea"); }

// Neutrally buoyant, so that only what a test is about moves the vehicle.
VehicleParams Neutral() {
  VehicleParams params;
  params.hydrodynamics.displaced_volume_m3 = params.rigid_body.mass_kg / 1025;
  return params;
}

VehicleParams WithoutDamping(VehicleParams params) {
  params.hydrodynamics.linear_damping_diagonal.setZero();
  params.hydrodynamics.quadratic_damping_diagonal.setZero();
  return params;
}

// Added mass with every kind of coupling, positive definite by a wide margin.
VehicleParams Coupled(VehicleParams params) {
  const auto couple = [&](Dof a, Dof b, double value) {
    params.hydrodynamics.added_mass_coupling.push_back({a, b, value});
    params.hydrodynamics.added_mass_coupling.push_back({b, a, value});
  };
  couple(Dof::kSurge, Dof::kSway, 1.5);
  couple(Dof::kSway, Dof::kHeave, -0.8);
  couple(Dof::kSway, Dof::kRoll, 0.3);
  couple(Dof::kSway, Dof::kYaw, 0.25);
  couple(Dof::kHeave, Dof::kPitch, -0.2);
  couple(Dof::kRoll, Dof::kYaw, 0.01);
  return params;
}

void Advance(Plant& plant, double seconds) {
  const int64_t ticks = std::llround(seconds / plant.model().opt.timestep);
  for (int64_t i = 0; i < ticks; ++i) {
    const auto fault = plant.Step({});
    ASSERT_FALSE(fault.has_value()) << *fault;
  }
}

Matrix6d TotalMass(const VehicleParams& params) {
  return RigidBodyInertia(params.LoadedRigidBody()) + HydroModel(params.hydrodynamics).added_mass;
}

// Linear momentum and angular momentum about W's origin of vehicle and entrained water.
struct Momentum {
  Vector3d linear, angular;
};
Momentum MomentumOf(const Plant& plant, const VehicleParams& params) {
  const VehicleTruth now = plant.truth();
  Vector6d v;
  v << now.V_WB_B.v, now.V_WB_B.w;
  const Vector6d momentum_B = TotalMass(params) * v;
  const Vector3d linear = now.X_WB.q * momentum_B.head<3>();
  return {linear, now.X_WB.q * momentum_B.tail<3>() + now.X_WB.p.cross(linear)};
}

struct Drift {
  double energy, linear, angular;  // relative
};
Drift FreeMotionDrift(int ticks_per_tenth) {
  VehicleParams params = Coupled(WithoutDamping(Neutral()));
  params.rigid_body.p_BBcm_m = {0.02, -0.01, -0.03};
  const Scene scene = OpenWater(kWeightless);
  Plant plant(scene, params, TicksPerTenth(ticks_per_tenth), Sea());
  plant.SetVelocity({.w = Vector3d(0.5, -0.7, 0.6).normalized(), .v = {0.2, -0.1, 0.15}});
  const Momentum before = MomentumOf(plant, params);
  const double energy_before = 0.5 * [&] {
    const Twist V = plant.truth().V_WB_B;
    const Vector6d v = (Vector6d() << V.v, V.w).finished();
    return v.dot(TotalMass(params) * v);
  }();
  Drift drift{};
  for (int i = 0; i < 100; ++i) {
    Advance(plant, 0.1);
    const Momentum now = MomentumOf(plant, params);
    drift.energy = std::max(drift.energy, std::abs(plant.energy().kinetic_change) / energy_before);
    drift.linear =
        std::max(drift.linear, (now.linear - before.linear).norm() / before.linear.norm());
    drift.angular =
        std::max(drift.angular, (now.angular - before.angular).norm() / before.angular.norm());
  }
  return drift;
}

// The integrator is of first order: small at 1 ms, and half of it at half the step.
TEST(FreeMotion, ConservesEnergyAndMomentumToFirstOrder) {
  constexpr double kTolAt1ms = 2e-3;
  const Drift coarse = FreeMotionDrift(100), fine = FreeMotionDrift(200);
  EXPECT_LT(coarse.energy, kTolAt1ms);
  EXPECT_LT(coarse.linear, kTolAt1ms);
  EXPECT_LT(coarse.angular, kTolAt1ms);
  for (const auto& [at_1ms, at_half] : {std::pair{coarse.energy, fine.energy},
                                        {coarse.linear, fine.linear},
                                        {coarse.angular, fine.angular}}) {
    EXPECT_GT(at_1ms, 1e-6) << "nothing moved";
    EXPECT_NEAR(at_1ms / at_half, 2, 0.1);
  }
  RecordProperty("energy_drift", std::to_string(coarse.energy));
  RecordProperty("angular_drift", std::to_string(coarse.angular));
}

// R (M + A) R^T a = F, one step from rest.
TEST(AddedMass, AnisotropicUnderYawGivesTheAnalyticAcceleration) {
  VehicleParams params = WithoutDamping(Neutral());
  params.hydrodynamics.added_mass_coupling = {{Dof::kSurge, Dof::kSway, 2},
                                              {Dof::kSway, Dof::kSurge, 2}};
  const Scene scene = OpenWater();
  Plant plant(scene, params, TicksPerTenth(50), Sea());
  const Eigen::Quaterniond q_WB = FromYawPitchRoll(std::numbers::pi / 6, 0, 0);
  plant.Reset({q_WB, {0, 0, -5}});
  const Vector3d force_W(3, -2, 0);
  plant.SetExtraWrench({.f = q_WB.conjugate() * force_W});
  ASSERT_FALSE(plant.Step({}).has_value());
  Matrix3d mass;
  mass << 15 + 6, 2, 0, 2, 15 + 10, 0, 0, 0, 15 + 9;
  const Vector3d expected_W = q_WB * mass.inverse() * (q_WB.conjugate() * force_W);
  const VehicleTruth now = plant.truth();
  const Vector3d got_W = now.X_WB.q * now.V_WB_B.v / 0.002;
  EXPECT_LT((got_W - expected_W).norm(), 1e-6);
  EXPECT_GT((expected_W - force_W / 21).norm(), 0.01) << "would pass with isotropic mass";
}

TEST(AddedMass, FiveTimesTheBodysMassIsStableAtAnyStep) {
  for (const int ticks_per_tenth : {100, 50, 20}) {  // 1, 2, 5 ms
    VehicleParams params = Neutral();
    params.hydrodynamics.added_mass_diagonal << 75, 75, 75, 0.9, 1.25, 1.15;
    const Scene scene = OpenWater();
    Plant plant(scene, params, TicksPerTenth(ticks_per_tenth), Sea(ModerateSea(), SeaStream()));
    double fastest = 0;
    for (int i = 0; i < 60; ++i) {
      const double sign = i % 2 ? 1 : -1;
      plant.SetExtraWrench({.tau = {sign * 0.5, 0.3, sign}, .f = {sign * 9, 5, -sign * 5}});
      Advance(plant, 1);
      const Twist V = plant.truth().V_WB_B;
      fastest = std::max({fastest, V.v.norm(), V.w.norm()});
    }
    // The largest force against linear drag alone could give 1.8 m/s, the moment 2.6 rad/s about
    // yaw.
    EXPECT_LT(fastest, 3) << ticks_per_tenth;
    EXPECT_GT(fastest, 0.1);
  }
}

// F = D v + D_q v^2.
double TerminalSpeed(double force_newton, double linear, double quadratic) {
  return (-linear + std::sqrt(linear * linear + 4 * quadratic * force_newton)) / (2 * quadratic);
}

TEST(TerminalVelocity, OfEachAxisUnderAConstantForce) {
  VehicleParams params = Neutral();
  // Along an axis of symmetry from exact rest: nothing turns the vehicle out of its course.
  const Scene scene = OpenWater();
  for (int axis = 0; axis < 3; ++axis) {
    Plant plant(scene, params, TicksPerTenth(50), Sea());
    plant.Reset(Pose::Translation(0, 0, -1000));
    plant.SetExtraWrench({.f = 4.9 * Vector3d::Unit(axis)});
    Advance(plant, 60);
    const double expected = TerminalSpeed(4.9, params.hydrodynamics.linear_damping_diagonal[axis],
                                          params.hydrodynamics.quadratic_damping_diagonal[axis]);
    // Reached to rounding after 60 s, many time constants; the force balance has no step error.
    EXPECT_NEAR(plant.truth().V_WB_B.v[axis], expected, 1e-6 * expected) << axis;
  }
}

TEST(TerminalVelocity, OfASinkingBallastedVehicle) {
  VehicleParams params = Neutral();
  params.loads.push_back({.mass_kg = 0.3, .volume_m3 = 0, .p_BQ_m = {0, 0, -0.1}});
  const Scene scene = OpenWater();
  Plant plant(scene, params, TicksPerTenth(50), Sea());
  Advance(plant, 60);
  EXPECT_NEAR(plant.truth().V_WB_B.v.z(), -TerminalSpeed(0.3 * kGravity_mps2, 8, 70), 1e-6);
}

// The published table: a float trimmed neutral and then ballasted feels the ballast's whole weight.
TEST(Ballast, NetForceIsTheBallastsWeight) {
  for (const auto& [ballast_kg, expected_newton] :
       {std::pair{0.5, -4.905}, {1.0, -9.810}, {3.0, -29.430}}) {
    VehicleParams params = Neutral();
    params.loads.push_back({.mass_kg = ballast_kg, .volume_m3 = 0, .p_BQ_m = {0, 0, 0}});
    const Scene scene = OpenWater();
    Plant plant(scene, params, TicksPerTenth(50), Sea());
    ASSERT_FALSE(plant.Step({}).has_value());
    const double acceleration = plant.truth().V_WB_B.v.z() / 0.002;
    EXPECT_NEAR(acceleration * (15 + ballast_kg + 9), expected_newton, 1e-6) << ballast_kg;
  }
}

TEST(Ballast, OffCentrePayloadTrimsTheVehicle) {
  VehicleParams params = Neutral();
  params.loads.push_back({.mass_kg = 0.4, .volume_m3 = 0.4 / 1025, .p_BQ_m = {0.15, 0, 0}});
  const Scene scene = OpenWater();
  Plant plant(scene, params, TicksPerTenth(50), Sea());
  Advance(plant, 60);
  // Weight and buoyancy are equal, so their centres hang one above the other.
  const Vector3d lever = params.LoadedHydrodynamics().p_BBcb_m - params.LoadedRigidBody().p_BBcm_m;
  EXPECT_NEAR(lever.x(), 0, 1e-9) << "a neutral payload displaces as much as it weighs";
  EXPECT_NEAR((plant.truth().X_WB.q * lever.normalized()).z(), 1, 1e-6);

  params.loads[0].volume_m3 = 0;
  params.hydrodynamics.displaced_volume_m3 = 15.4 / 1025;
  Plant heavy(scene, params, TicksPerTenth(50), Sea());
  Advance(heavy, 60);
  const double expected_rad = std::atan2(0.4 * 0.15 / 15.4, 0.03);
  const Vector3d nose_W = heavy.truth().X_WB.q * Vector3d::UnitX();
  EXPECT_NEAR(std::asin(-nose_W.z()), expected_rad, 1e-5);
  EXPECT_GT(expected_rad, 0.1);
}

TEST(Restoring, RightingMomentGrowsWithTheSineOfTheHeel) {
  const VehicleParams params = Neutral();
  const Scene scene = OpenWater();
  for (const double heel_rad : {0.05, 0.6, 1.5, 3.0}) {
    for (const bool roll : {true, false}) {
      Plant plant(scene, params, TicksPerTenth(50), Sea());
      plant.Reset({roll ? FromYawPitchRoll(0.4, 0, heel_rad) : FromYawPitchRoll(0.4, heel_rad, 0),
                   {0, 0, -5}});
      ASSERT_FALSE(plant.Step({}).has_value());
      const int axis = roll ? 0 : 1;
      const double inertia = roll ? 0.18 + 0.03 : 0.25 + 0.03;
      const double moment = plant.truth().V_WB_B.w[axis] / 0.002 * inertia;
      EXPECT_NEAR(moment, -15 * kGravity_mps2 * 0.03 * std::sin(heel_rad), 1e-6) << heel_rad;
    }
  }
}

// (I + A) x'' + D x' + B g l sin x = 0, small: damped period and logarithmic decrement.
TEST(Restoring, FreeDecayHasItsPeriodAndDamping) {
  const Scene scene = OpenWater();
  for (const bool roll : {true, false}) {
    VehicleParams params = Neutral();
    params.hydrodynamics.quadratic_damping_diagonal.setZero();
    Plant plant(scene, params, {}, Sea());
    const double start_rad = 0.02;  // the sine is straight to 7e-5
    plant.Reset(
        {roll ? FromYawPitchRoll(0, 0, start_rad) : FromYawPitchRoll(0, start_rad, 0), {0, 0, -5}});
    const int axis = roll ? 0 : 1;
    std::vector<double> crossings_s, peaks_rad;
    double last = start_rad, peak = 0;
    for (int i = 1; i < 480 * 12; ++i) {
      ASSERT_FALSE(plant.Step({}).has_value());
      const double angle = 2 * plant.truth().X_WB.q.vec()[axis];
      if (last <= 0 && angle > 0) {
        crossings_s.push_back((i - angle / (angle - last)) / 480);
        peak = 0;
      }
      peak = std::max(peak, angle);
      if (last > 0 && angle <= 0 && !crossings_s.empty()) peaks_rad.push_back(peak);
      last = angle;
    }
    ASSERT_GE(crossings_s.size(), 5u);
    ASSERT_GE(peaks_rad.size(), 4u);
    const double inertia = roll ? 0.18 + 0.03 : 0.25 + 0.03, damping = roll ? 0.1 : 0.15;
    const double decay = damping / (2 * inertia);
    const double omega = std::sqrt(15 * kGravity_mps2 * 0.03 / inertia - decay * decay);
    const double period_s = 2 * std::numbers::pi / omega;
    EXPECT_NEAR((crossings_s[4] - crossings_s[0]) / 4, period_s, 0.005 * period_s);
    EXPECT_NEAR(std::log(peaks_rad[0] / peaks_rad[3]) / 3, decay * period_s,
                0.005 * decay * period_s);
  }
}

TEST(Current, AFreeVehicleEndsUpDriftingWithIt) {
  SeaParams sea;
  sea.current.surface_velocity_mps = {0.1, -0.07, 0};
  const Scene scene = OpenWater();
  Plant plant(scene, Neutral(), TicksPerTenth(50), Sea(sea, SeaStream()));
  plant.Reset({FromYawPitchRoll(0.6, 0, 0), {0, 0, -5}});
  Advance(plant, 120);
  const VehicleTruth now = plant.truth();
  EXPECT_LT((now.X_WB.q * now.V_WB_B.v - sea.current.surface_velocity_mps).norm(),
            0.005 * sea.current.surface_velocity_mps.norm());
}

// Without damping and turning, (m + A) v' = (rho V + A) u': a neutral body follows the water, a
// heavy one lags by the ratio of masses.
TEST(Waves, MoveAnUndampedBodyByTheRatioOfMasses) {
  SeaParams sea;
  sea.random_phases = false;
  sea.waves = {{.height_m = 0.02, .period_s = 2.5, .direction_rad = std::numbers::pi / 2}};
  for (const double volume_share : {1.0, 0.6}) {
    VehicleParams params = WithoutDamping(Neutral());
    params.hydrodynamics.displaced_volume_m3 *= volume_share;
    params.hydrodynamics.p_BBcb_m.setZero();
    // Weight off: only the pressure of the waves counts.
    const Scene scene = OpenWater(kWeightless);
    Plant plant(scene, params, {}, Sea(sea, SeaStream()));
    plant.Reset(Pose::Translation(0, 0, -1));
    const Sea water(sea, SeaStream());
    const double ratio = (15 * volume_share + 10) / (15 + 10);
    const double heave_ratio = (15 * volume_share + 9) / (15 + 9);
    const Vector3d start = water.At({0, 0, -1}, 0).v_W;
    plant.SetVelocity({.v = {0, ratio * start.y(), heave_ratio * start.z()}});
    double worst = 0, largest = 0;
    for (int i = 1; i <= 480 * 5; ++i) {
      ASSERT_FALSE(plant.Step({}).has_value());
      const double expected = ratio * water.At({0, 0, -1}, i / 480.0).v_W.y();
      worst = std::max(worst, std::abs(plant.truth().V_WB_B.v.y() - expected));
      largest = std::max(largest, std::abs(expected));
    }
    // It wanders off the fixed point of the formula by its own small excursions (k times 1 cm: 0.6
    // %), and the step adds w dt / 2 = 0.3 %.
    EXPECT_LT(worst, 0.01 * largest) << volume_share;
  }
}

// ---- A second formulation: Fossen's vector form in Euler angles, by Runge-Kutta ----

struct Euler6 {
  Vector6d eta;  // x, y, z, roll, pitch, yaw (z-y-x)
  Vector6d nu;   // body velocities, SNAME order
};

class FossenReference {
 public:
  FossenReference(const VehicleParams& params, const Sea& sea, const Vector6d& tau)
      : mass_(RigidBodyInertia(params.LoadedRigidBody())),
        added_(Vector6d(params.hydrodynamics.added_mass_diagonal).asDiagonal()),
        params_(params),
        sea_(sea),
        tau_(tau) {
    for (const MatrixEntry& e : params.hydrodynamics.added_mass_coupling)
      added_(static_cast<int>(e.row), static_cast<int>(e.column)) = e.value;
    inverse_ = (mass_ + added_).inverse();
  }

  Euler6 Rate(double t, const Euler6& s) const {
    const double cr = std::cos(s.eta[3]), sr = std::sin(s.eta[3]);
    const double cp = std::cos(s.eta[4]), sp = std::sin(s.eta[4]);
    const double cy = std::cos(s.eta[5]), sy = std::sin(s.eta[5]);
    Matrix3d R, T;
    R << cy * cp, -sy * cr + cy * sp * sr, sy * sr + cy * cr * sp,  //
        sy * cp, cy * cr + sr * sp * sy, -cy * sr + sp * sy * cr,   //
        -sp, cp * sr, cp * cr;
    T << 1, sr * sp / cp, cr * sp / cp, 0, cr, -sr, 0, sr / cp, cr / cp;

    const HydrodynamicsParams& h = params_.hydrodynamics;
    const double weight = params_.rigid_body.mass_kg * kGravity_mps2;
    const double buoyancy = h.water_density_kg_m3 * h.displaced_volume_m3 * kGravity_mps2;
    const WaterMotion water = sea_.At(s.eta.head<3>() + R * h.p_BBcb_m, t);
    const Vector3d flow = R.transpose() * water.v_W, flow_rate = R.transpose() * water.a_W;
    Vector6d nu_c = Vector6d::Zero(), nu_c_dot = Vector6d::Zero();
    nu_c.head<3>() = flow;
    nu_c_dot.head<3>() = flow_rate - Skew(s.nu.tail<3>()) * flow;
    const Vector6d nu_r = s.nu - nu_c;

    // g(eta) in components, z up (Fossen 2011, eq. 4.6 with the signs of these axes).
    Vector6d g;
    const double f = buoyancy - weight;
    const Vector3d& cg = params_.rigid_body.p_BBcm_m;
    const Vector3d lever = cg * weight - h.p_BBcb_m * buoyancy;
    g << f * sp, -f * cp * sr, -f * cp * cr,  //
        lever.y() * cp * cr - lever.z() * cp * sr, -lever.x() * cp * cr - lever.z() * sp,
        lever.x() * cp * sr + lever.y() * sp;

    Vector6d froude_krylov;
    froude_krylov.head<3>() = h.water_density_kg_m3 * h.displaced_volume_m3 * flow_rate;
    froude_krylov.tail<3>() = Skew(h.p_BBcb_m) * froude_krylov.head<3>();
    Vector6d drag;
    for (int i = 0; i < 6; ++i)
      drag[i] =
          (h.linear_damping_diagonal[i] + h.quadratic_damping_diagonal[i] * std::abs(nu_r[i])) *
          nu_r[i];
    Euler6 rate;
    rate.eta << R * s.nu.head<3>(), T * s.nu.tail<3>();
    rate.nu = inverse_ * (tau_ + froude_krylov + added_ * nu_c_dot - Coriolis(mass_, s.nu) * s.nu -
                          Coriolis(added_, nu_r) * nu_r - drag - g);
    return rate;
  }

  Euler6 Step(double t, double dt, const Euler6& s) const {
    const auto shifted = [&](const Euler6& k, double by) {
      return Euler6{s.eta + by * k.eta, s.nu + by * k.nu};
    };
    const Euler6 a = Rate(t, s), b = Rate(t + dt / 2, shifted(a, dt / 2));
    const Euler6 c = Rate(t + dt / 2, shifted(b, dt / 2)), d = Rate(t + dt, shifted(c, dt));
    return {s.eta + dt / 6 * (a.eta + 2 * b.eta + 2 * c.eta + d.eta),
            s.nu + dt / 6 * (a.nu + 2 * b.nu + 2 * c.nu + d.nu)};
  }

 private:
  static Matrix3d Skew(const Vector3d& a) {
    Matrix3d S;
    S << 0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0;
    return S;
  }
  static Matrix6d Coriolis(const Matrix6d& M, const Vector6d& nu) {
    Matrix6d C = Matrix6d::Zero();
    const Matrix3d S = Skew(M.topRows<3>() * nu);
    C.topRightCorner<3, 3>() = -S;
    C.bottomLeftCorner<3, 3>() = -S;
    C.bottomRightCorner<3, 3>() = -Skew(M.bottomRows<3>() * nu);
    return C;
  }

  Matrix6d mass_, added_, inverse_;
  VehicleParams params_;
  Sea sea_;
  Vector6d tau_;
};

// The largest error of position (m) and attitude (rad) over 20 s, and how far the vehicle went.
struct Comparison {
  double position_m = 0, attitude_rad = 0, travelled_m = 0, turned_rad = 0;
};
Comparison AgainstReference(const ClockParams& clock) {
  VehicleParams params = Coupled(VehicleParams());
  params.rigid_body.p_BBcm_m = {0.01, -0.005, -0.01};
  params.rigid_body.inertia_products_kg_m2 = {0.01, -0.02, 0.015};
  SeaParams sea_params;
  sea_params.random_phases = false;
  sea_params.waves = {{.height_m = 0.2, .period_s = 3, .direction_rad = 0.8, .phase_rad = 1}};
  sea_params.current.surface_velocity_mps = {0.05, 0.1, 0};
  const Sea sea(sea_params, SeaStream());
  const Wrench push{.tau = {0.1, -0.2, 0.15}, .f = {3, -2, -1}};
  const Scene scene = OpenWater();
  Plant plant(scene, params, clock, sea);
  plant.Reset({FromYawPitchRoll(0.7, -0.15, 0.2), {0.3, -0.2, -1.5}});
  plant.SetExtraWrench(push);

  const FossenReference reference(params, sea, (Vector6d() << push.f, push.tau).finished());
  Euler6 state{.eta = (Vector6d() << 0.3, -0.2, -1.5, 0.2, -0.15, 0.7).finished(),
               .nu = Vector6d::Zero()};
  Comparison out;
  const double frame_s = clock.frame_s();
  for (int frame = 0; frame < 20 * clock.frames_per_second; ++frame) {
    Advance(plant, frame_s);
    for (int k = 0; k < 8; ++k)
      state = reference.Step(frame * frame_s + k * frame_s / 8, frame_s / 8, state);
    const Pose X_WB = plant.truth().X_WB;
    const Eigen::Quaterniond q = FromYawPitchRoll(state.eta[5], state.eta[4], state.eta[3]);
    out.position_m = std::max(out.position_m, (X_WB.p - state.eta.head<3>()).norm());
    out.attitude_rad = std::max(out.attitude_rad, AngleBetween(X_WB.q, q));
    out.travelled_m = std::max(out.travelled_m, (X_WB.p - Vector3d(0.3, -0.2, -1.5)).norm());
    out.turned_rad =
        std::max(out.turned_rad, AngleBetween(X_WB.q, FromYawPitchRoll(0.7, -0.15, 0.2)));
  }
  return out;
}

TEST(Waves, ResponseAgreesWithAnIndependentIntegration) {
  const Comparison at_tick = AgainstReference({});  // 1/480 s
  EXPECT_GT(at_tick.travelled_m, 1);
  EXPECT_GT(at_tick.turned_rad, 0.5);
  EXPECT_LT(at_tick.position_m, 0.005 * at_tick.travelled_m);
  EXPECT_LT(at_tick.attitude_rad, 0.005 * at_tick.turned_rad);
  // What is left is the step's first-order error, not a difference of models.
  const Comparison at_fifth = AgainstReference({.frames_per_second = 30, .ticks_per_frame = 80});
  EXPECT_NEAR(at_tick.position_m / at_fifth.position_m, 5, 1);
  EXPECT_NEAR(at_tick.attitude_rad / at_fifth.attitude_rad, 5, 1);
  RecordProperty("attitude_error_share", std::to_string(at_tick.attitude_rad / at_tick.turned_rad));
  RecordProperty("position_error_share", std::to_string(at_tick.position_m / at_tick.travelled_m));
}

// ---- Thrusters and contact ----

TEST(Thrust, ActsAtItsMount) {
  VehicleParams params = WithoutDamping(Neutral());
  params.thrusters.lag_s = 0;
  const Scene scene = OpenWater();
  Plant plant(scene, params, TicksPerTenth(50), Sea());
  // The left surge thruster alone: forward and a turn to the right.
  ThrusterCommand command;
  command.volts[0] = 5;
  ASSERT_FALSE(plant.Step(command).has_value());
  Twist V = plant.truth().V_WB_B;
  EXPECT_NEAR(V.v.x() / 0.002, 4.9 / 21, 1e-9);
  EXPECT_NEAR(V.w.z() / 0.002, -4.9 * 0.10 / 0.28, 1e-9);
  command.volts = {2.5, 2.5, 5, 0};
  plant.Reset(Pose::Translation(0, 0, -5));
  ASSERT_FALSE(plant.Step(command).has_value());
  V = plant.truth().V_WB_B;
  EXPECT_NEAR(V.v.y() / 0.002, 4.9 / 25, 1e-9);
  EXPECT_NEAR(V.v.z() / 0.002, -0.9 * 4.9 / 24, 1e-9);
  EXPECT_NEAR(V.w.norm(), 0, 1e-9);
}

// B g l sin(theta) = F d: the vehicle then moves along its own x axis, where drag has no moment.
TEST(Thrust, BelowTheCentreOfMassPitchesTheVehicle) {
  std::string body = testing::kVehicleBody;
  for (const std::string place : {"-0.13 0.10 0", "-0.13 -0.10 0"})
    body.replace(body.find(place), place.size(), place.substr(0, place.size() - 1) + "-0.05");
  VehicleParams params = Neutral();
  params.thrusters.inflow_loss_s_per_m = 0;
  // Equal in all directions: the Munk moment would turn the vehicle out of its course, which has no
  // fin.
  params.hydrodynamics.added_mass_diagonal.head<3>().setConstant(6);
  const Scene scene = testing::MakeScene(body);
  Plant plant(scene, params, TicksPerTenth(50), Sea());
  plant.Reset(Pose::Translation(0, 0, -50));
  for (int i = 0; i < 500 * 60; ++i)
    ASSERT_FALSE(plant.Step({.volts = {5, 5, 2.5, 2.5}}).has_value());
  const double nose_up = (plant.truth().X_WB.q * Vector3d::UnitX()).z();
  EXPECT_NEAR(nose_up, 2 * 4.9 * 0.05 / (15 * kGravity_mps2 * 0.03), 1e-6);
}

// The left thruster sits 0.10 m left of the middle: turning left it moves back, against a current
// forward.
TEST(Thrust, IsLostToTheFlowAtEachMount) {
  VehicleParams params = Neutral();
  params.thrusters.lag_s = 0;
  SeaParams sea;
  sea.current.surface_velocity_mps = {-0.2, 0, 0};
  const Scene scene = OpenWater();
  Plant plant(scene, params, TicksPerTenth(50), Sea(sea, SeaStream()));
  plant.SetVelocity({.w = {0, 0, 0.5}, .v = {0.1, 0, 0}});
  ASSERT_FALSE(plant.Step({.volts = {5, 5, 2.5, 2.5}}).has_value());
  const ThrusterForces thrust = plant.truth().thrust_newton;
  EXPECT_NEAR(thrust[0], 4.9 * (1 - 0.3 * (0.1 + 0.2 - 0.05)), 1e-12);
  EXPECT_NEAR(thrust[1], 4.9 * (1 - 0.3 * (0.1 + 0.2 + 0.05)), 1e-12);
}

TEST(Tether, TurnsTheVehicleAndTradesEnergyLikeASpring) {
  VehicleParams params = WithoutDamping(Neutral());
  SeaParams sea;
  sea.tether = {.enabled = true,
                .p_BQ_m = {-0.2, 0.1, 0},
                .p_WAnchor_m = {-5.2, 0.1, -5},
                .length_m = 4.8,
                .drag_coefficient = 0,
                .net_weight_newton_per_m = 0,
                .stiffness_newton_per_m = 50,
                .stretch_damping_newton_s_per_m = 0};
  const Scene scene = OpenWater();
  Plant plant(scene, params, TicksPerTenth(200), Sea(sea, SeaStream()));
  ASSERT_FALSE(plant.Step({}).has_value());
  // Stretched by 0.2 m: 10 N backwards, 0.1 m left of the middle.
  EXPECT_NEAR(plant.truth().V_WB_B.v.x() / 0.0005, -10.0 / 21, 1e-9);
  EXPECT_NEAR(plant.truth().V_WB_B.w.z() / 0.0005, 10 * 0.1 / 0.28, 1e-9);
  Advance(plant, 0.5);
  const Pose X_WB = plant.truth().X_WB;
  const double stretch_m =
      std::max(0.0, (X_WB * sea.tether.p_BQ_m - sea.tether.p_WAnchor_m).norm() - 4.8);
  const double released_joule = 0.5 * 50 * (0.2 * 0.2 - stretch_m * stretch_m);
  EXPECT_GT(released_joule, 0.1);
  EXPECT_NEAR(plant.energy().tether_work, released_joule, 0.005 * released_joule);
  EXPECT_NEAR(plant.energy().kinetic_change + plant.energy().potential_change, released_joule,
              0.005 * released_joule);
}

TEST(Contact, PushingAgainstADockBalancesTheThrust) {
  const std::string dock =
      R"(<geom name="dock_face" type="box" size="0.05 0.5 0.5" pos="0.6 0 -5.11"/>
         <site name="dock_mouth" pos="0.55 0 -5.11"/>)";
  VehicleParams params = Neutral();
  params.hydrodynamics.p_BBcb_m.z() = 1;  // stiff in pitch: it stays square to the face
  const Scene scene = testing::MakeScene(testing::kVehicleBody + dock);
  Plant plant(scene, params, {}, Sea());
  plant.SetExtraWrench({.tau = {0, -0.11 * 4, 0}, .f = {4, 0, 0}});  // as if at the pole
  bool touched_before = false;
  double first_contact_s = -1;
  for (int i = 0; i < 480 * 20; ++i) {
    ASSERT_FALSE(plant.Step({}).has_value());
    const bool touches = plant.contacts().dock_force_newton > 0;
    if (touches && !touched_before) {
      touched_before = true;
      first_contact_s = plant.time_s();
    }
  }
  EXPECT_GT(first_contact_s, 0.3);  // 5 cm under 4 N on 21 kg: 0.73 s without drag
  EXPECT_LT(first_contact_s, 2);
  EXPECT_NEAR(plant.contacts().dock_force_newton, 4, 0.005 * 4);
  EXPECT_EQ(plant.contacts().collision, "");
  EXPECT_NEAR(plant.pole().insertion_depth_m, 0, 0.003);
}

}  // namespace
}  // namespace turbidock::sim
