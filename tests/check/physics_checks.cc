#include "tests/check/physics_checks.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/vehicle/plant.h"
#include "tests/check/fossen_reference.h"
#include "tests/check/physics_cases.h"
#include "tests/check/simple_scene.h"

namespace turbidock::check {
namespace {

using Eigen::Vector3d;
using vehicle::Dof;
using vehicle::Plant;
using vehicle::Scene;
using vehicle::Sea;
using vehicle::SeaParams;
using vehicle::SeaState;
using vehicle::Vector6d;
using vehicle::VehicleParams;

// Of quantities that the step has no part in: rounding, accumulated over many steps.
constexpr double kRounding = 1e-6;

double InertiaAbout(int axis, const VehicleParams& params) {
  return params.rigid_body.inertia_kg_m2[axis] + params.hydrodynamics.added_mass_diagonal[3 + axis];
}

// Of a neutral vehicle: restoring moment per sine of the heel.
double Stiffness(const VehicleParams& params) {
  return params.rigid_body.mass_kg * kGravity_mps2 * params.hydrodynamics.p_BBcb_m.z();
}

// ---- Drag and weight ----

// F = D v + D_q v^2, in any unit.
double TerminalSpeed(double force, double linear, double quadratic) {
  return (-linear + std::sqrt(linear * linear + 4 * quadratic * force)) / (2 * quadratic);
}

// Along an axis of symmetry from exact rest nothing turns the vehicle out of its course; 60 s are
// many time constants, and a balance of forces has no step error.
void TerminalVelocity(const Scene& scene, Report* report) {
  const VehicleParams params = Neutral();
  const auto& hydro = params.hydrodynamics;
  for (const int axis : {0, 1, 2, 5}) {
    Plant plant(scene, params, kTick2ms, Sea());
    plant.Reset(Pose::Translation(0, 0, -1000));
    const double force = axis < 3 ? 4.9 : 0.5;
    Vector6d push = force * Vector6d::Unit(axis);
    plant.SetExtraWrench({.tau = push.tail<3>(), .f = push.head<3>()});
    Advance(plant, 60);
    const Twist V = plant.truth().V_WB_B;
    const double expected = TerminalSpeed(force, hydro.linear_damping_diagonal[axis],
                                          hydro.quadratic_damping_diagonal[axis]);
    report->Near(std::string("terminal velocity, ") + NameOf(static_cast<Dof>(axis)),
                 "F = D v + D_q v^2", axis < 3 ? "m/s" : "rad/s",
                 axis < 3 ? V.v[axis] : V.w[axis - 3], expected, kRounding * expected);
  }

  VehicleParams ballasted = params;
  ballasted.loads.push_back({.mass_kg = 0.3, .volume_m3 = 0, .p_BQ_m = {0, 0, -0.1}});
  Plant sinking(scene, ballasted, kTick2ms, Sea());
  Advance(sinking, 60);
  const double expected = TerminalSpeed(0.3 * kGravity_mps2, hydro.linear_damping_diagonal[2],
                                        hydro.quadratic_damping_diagonal[2]);
  report->Near("sinking with 0.3 kg of ballast", "m g = D v + D_q v^2", "m/s",
               -sinking.truth().V_WB_B.v.z(), expected, kRounding * expected);
}

// A float trimmed neutral and then loaded feels the load's whole weight less what it displaces.
void Ballast(const Scene& scene, Report* report) {
  struct Load {
    double mass_kg, volume_m3;
  };
  for (const Load& load : {Load{0.5, 0}, {1, 0}, {3, 0}, {0.2, 0.001}}) {
    VehicleParams params = Neutral();
    params.loads.push_back(
        {.mass_kg = load.mass_kg, .volume_m3 = load.volume_m3, .p_BQ_m = {0, 0, 0}});
    Plant plant(scene, params, kTick2ms, Sea());
    Step(plant);
    const double mass_kg =
        15 + load.mass_kg + params.hydrodynamics.added_mass_diagonal[static_cast<int>(Dof::kHeave)];
    const double force_newton = plant.truth().V_WB_B.v.z() / kTick2ms.dt_s() * mass_kg;
    const std::string name = load.volume_m3 > 0
                                 ? "float of 1 l, net force"
                                 : "ballast of " + FormatNumber(load.mass_kg) + " kg, net force";
    report->Near(name, "(rho V - m) g", "N", force_newton,
                 (1025 * load.volume_m3 - load.mass_kg) * kGravity_mps2, kRounding);
  }
}

// With equal weight and buoyancy, their centres come to hang one above the other.
void Trim(const Scene& scene, Report* report) {
  const auto nose_up_rad = [&](double payload_volume_m3) {
    VehicleParams params = Neutral();
    params.loads.push_back(
        {.mass_kg = 0.4, .volume_m3 = payload_volume_m3, .p_BQ_m = {0.15, 0, 0}});
    params.hydrodynamics.displaced_volume_m3 = 15.4 / 1025 - payload_volume_m3;
    Plant plant(scene, params, kTick2ms, Sea());
    Advance(plant, 60);
    return std::asin((plant.truth().X_WB.q * Vector3d::UnitX()).z());
  };
  report->Near("heavy payload 0.15 m ahead, trim", "centres in line", "rad", nose_up_rad(0),
               -std::atan2(0.4 * 0.15 / 15.4, 0.03), 1e-5);
  report->Near("neutral payload 0.15 m ahead, trim", "no moment", "rad", nose_up_rad(0.4 / 1025), 0,
               1e-5);
}

// ---- Righting ----

Pose Heeled(bool roll, double angle_rad) {
  return {roll ? FromYawPitchRoll(0.4, 0, angle_rad) : FromYawPitchRoll(0.4, angle_rad, 0),
          {0, 0, -5}};
}

void RightingMoment(const Scene& scene, Report* report) {
  const VehicleParams params = Neutral();
  for (const bool roll : {true, false}) {
    for (const double heel_rad : {0.05, 0.6, 1.5}) {
      Plant plant(scene, params, kTick2ms, Sea());
      plant.Reset(Heeled(roll, heel_rad));
      Step(plant);
      const int axis = roll ? 0 : 1;
      const double moment =
          plant.truth().V_WB_B.w[axis] / kTick2ms.dt_s() * InertiaAbout(axis, params);
      report->Near(std::string("righting moment, ") + (roll ? "roll " : "pitch ") +
                       FormatNumber(heel_rad) + " rad",
                   "-B l sin", "N m", moment, -Stiffness(params) * std::sin(heel_rad), kRounding);
    }
  }
}

// (I + A) x'' + D x' + B l sin x = 0 for small x: damped period and logarithmic decrement.
void FreeDecay(const Scene& scene, Report* report) {
  VehicleParams params = Neutral();
  params.hydrodynamics.quadratic_damping_diagonal.setZero();
  for (const bool roll : {true, false}) {
    constexpr double kStart_rad = 0.02;  // the sine is straight to 7e-5
    constexpr size_t kSwings = 4;
    const int axis = roll ? 0 : 1;
    const ClockParams clock;
    Plant plant(scene, params, clock, Sea());
    plant.Reset(Heeled(roll, kStart_rad));
    const Eigen::Quaterniond q_level = FromYawPitchRoll(0.4, 0, 0);
    std::vector<double> crossings_s, peaks_rad;  // upwards through level, and the peak before each
    double last = kStart_rad, peak = 0;
    while (crossings_s.size() <= kSwings && plant.time_s() < 20) {
      Step(plant);
      const double angle = 2 * (q_level.conjugate() * plant.truth().X_WB.q).vec()[axis];
      peak = std::max(peak, -angle);
      if (last <= 0 && angle > 0) {
        crossings_s.push_back(plant.time_s() - clock.dt_s() * angle / (angle - last));
        peaks_rad.push_back(std::exchange(peak, 0));
      }
      last = angle;
    }
    if (crossings_s.size() <= kSwings) throw SimulatorFault("the vehicle does not swing");
    const double inertia = InertiaAbout(axis, params);
    const double decay = params.hydrodynamics.linear_damping_diagonal[3 + axis] / (2 * inertia);
    const double omega = std::sqrt(Stiffness(params) / inertia - decay * decay);
    const double period_s = 2 * std::numbers::pi / omega;
    const std::string name = roll ? "free decay, roll " : "free decay, pitch ";
    report->Near(name + "period", "damped pendulum", "s",
                 (crossings_s[kSwings] - crossings_s[0]) / kSwings, period_s,
                 kHalfPercent * period_s);
    report->Near(name + "decrement", "damped pendulum", "",
                 std::log(peaks_rad[0] / peaks_rad[kSwings]) / kSwings, decay * period_s,
                 kHalfPercent * decay * period_s);
  }
}

// ---- Moving water ----

void DriftWithACurrent(const Scene& scene, Report* report) {
  const Vector3d current(0.1, -0.07, 0);
  SeaParams sea;
  sea.current.surface_velocity_mps = current;
  Plant plant(scene, Neutral(), kTick2ms, Sea(sea, SeaStream()));
  plant.Reset({FromYawPitchRoll(0.6, 0, 0), {0, 0, -5}});
  Advance(plant, 120);
  const vehicle::VehicleTruth now = plant.truth();
  const Vector3d v_W = now.X_WB.q * now.V_WB_B.v;
  for (const int axis : {0, 1})
    report->Near(std::string("drift with a current, ") + "xy"[axis], "the current, after 120 s",
                 "m/s", v_W[axis], current[axis], kHalfPercent * current.norm());
}

// The largest differences from the reference over 20 s, and how far that went.
struct Comparison {
  double position_m = 0, attitude_rad = 0, travelled_m = 0, turned_rad = 0;
};

Comparison InAWave(const Scene& scene, const ClockParams& clock) {
  VehicleParams params = Coupled(VehicleParams());
  params.rigid_body.p_BBcm_m = {0.01, -0.005, -0.01};
  params.rigid_body.inertia_products_kg_m2 = {0.01, -0.02, 0.015};
  SeaParams sea_params;
  sea_params.random_phases = false;
  sea_params.waves = {{.height_m = 0.2, .period_s = 3, .direction_rad = 0.8, .phase_rad = 1}};
  sea_params.current.surface_velocity_mps = {0.05, 0.1, 0};
  const Sea sea(sea_params, SeaStream());
  const Wrench push{.tau = {0.1, -0.2, 0.15}, .f = {3, -2, -1}};

  FossenReference reference(params, sea);
  reference.SetState({.eta = (Vector6d() << 0.3, -0.2, -1.5, 0.2, -0.15, 0.7).finished()});
  reference.SetExtraWrench(push);
  const Pose start = reference.X_WB();
  Plant plant(scene, params, clock, sea);
  plant.Reset(start);
  plant.SetExtraWrench(push);

  Comparison out;
  for (int frame = 0; frame < 20 * clock.frames_per_second; ++frame) {
    Advance(plant, clock.frame_s());
    for (int k = 0; k < 4; ++k) reference.Step(clock.frame_s() / 4);
    const Pose got = plant.truth().X_WB, expected = reference.X_WB();
    out.position_m = std::max(out.position_m, (got.p - expected.p).norm());
    out.attitude_rad = std::max(out.attitude_rad, AngleBetween(got.q, expected.q));
    out.travelled_m = std::max(out.travelled_m, (expected.p - start.p).norm());
    out.turned_rad = std::max(out.turned_rad, AngleBetween(expected.q, start.q));
  }
  return out;
}

void WaveResponse(const Scene& scene, Report* report) {
  const Comparison at_tick = InAWave(scene, {});
  const Comparison at_fifth = InAWave(scene, {.frames_per_second = 30, .ticks_per_frame = 80});
  const std::string reference = "Runge-Kutta, own equations, 20 s";
  report->AtMost("wave response, position off", reference, "m", at_tick.position_m,
                 kHalfPercent * at_tick.travelled_m);
  report->AtMost("wave response, attitude off", reference, "rad", at_tick.attitude_rad,
                 kHalfPercent * at_tick.turned_rad);
  // What is left is the step's error, not a difference of models.
  report->Near("wave response, position at a fifth of the step", "first order", "",
               at_tick.position_m / at_fifth.position_m, 5, 1);
  report->Near("wave response, attitude at a fifth of the step", "first order", "",
               at_tick.attitude_rad / at_fifth.attitude_rad, 5, 1);
}

// ---- Thrusters and energy ----

// Full ahead for 0.5 s, then full astern, compared every 10 ms.
void ThrusterLag(const Scene& scene, Report* report) {
  VehicleParams params;
  params.thrusters.inflow_loss_s_per_m = 0;
  const vehicle::ThrusterParams& thrusters = params.thrusters;
  const double ahead = thrusters.max_thrust_newton, astern = -thrusters.reverse_ratio * ahead;
  const double turned = ahead * (1 - std::exp(-0.5 / thrusters.lag_s));
  for (const int ticks_per_sample : {10, 5, 2}) {
    Plant plant(scene, params, {.frames_per_second = 100, .ticks_per_frame = ticks_per_sample},
                Sea());
    double worst_newton = 0;
    for (int sample = 1; sample <= 100; ++sample) {
      const double volts = sample <= 50 ? kMaxVolts : 0, t_s = 0.01 * sample;
      Advance(plant, 0.01, {.volts = {volts, volts, kNeutralVolts, kNeutralVolts}});
      const double expected =
          sample <= 50 ? ahead * (1 - std::exp(-t_s / thrusters.lag_s))
                       : astern + (turned - astern) * std::exp(-(t_s - 0.5) / thrusters.lag_s);
      worst_newton = std::max(worst_newton, std::abs(plant.truth().thrust_newton[0] - expected));
    }
    report->AtMost("thruster lag, " + std::to_string(10 / ticks_per_sample) + " ms, thrust off",
                   "1 - exp(-t / tau), every 10 ms", "N", worst_newton, 1e-12);
  }
}

// Every joule is accounted for up to the integrator's error: rough sea, tether, swaying under
// thrust, sliding along a wall.
double UnexplainedShare(int ticks_per_frame) {
  SeaParams sea{.state = SeaState::kRough, .random_phases = false};
  sea.current.surface_velocity_mps = {0.05, 0.08, 0};
  sea.tether.enabled = true;
  VehicleParams params;
  params.rigid_body.p_BBcm_m = {0.01, 0, -0.01};
  Couple(Dof::kSway, Dof::kRoll, 0.3, &params);
  const Scene scene =
      MakeScene(std::string(kVehicleBody) +
                R"(<geom name="wall" type="box" size="0.1 3 3" pos="1.0 0 -1" solref="0.05 1"/>)");
  Plant plant(scene, params, {.frames_per_second = 30, .ticks_per_frame = ticks_per_frame},
              Sea(sea, SeaStream()));
  plant.Reset(Pose::Translation(0, 0, -1));
  for (int frame = 0; frame < 30 * 20; ++frame) {
    const double swing = std::sin(0.05 * frame);
    Advance(plant, 1.0 / 30,
            {.volts = {4.3 + 0.4 * swing, 4.3 - 0.4 * swing, 2.5 + 2 * swing, 2.5 - 1.5 * swing}});
  }
  const vehicle::EnergyBalance energy = plant.energy();
  if (!(energy.contact_work < 0 && energy.drag_loss > 1 && energy.thruster_work > 1 &&
        std::abs(energy.water_work) > 0.1 && energy.tether_work != 0))
    throw SimulatorFault("not every kind of force did work");
  return std::abs(energy.residual()) / energy.turnover();
}

void Energy(const Scene&, Report* report) {
  const double at_tick = UnexplainedShare(16), at_quarter = UnexplainedShare(64);
  report->AtMost("energy unexplained, rough sea and a wall", "of the turnover; 1/480 s, 20 s", "",
                 at_tick, 1e-3);
  report->Near("energy unexplained at a quarter of the step", "first order", "",
               at_tick / at_quarter, 4, 1);
}

}  // namespace

bool PhysicsCheck::pass() const {
  if (relation == Relation::kNear) return std::abs(measured - expected) <= tolerance;
  return measured <= expected;
}

std::vector<PhysicsCheck> RunPhysicsChecks() {
  constexpr std::pair<const char*, void (*)(const Scene&, Report*)> kCases[] = {
      {"free motion", FreeMotion},
      {"anisotropic added mass", AnisotropicAddedMass},
      {"heavy added mass", HeavyAddedMass},
      {"terminal velocity", TerminalVelocity},
      {"ballast", Ballast},
      {"trim", Trim},
      {"righting moment", RightingMoment},
      {"free decay", FreeDecay},
      {"drift with a current", DriftWithACurrent},
      {"wave response", WaveResponse},
      {"thruster lag", ThrusterLag},
      {"energy", Energy},
  };
  const Scene scene = OpenWater();
  Report all;
  for (const auto& [name, run] : kCases) {
    const size_t before = all.checks.size();
    try {
      run(scene, &all);
    } catch (const SimulatorFault& fault) {
      all.checks.resize(before);
      all.Near(name, fault.what(), "", std::numeric_limits<double>::quiet_NaN(), 0, 0);
    }
  }
  return all.checks;
}

}  // namespace turbidock::check
