#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>

#include "experiments/studies/check_vehicle/check_vehicle.h"
#include "experiments/trial/world.h"
#include "sim/view/gl_context.h"
#include "sim/view/stereo_renderer.h"

namespace turbidock::check_vehicle {
namespace {

using Eigen::Vector3d;

Pose PoseInWorld(const vehicle::Scene& scene, const Pose& X_HM) {
  return scene.X_WM * X_HM.Inverse() * scene.X_BH.Inverse();
}

ViewReport ReportView(const vehicle::Scene& scene, const std::string& place, const Pose& X_HM) {
  ViewReport view{.place = place,
                  .X_HM = X_HM,
                  .x_m = X_HM.p.x(),
                  .margin_px = std::numeric_limits<double>::infinity(),
                  .nearest = "",
                  .hides = ""};
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

// The scene with nothing of the vehicle to be seen.
vehicle::Scene WithoutVehicle(const trial::Scenario& scenario) {
  vehicle::Scene scene = vehicle::LoadScene(trial::SceneFilesOf(scenario), scenario.rig);
  for (size_t geom = 0; geom < scene.geom_part.size(); ++geom)
    if (scene.geom_part[geom] == vehicle::Part::kHull ||
        scene.geom_part[geom] == vehicle::Part::kPole)
      scene.model->geom_group[geom] = vehicle::kContactsOnlyGroup;
  return scene;
}

// What of a ball is behind a part of the vehicle, from the surfaces that two pictures show: with
// the vehicle and without it.
void NoteHidden(const vehicle::Scene& scene, const Image1u16& with, const Image1u16& without,
                const char* side, ViewReport* view) {
  for (const vehicle::BallInScene& ball : scene.balls) {
    int there = 0;
    std::map<int, int> before;  // pixels of it that show another geom
    for (int v = 0; v < with.height(); ++v)
      for (int u = 0; u < with.width(); ++u) {
        if (*without.at(u, v) != ball.geom + 1) continue;
        ++there;
        if (*with.at(u, v) != ball.geom + 1) ++before[*with.at(u, v) - 1];
      }
    int lost = 0, most = 0, nearest = -1;
    for (const auto& [geom, count] : before) {
      lost += count;
      if (count > most) most = count, nearest = geom;
    }
    if (there == 0 || lost <= view->hidden * there) continue;
    view->hidden = static_cast<double>(lost) / there;
    view->hides = fmt::format("{} hides {} in the {} image",
                              mj_id2name(scene.model.get(), mjOBJ_GEOM, nearest), ball.name, side);
  }
}

}  // namespace

std::vector<ViewReport> ReportViews(const trial::Scenario& scenario, const vehicle::Scene& scene,
                                    vehicle::Plant* plant) {
  const control::ProcedureParams& p = scenario.procedure;
  const auto pose = [&](double x_m) {
    return Pose{FromYawPitchRoll(p.servo_yaw_rad, 0, 0), {x_m, p.servo_y_m, p.servo_z_m}};
  };
  std::vector<ViewReport> views = {ReportView(scene, "servoing", pose(p.servo_x_m)),
                                   ReportView(scene, "docked", pose(p.docked_x_m))};
  const vehicle::Scene bare = WithoutVehicle(scenario);
  std::string remark;
  const std::unique_ptr<view::GlContext> context = view::MakeGlContext(scenario.renderer, &remark);
  view::StereoRenderer renderer(*context, scene), without(*context, bare);
  for (ViewReport& view : views) {
    plant->Reset(PoseInWorld(scene, view.X_HM));
    view::RenderedStereo all, marker;
    renderer.Render(plant->data(), &all);
    without.Render(plant->data(), &marker);
    NoteHidden(scene, all.left.surface, marker.left.surface, "left", &view);
    NoteHidden(scene, all.right.surface, marker.right.surface, "right", &view);
  }
  return views;
}

PoleReport ReportPole(const vehicle::Scene& scene, const HullReport& pole,
                      const Pose& X_HM_docked) {
  const Pose X_WH = scene.X_WM * X_HM_docked.Inverse();
  const Vector3d p_DQ = scene.X_WD.Inverse() * (X_WH * scene.p_HQ_pole_tip);
  double radius_m = 0;
  for (int geom = 0; geom < scene.model->ngeom; ++geom)
    if (scene.geom_part[static_cast<size_t>(geom)] == vehicle::Part::kPole)
      radius_m = std::max(radius_m, scene.model->geom_size[3 * geom]);
  const Pose X_HB = scene.X_BH.Inverse();
  double end_m = -std::numeric_limits<double>::infinity();
  for (const Vector3d& p_BQ : pole.points_m) end_m = std::max(end_m, (X_HB * p_BQ).x());
  return {.depth_m = p_DQ.x(),
          .past_throat_m = p_DQ.x() - scene.dock_throat_depth_m,
          .aside_m = p_DQ.y(),
          .above_m = p_DQ.z(),
          .clearance_m = scene.dock_throat_half_width_m - radius_m,
          .meets_dock = PoleMeetsDock(scene),
          .beyond_tip_m = end_m - scene.p_HQ_pole_tip.x()};
}

CollisionReport ReportCollision(const vehicle::Scene& scene, const Pose& X_HM_servoing,
                                const Pose& X_HM_docked, vehicle::Plant* plant) {
  constexpr int kSteps = 50;  // half a centimetre of the published way
  const ThrusterCommand still = ThrusterCommand::Neutral(scene.thrusters.size());
  Pose X_HM = X_HM_servoing;
  for (int step = 0; step <= kSteps; ++step) {
    X_HM.p = X_HM_servoing.p + (X_HM_docked.p - X_HM_servoing.p) * step / kSteps;
    plant->Reset(PoseInWorld(scene, X_HM));
    const std::optional<std::string> fault = plant->Step(still);
    const std::string touched = plant->contacts().collision;
    if (fault || !touched.empty())
      return {.what = touched.empty() ? *fault : touched, .x_m = X_HM.p.x()};
  }
  return {.what = ""};
}

}  // namespace turbidock::check_vehicle
