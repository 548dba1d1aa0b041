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
#include "experiments/config/yaml_fields.h"
#include "experiments/report/table.h"
#include "experiments/trial/recorded.h"
#include "experiments/trial/running_trial.h"
#include "experiments/trial/trial.h"
#include "experiments/trial/world.h"
#include "sim/vehicle/plant.h"
#include "sim/vehicle/sea.h"
#include "sim/view/geom_mesh.h"

namespace turbidock::check_vehicle {
namespace {

namespace fs = std::filesystem;

using control::Axes;
using control::Axis;
using Eigen::Vector3d;
using vehicle::Dof;
using vehicle::Vector6d;

constexpr std::array kAxes = {control::kSurge, control::kSway, control::kHeave, control::kYaw};
constexpr std::array kAxisNames = {"surge", "sway", "heave", "yaw"};
constexpr std::array kDofs = {Dof::kSurge, Dof::kSway, Dof::kHeave, Dof::kYaw};

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
Vector3d LoadOfSea(const trial::Scenario& scenario, const vehicle::Scene& scene, const Pose& X_HM) {
  const vehicle::VehicleParams& params = scenario.vehicle;
  const vehicle::HydrodynamicsParams hydro = params.LoadedHydrodynamics();
  vehicle::Sea sea =
      trial::SeaOf(scenario, SeedTree(static_cast<uint64_t>(scenario.seed)).Stream("sea"));
  const Pose X_WB = scene.X_WM * X_HM.Inverse() * scene.X_BH.Inverse();
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
    sea.Step(kStep_s, kStep_s * (step + 1));
  }
  return most;
}

// What `run` says of it before the first frame; nothing where it runs.
std::string RefusalOf(const trial::Scenario& scenario) {
  try {
    const trial::RunningTrial running(scenario);
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

// On the true pose, so that what is missed is the vehicle's or its controller's.
FlightReport Fly(const trial::Scenario& scenario) {
  constexpr int kFlights = 4;  // a second or two; one alone may begin where all dock
  FlightReport report;
  for (; report.flown < kFlights; ++report.flown) {
    trial::Scenario flight = scenario;
    trial::Resolve(
        config::ParseAssignments({"estimator.pose_source=true_pose",
                                  fmt::format("trial.seed={}", scenario.seed + report.flown)}),
        &flight);
    const trial::TrialResult result = trial::RunTrial(flight);
    if (result.outcome == trial::Outcome::kSuccess)
      ++report.docked;
    else if (report.end.empty())
      report.end = report::Spoken(result.reason);
  }
  return report;
}

// A vehicle that lacks an axis has nothing along it.
void ReportAxes(const trial::Scenario& scenario, const vehicle::Scene& scene,
                const control::ForceAllocation& allocation, VehicleCheck* check) {
  const vehicle::VehicleParams& data = scenario.vehicle;
  const double gravity_mps2 = -scene.model->opt.gravity[2];
  const Vector3d load = LoadOfSea(scenario, scene, check->views[0].X_HM);
  for (const Axis axis : kAxes) {
    const auto full = [&](double most) {
      Axes demand = Axes::Zero();
      demand[axis] = most;
      return allocation.Share(demand).command;
    };
    const ThrusterCommand on = full(allocation.most()[axis]),
                          back = full(allocation.most_back()[axis]);
    // as effective as its thrusters are, which the allocation does not know
    const double most = ForceAlong(axis, data, scene.thrusters, on),
                 most_back = ForceAlong(axis, data, scene.thrusters, back);
    const SteadyMotion ahead = SteadyMotionOf(data, scene.thrusters, on, axis, gravity_mps2);
    const bool lacks = most == 0 && most_back == 0;
    check->axes.push_back(
        {.axis = kAxisNames[axis],
         .most = most,
         .most_back = most_back,
         .speed = lacks ? 0 : ahead.on(axis),
         .speed_back =
             lacks ? 0 : SteadyMotionOf(data, scene.thrusters, back, axis, gravity_mps2).on(axis),
         .roll_rad = ahead.roll_rad,
         .pitch_rad = ahead.pitch_rad,
         .load = axis == control::kYaw ? 0 : load[static_cast<int>(kDofs[axis])]});
  }
}

}  // namespace

VehicleCheck CheckVehicle(const trial::Scenario& scenario) {
  CheckFields(scenario, "");
  const vehicle::SceneFiles files = trial::SceneFilesOf(scenario);
  const vehicle::Scene scene = vehicle::LoadScene(files, scenario.rig);
  const vehicle::VehicleParams& data = scenario.vehicle;
  // refuses what no trial would fly
  vehicle::Plant plant(scene, data, scenario.clock, vehicle::Sea());
  const control::ForceAllocation allocation({}, trial::ModelOf(data, scene),
                                            /*may_lack_axes=*/true);

  VehicleCheck check;
  check.vehicle = scenario.vehicle_model;
  check.scenario = scenario.description;
  check.mjcf = fs::path(scenario.vehicle_model.path).filename();
  check.data = fs::path(check.mjcf).replace_extension(".yaml");
  check.mass_kg = data.LoadedRigidBody().mass_kg;
  check.levels = scenario.levelling.enabled && allocation.levels();
  check.floating = FloatingOf(data, -scene.model->opt.gravity[2]);
  const double buoyancy = check.floating.buoyancy_newton;
  const double against =
      buoyancy > 0 ? -allocation.most_back()[control::kHeave] : allocation.most()[control::kHeave];
  if (against > 0 && std::abs(buoyancy) > against)
    throw ConfigError(
        "vehicle.hydrodynamics.displaced_volume_m3",
        fmt::format("{} kg displace {} m^3: the vehicle {} with {:.1f} N and its thrusters have "
                    "{:.1f} N against that",
                    FormatNumber(check.mass_kg),
                    FormatNumber(data.LoadedHydrodynamics().displaced_volume_m3),
                    buoyancy > 0 ? "rises" : "sinks", std::abs(buoyancy), against));
  check.hull = ReportHull(scene);
  check.thrusters = ReportThrusters(data, scene.thrusters);
  check.views = ReportViews(scenario, scene, &plant);
  ReportAxes(scenario, scene, allocation, &check);
  check.pole = ReportPole(scene, check.hull.back(), check.views[1].X_HM);
  check.collision = ReportCollision(scene, check.views[0].X_HM, check.views[1].X_HM, &plant);
  check.refusal = RefusalOf(scenario);
  if (check.refusal.empty()) check.flights = Fly(scenario);
  Judge(scenario, scene, &check);
  return check;
}

}  // namespace turbidock::check_vehicle
