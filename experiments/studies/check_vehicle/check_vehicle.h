#pragma once
// What a vehicle's builder wants to know before the first trial: does it float, which way does each
// thruster push, how fast does it get, does it hold the scenario's current, does it see the marker,
// does its pole reach the hole, and does it dock when it sees perfectly.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "control/axes.h"
#include "experiments/report/report.h"
#include "experiments/studies/check_vehicle/vehicle_physics.h"
#include "experiments/trial/scenario.h"
#include "sim/base/result_fields.h"
#include "sim/vehicle/plant.h"

namespace turbidock::check_vehicle {

struct ThrusterReport {
  std::string name;
  Eigen::Vector3d p_BT_m = Eigen::Vector3d::Zero(), axis_B = Eigen::Vector3d::Zero();
  double forward_newton = 0, reverse_newton = 0;  // at full voltage, as effective as it is
  std::string drives;                             // "surge +, yaw -": signs of a forward push

  TURBIDOCK_FIELDS(name, p_BT_m, axis_B, forward_newton, reverse_newton, drives)
};

// What can touch of the hull, or the pole, in B: points that its convex hull goes through, and the
// box around them.
struct HullReport {
  std::string part;
  std::vector<Eigen::Vector3d> points_m = {};
  Eigen::Vector3d low_m = Eigen::Vector3d::Constant(INFINITY), high_m = -low_m;

  TURBIDOCK_FIELDS(part, low_m, high_m)
};

// Ahead, left, up, counter-clockwise; and the other way, negative. N, N m, m/s, rad/s.
struct AxisReport {
  std::string axis;
  double most = 0, most_back = 0;
  double speed = 0, speed_back = 0;
  double roll_rad = 0, pitch_rad = 0;  // at full speed ahead
  double load = 0;                     // most that the scenario's sea asks for; no figure for yaw

  double tilt_rad() const { return std::max(std::abs(roll_rad), std::abs(pitch_rad)); }
  TURBIDOCK_FIELDS(axis, most, most_back, speed, speed_back, roll_rad, pitch_rad, load)
};

// The marker in the images where the procedure has the vehicle in front of it.
struct ViewReport {
  std::string place;     // "servoing", "docked"
  Pose X_HM;             // as `procedure.servo_*` and `docked_x_m` say
  double x_m = 0;        // of it
  double margin_px = 0;  // from the nearest ball's edge to the nearest image border; negative: out
  std::string nearest;   // "blue in the left image"
  double hidden = 0;     // most of a ball that is behind a part of the vehicle, as a share of it
  std::string hides;     // "hull_arm hides red in the left image"

  TURBIDOCK_FIELDS(place, x_m, margin_px, nearest, hidden, hides)
};

// The first thing that the vehicle touches on its straight way from servoing to docked, but for the
// pole in the dock.
struct CollisionReport {
  std::string what;  // "hull_box against dock_lead_right"; empty: nothing
  double x_m = 0;    // of the marker in the camera head

  TURBIDOCK_FIELDS(what, x_m)
};

// The pole's tip at the docked pose, in the dock's frame.
struct PoleReport {
  double depth_m = 0;        // past the mouth
  double past_throat_m = 0;  // past where the straight hole begins
  double aside_m = 0, above_m = 0;
  double clearance_m = 0;   // between pole and hole, all around
  bool meets_dock = false;  // they can touch
  double beyond_tip_m = 0;  // how far its parts reach past its tip along x_H, negative: short of it

  TURBIDOCK_FIELDS(depth_m, past_throat_m, aside_m, above_m, clearance_m, meets_dock, beyond_tip_m)
};

// Trials on the true pose, from where the scenario begins them.
struct FlightReport {
  int flown = 0, docked = 0;
  std::string end;  // of the first that did not dock, in words

  TURBIDOCK_FIELDS(flown, docked, end)
};

struct VehicleCheck {
  std::string vehicle, scenario;
  std::string mjcf, data;  // its files
  double mass_kg = 0;      // with its loads
  bool levels = false;     // its thrusters roll and pitch it
  std::string refusal;     // what `run` says of it, if it refuses
  Floating floating;
  std::vector<HullReport> hull;
  std::vector<ThrusterReport> thrusters;
  std::vector<AxisReport> axes;
  std::vector<ViewReport> views;
  PoleReport pole;
  CollisionReport collision;
  FlightReport flights;               // none where `run` refuses it
  std::vector<std::string> problems;  // with which it cannot dock
  std::vector<std::string> warnings;

  Eigen::Vector3d hull_size_m() const { return hull[0].high_m - hull[0].low_m; }
  TURBIDOCK_FIELDS(vehicle, scenario, mjcf, data, mass_kg, levels, refusal, floating, hull,
                   thrusters, axes, views, pole, collision, flights, problems, warnings)
};

// Of the scenario's vehicle as `vehicle` describes it, before its station and in its sea.
// ConfigError for a vehicle that is none, or sinks (rises) faster than its thrusters hold;
// SimulatorFault when nothing can be drawn.
VehicleCheck CheckVehicle(const trial::Scenario& scenario);

// Its parts: at_dock.cc. `plant` is moved about.
std::vector<ViewReport> ReportViews(const trial::Scenario& scenario, const vehicle::Scene& scene,
                                    vehicle::Plant* plant);
PoleReport ReportPole(const vehicle::Scene& scene, const HullReport& pole, const Pose& X_HM_docked);
CollisionReport ReportCollision(const vehicle::Scene& scene, const Pose& X_HM_servoing,
                                const Pose& X_HM_docked, vehicle::Plant* plant);
// judge.cc: in words, from all the rest.
void Judge(const trial::Scenario& scenario, const vehicle::Scene& scene, VehicleCheck* check);
// "5 mm to the left and 0 mm above".
std::string BesideText(double aside_m, double above_m);

// What is wrong, how it floats, what it sees; its thrusters, their forces and the speeds they
// reach.
report::Report ReportOf(const VehicleCheck& check);

}  // namespace turbidock::check_vehicle
