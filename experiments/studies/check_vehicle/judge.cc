#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/report/table.h"
#include "experiments/studies/check_vehicle/check_vehicle.h"
#include "experiments/trial/world.h"
#include "sim/base/units.h"
#include "sim/vehicle/model_files.h"

namespace turbidock::check_vehicle {
namespace {

using Eigen::Vector3d;
using vehicle::Dof;

// Beyond these there is a warning.
constexpr double kMuchTrim_rad = 0.05, kMuchTilt_rad = 0.09;
constexpr double kMuchBuoyancy = 0.3, kMuchLoad = 0.7;  // of the thrusters' most force
constexpr double kLittleMargin_px = 20;
constexpr double kCameraApart_m = 0.002;                    // more than files round to
constexpr double kPoleApart_m = 0.01;                       // a rounded end may lie beyond its tip
constexpr double kLittleHidden = 0.05, kMostHidden = 0.33;  // as much the estimator does without

double Deg(double rad) { return units::DegFromRad(rad); }

// The keys that the vehicle's data do not give, by which it is the published vehicle.
std::vector<std::string> KeysLeftOut(const std::string& vehicle_model) {
  const bool is_path = vehicle_model.find('/') != std::string::npos;
  const std::filesystem::path mjcf = is_path ? vehicle_model : config::ModelPath(vehicle_model);
  vehicle::VehicleParams data;
  config::Origins given;
  config::ReadFields(
      config::LoadYaml(std::filesystem::path(mjcf).replace_extension(".yaml").string()), &data,
      &given);
  // A curve is given by its table or by four numbers; most vehicles have no couplings, no loads.
  const bool has_table = given.contains("thrusters.table_volts");
  const auto may_lack = [has_table](const std::string& key) {
    constexpr std::array kCurve = {"thrusters.max_thrust_newton", "thrusters.reverse_ratio",
                                   "thrusters.dead_band_volts", "thrusters.curve_exponent"};
    return key.ends_with("coupling") || key.find("[]") != std::string::npos ||
           key.find("products") != std::string::npos || key.starts_with("thrusters.table") ||
           key == "thrusters.rate_limit_newton_per_s" || key == "thrusters.lag_power" ||
           key == "thrusters.dead_time_s" || key == "thrusters.effectiveness" ||
           key == "thrusters.individual" || key == "loads" ||
           (has_table && std::find(kCurve.begin(), kCurve.end(), key) != kCurve.end());
  };
  std::vector<std::string> left_out;
  for (const config::KeyDoc& doc : config::ListKeys<vehicle::VehicleParams>())
    if (!doc.value.empty() && !may_lack(doc.key) && !given.contains(doc.key))
      left_out.push_back(doc.key);
  return left_out;
}

// In words, by what they are about.
class Judgement {
 public:
  Judgement(const trial::Scenario& scenario, const vehicle::Scene& scene, VehicleCheck* check)
      : scenario_(scenario), scene_(scene), check_(*check) {}

  void OfFiles();
  void OfCameras();
  void OfHull();
  void OfFloating();
  void OfAxes();
  void OfViews();
  void OfDocking();

 private:
  void Problem(std::string text) { check_.problems.push_back(std::move(text)); }
  void Warn(std::string text) { check_.warnings.push_back(std::move(text)); }

  const trial::Scenario& scenario_;
  const vehicle::Scene& scene_;
  VehicleCheck& check_;
};

// What the MJCF says beside the data, which count.
void Judgement::OfFiles() {
  const std::vector<std::string> left_out = KeysLeftOut(scenario_.vehicle_model);
  if (!left_out.empty())
    Warn(fmt::format("its data leave out {}: there it is as the published vehicle",
                     fmt::join(left_out, ", ")));
  const mjModel& m = *scene_.model;
  const vehicle::RigidBodyParams& body = scenario_.known_vehicle.rigid_body;
  const auto differs = [](double a, double b, double share) {
    return std::abs(a - b) > share * std::max(std::abs(a), std::abs(b));
  };
  const auto warn = [&](const std::string& what, const std::string& mjcf, const std::string& data) {
    Warn(fmt::format("{} has {} of {}, {} of {}, which counts", check_.mjcf, what, mjcf,
                     check_.data, data));
  };
  const double mass_kg = m.body_subtreemass[scene_.vehicle_body];
  if (differs(mass_kg, body.mass_kg, 0.02))
    warn("a mass", fmt::format("{:.4g} kg", mass_kg), fmt::format("{:.4g} kg", body.mass_kg));
  Vector3d in_mjcf = Vector3d::Map(m.body_inertia + 3 * scene_.vehicle_body);
  std::ranges::sort(in_mjcf);
  const Vector3d in_data =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(body.Inertia()).eigenvalues();
  if (differs(in_mjcf.norm(), in_data.norm(), 0.05))
    warn("principal moments",
         fmt::format("{:.3g}, {:.3g} and {:.3g} kg m^2", in_mjcf[0], in_mjcf[1], in_mjcf[2]),
         fmt::format("{:.3g}, {:.3g} and {:.3g}", in_data[0], in_data[1], in_data[2]));
  OfCameras();
  const double height_m = check_.hull_size_m().z(),
               said_m = scenario_.known_vehicle.hydrodynamics.hull_height_m;
  if (differs(height_m, said_m, 0.4))
    warn("a hull", fmt::format("{:.3g} m in height", height_m), fmt::format("{:.3g} m", said_m));
}

// Where the MJCF has its cameras, before the rig's data moved them.
void Judgement::OfCameras() {
  const vehicle::MjModelPtr model = vehicle::ReadModel(trial::SceneFilesOf(scenario_));
  const auto text = [](const Vector3d& p) {
    return fmt::format("({:.3f}, {:.3f}, {:.3f}) m", p.x(), p.y(), p.z());
  };
  for (const auto& [camera, side] :
       {std::pair{scene_.left_camera, "left"}, std::pair{scene_.right_camera, "right"}}) {
    const Vector3d drawn = Vector3d::Map(model->cam_pos + 3 * camera),
                   placed = Vector3d::Map(scene_.model->cam_pos + 3 * camera);
    if ((drawn - placed).norm() > kCameraApart_m)
      Warn(fmt::format("{} has the {} camera at {}, cameras.rig puts it at {}, which counts",
                       check_.mjcf, side, text(drawn), text(placed)));
  }
}

// Whether its parts can be those of one body: what is in other units is far from that.
void Judgement::OfHull() {
  const Vector3d size_m = check_.hull_size_m();
  const auto require_near = [&](const std::string& name, const Vector3d& p_BQ) {
    const Vector3d nearest = p_BQ.cwiseMax(check_.hull[0].low_m).cwiseMin(check_.hull[0].high_m);
    if (const double off_m = (p_BQ - nearest).norm(); off_m > size_m.maxCoeff())
      Problem(fmt::format("{} is {:.3g} m away from a hull of {:.2f} m: are all places in metres?",
                          name, off_m, size_m.maxCoeff()));
  };
  require_near("the camera head", scene_.X_BH.p);
  for (const ThrusterReport& thruster : check_.thrusters)
    require_near("thruster " + thruster.name, thruster.p_BT_m);
  const vehicle::RigidBodyParams& body = scenario_.vehicle.rigid_body;
  const double gyration_m = std::sqrt(body.inertia_kg_m2.maxCoeff() / body.mass_kg);
  if (gyration_m > size_m.norm() / 2 || gyration_m < size_m.norm() / 50)
    Problem(fmt::format(
        "its inertia is that of a body {} than its hull (radius of gyration {:.3g} "
        "m, half the hull's diagonal {:.3g} m): is it in kg m^2?",
        gyration_m > size_m.norm() / 2 ? "larger" : "far smaller", gyration_m, size_m.norm() / 2));
  const double displaced_m3 = scenario_.vehicle.hydrodynamics.displaced_volume_m3;
  constexpr double kEmptiest = 100;
  if (displaced_m3 > size_m.prod() || displaced_m3 * kEmptiest < size_m.prod())
    Warn(
        fmt::format("its hull fills a box of {:.3g} x {:.3g} x {:.3g} m and displaces {:.3g} m^3: "
                    "are both in metres?",
                    size_m.x(), size_m.y(), size_m.z(), displaced_m3));
}

void Judgement::OfFloating() {
  const Floating& floating = check_.floating;
  const AxisReport& heave = check_.axes[control::kHeave];
  const double against = floating.buoyancy_newton > 0 ? -heave.most_back : heave.most;
  const bool hangs_over = floating.righting_newton_m <= 0;
  if (hangs_over && check_.levels)
    Warn("its thrusters alone hold it upright: the centre of buoyancy is not above that of mass");
  if (hangs_over && !check_.levels)
    Problem("it does not stay upright: the centre of buoyancy is not above the centre of mass");
  if (against > 0 && std::abs(floating.buoyancy_newton) > kMuchBuoyancy * against)
    Warn(fmt::format(
        "it {} with {:.1f} N, {:.0f} % of what the thrusters have against it: trim it "
        "with ballast or foam (vehicle.loads)",
        floating.buoyancy_newton > 0 ? "rises" : "sinks", std::abs(floating.buoyancy_newton),
        100 * std::abs(floating.buoyancy_newton) / against));
  if (std::max(std::abs(floating.roll_rad), std::abs(floating.pitch_rad)) > kMuchTrim_rad)
    Warn(fmt::format("it floats askew: rolled by {}° and pitched by {}°",
                     report::Fixed(Deg(floating.roll_rad), 1),
                     report::Fixed(Deg(floating.pitch_rad), 1)));
  for (const auto& [dof, name] : {std::pair{Dof::kRoll, "roll"}, std::pair{Dof::kPitch, "pitch"}})
    if (!check_.levels &&
        scenario_.vehicle.hydrodynamics.linear_damping_diagonal[static_cast<int>(dof)] == 0)
      Warn(fmt::format("nothing damps small swings in {}: the linear damping is 0", name));
}

void Judgement::OfAxes() {
  for (const AxisReport& axis : check_.axes) {
    if (axis.most == 0 && axis.most_back == 0) {
      Problem(
          fmt::format("nothing pushes it along {0} by itself, and docking needs that: no "
                      "thruster does, or none without another axis",
                      axis.axis));
      continue;
    }
    if (!check_.levels && axis.tilt_rad() > kMuchTilt_rad)
      Warn(fmt::format("full {} {}: little rights it against thrusters off its centre", axis.axis,
                       axis.tilt_rad() > std::numbers::pi / 2
                           ? "turns it over"
                           : fmt::format("tilts it by {:.0f}°", Deg(axis.tilt_rad()))));
    const double most = std::min(axis.most, -axis.most_back);
    if (axis.load > most)
      Problem(
          fmt::format("it cannot hold its place in {}'s sea: up to {:.1f} N on {}, where its "
                      "thrusters have {:.1f} N",
                      check_.scenario, axis.load, axis.axis, most));
    else if (axis.load > kMuchLoad * most)
      Warn(fmt::format("{}'s sea asks for up to {:.1f} of the {:.1f} N that there are on {}",
                       check_.scenario, axis.load, most, axis.axis));
  }
  for (const ThrusterReport& thruster : check_.thrusters)
    if (thruster.forward_newton == 0 && thruster.reverse_newton == 0)
      Warn(fmt::format("{} has no force in either direction", thruster.name));
}

void Judgement::OfViews() {
  for (const ViewReport& view : check_.views) {
    if (view.margin_px < 0)
      Problem(fmt::format("{} at {:.2f} m ({}) is not whole in it", view.nearest, view.x_m,
                          view.place));
    else if (view.margin_px < kLittleMargin_px)
      Warn(fmt::format("{} at {:.2f} m ({}) is {:.0f} pixels from its border", view.nearest,
                       view.x_m, view.place, view.margin_px));
    if (view.hidden > kLittleHidden)
      (view.hidden > kMostHidden ? check_.problems : check_.warnings)
          .push_back(fmt::format("{} at {:.2f} m ({}): {:.0f} % of it", view.hides, view.x_m,
                                 view.place, 100 * view.hidden));
  }
}

void Judgement::OfDocking() {
  const PoleReport& pole = check_.pole;
  if (!pole.meets_dock)
    Warn("nothing stops its pole at the dock: by contype and conaffinity the two never touch");
  if (pole.past_throat_m <= 0)
    Problem(
        fmt::format("docked, {:.2f} m before the marker, the pole's tip is {:.0f} mm short of "
                    "the straight hole",
                    scenario_.procedure.docked_x_m, -1000 * pole.past_throat_m));
  if (std::abs(pole.beyond_tip_m) > kPoleApart_m)
    Warn(fmt::format("its pole ends {:.0f} mm {} pole_tip, which is what counts in the hole",
                     1000 * std::abs(pole.beyond_tip_m),
                     pole.beyond_tip_m < 0 ? "before" : "beyond"));
  if (std::max(std::abs(pole.aside_m), std::abs(pole.above_m)) > pole.clearance_m)
    Problem(fmt::format("docked, the pole's tip is off the hole's axis: {}; {:.0f} mm are free",
                        BesideText(pole.aside_m, pole.above_m), 1000 * pole.clearance_m));
  if (const CollisionReport& hit = check_.collision; !hit.what.empty())
    Problem(
        fmt::format("collision on the way from servoing to docked: {}, {:.2f} m before the "
                    "marker",
                    hit.what, hit.x_m));
  const bool said = std::ranges::any_of(
      check_.axes, [](const AxisReport& axis) { return axis.most == 0 && axis.most_back == 0; });
  if (!check_.refusal.empty() && !said) Problem("`run` refuses it: " + check_.refusal);
  const FlightReport& flights = check_.flights;
  if (flights.docked == flights.flown) return;
  (2 * flights.docked <= flights.flown ? check_.problems : check_.warnings)
      .push_back(fmt::format("of {} trials on the true pose {} dock, the first that does not: {}",
                             flights.flown, flights.docked, flights.end));
}

}  // namespace

std::string BesideText(double aside_m, double above_m) {
  const auto text = [](double m, const char* positive, const char* negative) {
    return fmt::format("{:.0f} mm {}", 1000 * std::abs(m), m < 0 ? negative : positive);
  };
  return text(aside_m, "to the left", "to the right") + " and " + text(above_m, "above", "below");
}

void Judge(const trial::Scenario& scenario, const vehicle::Scene& scene, VehicleCheck* check) {
  Judgement judgement(scenario, scene, check);
  judgement.OfFiles();
  judgement.OfHull();
  judgement.OfFloating();
  judgement.OfAxes();
  judgement.OfViews();
  judgement.OfDocking();
}

}  // namespace turbidock::check_vehicle
