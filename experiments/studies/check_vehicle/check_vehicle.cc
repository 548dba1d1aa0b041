#include "experiments/studies/check_vehicle/check_vehicle.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "control/thrust_allocation.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/trial/world.h"
#include "sim/base/units.h"
#include "sim/vehicle/plant.h"
#include "sim/vehicle/sea.h"
#include "sim/view/geom_mesh.h"

namespace turbidock::check_vehicle {
namespace {

using control::Axes;
using control::Axis;
using Eigen::Vector3d;
using vehicle::Dof;
using vehicle::Vector6d;

constexpr std::array kAxes = {control::kSurge, control::kSway, control::kHeave, control::kYaw};
constexpr std::array kAxisNames = {"surge", "sway", "heave", "yaw"};
constexpr std::array kDofs = {Dof::kSurge, Dof::kSway, Dof::kHeave, Dof::kYaw};

// Beyond these it is worth a word.
constexpr double kMuchTrim_rad = 0.05, kMuchTilt_rad = 0.09;
constexpr double kMuchBuoyancy = 0.3, kMuchLoad = 0.7;  // of the thrusters' most force
constexpr double kLittleMargin_px = 20;

double Deg(double rad) { return units::DegFromRad(rad); }

std::vector<ThrusterReport> ReportThrusters(
    const vehicle::VehicleData& data, const std::vector<vehicle::ThrusterInScene>& thrusters) {
  std::vector<ThrusterReport> reports;
  const auto kinds = data.thrusters.Of(NamesOf(thrusters), "vehicle.thrusters");
  const PerThruster effectiveness = data.thrusters.Effectiveness(thrusters.size());
  for (size_t i = 0; i < thrusters.size(); ++i) {
    const vehicle::ThrusterInScene& t = thrusters[i];
    Vector6d push;
    push << t.axis_B, t.p_BT.cross(t.axis_B);
    // Of a unit force and of its arm: less than a twentieth is not worth naming.
    const double arm_m = std::max(t.p_BT.norm(), 1e-3);
    std::string drives;
    for (const auto& [dof, name] : EnumNames<Dof>::kNames) {
      const int at = static_cast<int>(dof);
      if (std::abs(push[at]) < 0.05 * (at < 3 ? 1 : arm_m)) continue;
      drives += fmt::format("{}{} {}", drives.empty() ? "" : ", ", name, push[at] > 0 ? "+" : "-");
    }
    reports.push_back({.name = t.name,
                       .p_BT_m = t.p_BT,
                       .axis_B = t.axis_B,
                       .forward_newton = effectiveness[i] * kinds[i].FullForward(),
                       .reverse_newton = effectiveness[i] * kinds[i].FullReverse(),
                       .drives = drives});
  }
  return reports;
}

std::vector<HullReport> ReportHull(const vehicle::Scene& scene) {
  std::vector<HullReport> hull = {{.part = "hull"}, {.part = "pole"}};
  const mjModel& m = *scene.model;
  for (int geom = 0; geom < m.ngeom; ++geom) {
    const vehicle::Part part = scene.geom_part[static_cast<size_t>(geom)];
    if (part != vehicle::Part::kHull && part != vehicle::Part::kPole) continue;
    const double *p = m.geom_pos + 3 * geom, *q = m.geom_quat + 4 * geom;
    const Pose X_BG{Eigen::Quaterniond(q[0], q[1], q[2], q[3]), {p[0], p[1], p[2]}};
    HullReport& of = hull[part == vehicle::Part::kPole];
    const auto add = [&](const Vector3d& p_BQ_m) {
      of.points_m.push_back(p_BQ_m);
      of.low_m = of.low_m.cwiseMin(p_BQ_m);
      of.high_m = of.high_m.cwiseMax(p_BQ_m);
    };
    if (m.geom_type[geom] != mjGEOM_SPHERE) {
      for (const Vector3d& v : view::MeshOf(m, geom).vertices_m) add(X_BG * v);
      continue;
    }
    constexpr int kSides = 32;  // great circles, as seen along each axis
    for (int i = 0; i < 3 * kSides; ++i) {
      const double angle_rad = 2 * std::numbers::pi * i / kSides, r = m.geom_size[3 * geom];
      Vector3d edge = Vector3d::Zero();
      edge[i / kSides] = r * std::cos(angle_rad);
      edge[(i / kSides + 1) % 3] = r * std::sin(angle_rad);
      add(X_BG.p + edge);
    }
  }
  std::erase_if(hull, [](const HullReport& of) { return of.points_m.empty(); });
  return hull;
}

// The most that the sea asks for on surge, sway and heave of a vehicle that stands still, its bow
// towards the dock: drag of the water that passes and pressure of water that accelerates.
Vector3d LoadOfSea(const trial::Scenario& scenario, const vehicle::Scene& scene) {
  const vehicle::VehicleParams& params = scenario.vehicle;
  const vehicle::HydrodynamicsParams hydro = params.LoadedHydrodynamics();
  vehicle::Sea sea(scenario.sea, SeedTree(static_cast<uint64_t>(scenario.seed)).Stream("sea"));
  const Pose X_WB =
      scene.X_WM * Pose::Translation(-scenario.procedure.servo_x_m, 0, 0) * scene.X_BH.Inverse();
  Vector3d most = Vector3d::Zero();
  constexpr double kStep_s = 0.05;
  constexpr int kSteps = 2400;  // two minutes
  for (int step = 0; step < kSteps; ++step) {
    const vehicle::WaterMotion water = sea.At(X_WB * hydro.p_BBcb_m, kStep_s * step);
    const Vector3d v = X_WB.q.conjugate() * water.v_W, a = X_WB.q.conjugate() * water.a_W;
    for (int i = 0; i < 3; ++i) {
      const double drag = (hydro.linear_damping_diagonal[i] +
                           hydro.quadratic_damping_diagonal[i] * std::abs(v[i])) *
                          v[i];
      const double pressed =
          hydro.added_mass_diagonal[i] + hydro.water_density_kg_m3 * hydro.displaced_volume_m3;
      most[i] = std::max(most[i], std::abs(drag + pressed * a[i]));
    }
    sea.Step(kStep_s);
  }
  return most;
}

ViewReport ReportView(const vehicle::Scene& scene, const std::string& place, double x_m) {
  ViewReport view{.place = place,
                  .x_m = x_m,
                  .margin_px = std::numeric_limits<double>::infinity(),
                  .nearest = ""};
  const Pose X_HM = Pose::Translation(x_m, 0, 0);
  for (const auto& [camera, side] :
       {std::pair{&scene.rig.left, "left"}, std::pair{&scene.rig.right, "right"}}) {
    for (const vehicle::BallInScene& ball : scene.balls) {
      const Vector3d p_CQ = camera->X_HC.Inverse() * (X_HM * ball.p_MQ);
      double margin_px = -std::numeric_limits<double>::infinity();
      if (p_CQ.z() > ball.radius_m) {
        const Eigen::Vector2d at = camera->Project(p_CQ);
        const double radius_px = camera->fx_px * ball.radius_m / p_CQ.z();
        margin_px = std::min({at.x() + 0.5, camera->width_px - 0.5 - at.x(), at.y() + 0.5,
                              camera->height_px - 0.5 - at.y()}) -
                    radius_px;
      }
      if (margin_px >= view.margin_px) continue;
      view.margin_px = margin_px;
      view.nearest = fmt::format("{} in the {} image", ball.name, side);
    }
  }
  return view;
}

// Some geom of the pole meets some geom of the dock, by MuJoCo's rule for pairs of geoms.
bool PoleMeetsDock(const vehicle::Scene& scene) {
  const mjModel& model = *scene.model;
  const auto geoms = [&scene](vehicle::Part part) {
    std::vector<size_t> found;
    for (size_t geom = 0; geom < scene.geom_part.size(); ++geom)
      if (scene.geom_part[geom] == part) found.push_back(geom);
    return found;
  };
  for (const size_t pole : geoms(vehicle::Part::kPole))
    for (const size_t dock : geoms(vehicle::Part::kDock))
      if ((model.geom_contype[pole] & model.geom_conaffinity[dock]) != 0 ||
          (model.geom_contype[dock] & model.geom_conaffinity[pole]) != 0)
        return true;
  return false;
}

PoleReport ReportPole(const trial::Scenario& scenario, const vehicle::Scene& scene) {
  const Pose X_WH = scene.X_WM * Pose::Translation(-scenario.procedure.docked_x_m, 0, 0);
  const Vector3d p_DQ = scene.X_WD.Inverse() * (X_WH * scene.p_HQ_pole_tip);
  double radius_m = 0;
  for (int geom = 0; geom < scene.model->ngeom; ++geom)
    if (scene.geom_part[static_cast<size_t>(geom)] == vehicle::Part::kPole)
      radius_m = std::max(radius_m, scene.model->geom_size[3 * geom]);
  return {.depth_m = p_DQ.x(),
          .past_throat_m = p_DQ.x() - scene.dock_throat_depth_m,
          .aside_m = p_DQ.y(),
          .above_m = p_DQ.z(),
          .clearance_m = scene.dock_throat_half_width_m - radius_m,
          .meets_dock = PoleMeetsDock(scene)};
}

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
           key == "thrusters.rate_limit_newton_per_s" || key == "thrusters.effectiveness" ||
           key == "thrusters.individual" || key == "loads" ||
           (has_table && std::find(kCurve.begin(), kCurve.end(), key) != kCurve.end());
  };
  std::vector<std::string> left_out;
  for (const config::KeyDoc& doc : config::ListKeys<vehicle::VehicleParams>())
    if (!doc.value.empty() && !may_lack(doc.key) && !given.contains(doc.key))
      left_out.push_back(doc.key);
  return left_out;
}

// In words.
void Judge(const trial::Scenario& scenario, VehicleCheck* check) {
  const auto problem = [&](std::string text) { check->problems.push_back(std::move(text)); };
  const auto warn = [&](std::string text) { check->warnings.push_back(std::move(text)); };
  const std::vector<std::string> left_out = KeysLeftOut(scenario.vehicle_model);
  if (!left_out.empty())
    warn(fmt::format("its data leave out {}: there it is as the published vehicle",
                     fmt::join(left_out, ", ")));
  const Floating& floating = check->floating;
  const AxisReport& heave = check->axes[control::kHeave];
  const double against = floating.buoyancy_newton > 0 ? -heave.most_back : heave.most;
  if (floating.righting_newton_m <= 0)
    problem("it does not stay upright: the centre of buoyancy is not above the centre of mass");
  if (std::abs(floating.buoyancy_newton) > kMuchBuoyancy * against)
    warn(fmt::format(
        "it {} with {:.1f} N, {:.0f} % of what the thrusters have against it: trim it "
        "with ballast or foam (vehicle.loads)",
        floating.buoyancy_newton > 0 ? "rises" : "sinks", std::abs(floating.buoyancy_newton),
        100 * std::abs(floating.buoyancy_newton) / against));
  if (std::max(std::abs(floating.roll_rad), std::abs(floating.pitch_rad)) > kMuchTrim_rad)
    warn(fmt::format("it floats askew: rolled by {:.1f} and pitched by {:.1f} degrees",
                     Deg(floating.roll_rad) + 0.0, Deg(floating.pitch_rad)));
  for (const auto& [dof, name] : {std::pair{Dof::kRoll, "roll"}, std::pair{Dof::kPitch, "pitch"}})
    if (scenario.vehicle.hydrodynamics.linear_damping_diagonal[static_cast<int>(dof)] == 0)
      warn(fmt::format("nothing damps small swings in {}: the linear damping is 0", name));
  for (const AxisReport& axis : check->axes) {
    if (axis.tilt_rad() > kMuchTilt_rad)
      warn(
          fmt::format("full {} tilts it by {:.0f} degrees: little rights it against thrusters off "
                      "its centre",
                      axis.axis, Deg(axis.tilt_rad())));
    const double most = std::min(axis.most, -axis.most_back);
    if (axis.load > most)
      problem(
          fmt::format("it cannot hold its place in {}'s sea: up to {:.1f} N on {}, where its "
                      "thrusters have {:.1f} N",
                      check->scenario, axis.load, axis.axis, most));
    else if (axis.load > kMuchLoad * most)
      warn(fmt::format("{}'s sea asks for up to {:.1f} of the {:.1f} N that there are on {}",
                       check->scenario, axis.load, most, axis.axis));
  }
  for (const ThrusterReport& thruster : check->thrusters)
    if (thruster.forward_newton == 0 && thruster.reverse_newton == 0)
      warn(fmt::format("{} has no force in either direction", thruster.name));
  for (const ViewReport& view : check->views) {
    if (view.margin_px < 0)
      problem(fmt::format("{} at {:.2f} m ({}) is not whole in it", view.nearest, view.x_m,
                          view.place));
    else if (view.margin_px < kLittleMargin_px)
      warn(fmt::format("{} at {:.2f} m ({}) is {:.0f} pixels from its border", view.nearest,
                       view.x_m, view.place, view.margin_px));
  }
  const PoleReport& pole = check->pole;
  if (!pole.meets_dock)
    warn("nothing stops its pole at the dock: by contype and conaffinity the two never touch");
  if (pole.past_throat_m <= 0)
    problem(
        fmt::format("docked, {:.2f} m before the marker, the pole's tip is {:.0f} mm short of "
                    "the straight hole",
                    scenario.procedure.docked_x_m, -1000 * pole.past_throat_m));
  if (std::max(std::abs(pole.aside_m), std::abs(pole.above_m)) > pole.clearance_m)
    problem(
        fmt::format("docked, the pole's tip is {:.0f} mm to the left and {:.0f} mm above the "
                    "hole's axis; {:.0f} mm are free",
                    1000 * pole.aside_m, 1000 * pole.above_m, 1000 * pole.clearance_m));
}

}  // namespace

VehicleCheck CheckVehicle(const trial::Scenario& scenario) {
  CheckFields(scenario, "");
  const vehicle::Scene scene = vehicle::LoadScene(trial::SceneFilesOf(scenario), scenario.rig);
  const vehicle::VehicleParams& data = scenario.vehicle;
  // refuses what no trial would fly
  const vehicle::Plant plant(scene, data, scenario.clock, vehicle::Sea());
  const double gravity_mps2 = -scene.model->opt.gravity[2];
  const control::ForceAllocation allocation({}, trial::ModelOf(data, scene));

  VehicleCheck check;
  check.vehicle = scenario.vehicle_model;
  check.scenario = scenario.description;
  check.floating = FloatingOf(data, gravity_mps2);
  const double buoyancy = check.floating.buoyancy_newton;
  const double against =
      buoyancy > 0 ? -allocation.most_back()[control::kHeave] : allocation.most()[control::kHeave];
  if (std::abs(buoyancy) > against)
    throw ConfigError(
        "vehicle.hydrodynamics.displaced_volume_m3",
        fmt::format("{} kg displace {} m^3: the vehicle {} with {:.1f} N and its thrusters have "
                    "{:.1f} N against that",
                    FormatNumber(data.LoadedRigidBody().mass_kg),
                    FormatNumber(data.LoadedHydrodynamics().displaced_volume_m3),
                    buoyancy > 0 ? "rises" : "sinks", std::abs(buoyancy), against));
  check.hull = ReportHull(scene);
  check.thrusters = ReportThrusters(data, scene.thrusters);
  const Vector3d load = LoadOfSea(scenario, scene);
  for (const Axis axis : kAxes) {
    const auto full = [&](double most) {
      Axes demand = Axes::Zero();
      demand[axis] = most;
      return allocation.Share(demand).command;
    };
    const double most = allocation.most()[axis], most_back = allocation.most_back()[axis];
    const SteadyMotion ahead =
        SteadyMotionOf(data, scene.thrusters, full(most), axis, gravity_mps2);
    check.axes.push_back(
        {.axis = kAxisNames[axis],
         .most = most,
         .most_back = most_back,
         .speed = ahead.on(axis),
         .speed_back =
             SteadyMotionOf(data, scene.thrusters, full(most_back), axis, gravity_mps2).on(axis),
         .roll_rad = ahead.roll_rad,
         .pitch_rad = ahead.pitch_rad,
         .load = axis == control::kYaw ? 0 : load[static_cast<int>(kDofs[axis])]});
  }
  check.views = {ReportView(scene, "servoing", scenario.procedure.servo_x_m),
                 ReportView(scene, "docked", scenario.procedure.docked_x_m)};
  check.pole = ReportPole(scenario, scene);
  Judge(scenario, &check);
  return check;
}

}  // namespace turbidock::check_vehicle
