#include "experiments/trial/fixed_view.h"

#include <utility>

#include "sim/vehicle/scene.h"
#include "sim/view/gl_context.h"
#include "sim/view/stereo_renderer.h"

namespace turbidock::trial {

std::vector<FixedView> DrawFixedViews(const Scenario& scenario, const std::vector<Pose>& X_HM) {
  if (scenario.faults.seen() || !scenario.faults.thrusters.empty())
    throw ConfigError("faults", "belong to a trial: a vehicle at rest has none");
  const vehicle::Scene scene = vehicle::LoadScene(SceneFilesOf(scenario), scenario.rig);
  const mjModel& model = *scene.model;
  const vehicle::MjDataPtr data(mj_makeData(&model));
  const std::unique_ptr<view::GlContext> context = view::MakeGlContext(scenario.renderer);
  view::StereoRenderer renderer(*context, scene);
  const light::SurfaceTable surfaces = light::SurfaceTable::FromScene(scene);

  std::vector<FixedView> views;
  for (const Pose& pose : X_HM) {
    const Pose X_WB = scene.X_WM * pose.Inverse() * scene.X_BH.Inverse();
    mjtNum* qpos = data->qpos + model.jnt_qposadr[model.body_jntadr[scene.vehicle_body]];
    for (int i = 0; i < 3; ++i) qpos[i] = X_WB.p[i];
    qpos[3] = X_WB.q.w();
    for (int i = 0; i < 3; ++i) qpos[4 + i] = X_WB.q.vec()[i];
    mj_forward(&model, data.get());
    views.push_back({.X_HM = pose,
                     .rig = scene.rig,
                     .surfaces = surfaces,
                     .X_HE = light::LampPoses(scene),
                     .rendered = {}});
    renderer.Render(*data, &views.back().rendered);
  }
  return views;
}

light::Water WaterOf(const FixedView& view, const Scenario& scenario) {
  return light::Water(scenario.cameras().optics, view.rig, view.surfaces, view.X_HE);
}

camera::StereoCamera HoldView(const FixedView& view, light::Water water, const Scenario& scenario,
                              const SeedTree& seeds) {
  camera::StereoCamera cameras(scenario.cameras(), std::move(water),
                               scenario.image_clock().frame_s(), seeds);
  cameras.Hold(view.rendered);
  return cameras;
}

camera::StereoCamera HoldView(const FixedView& view, const Scenario& scenario,
                              const SeedTree& seeds) {
  return HoldView(view, WaterOf(view, scenario), scenario, seeds);
}

}  // namespace turbidock::trial
