#include "experiments/fixed_view.h"

#include "sim/gl_context.h"
#include "sim/scene.h"
#include "sim/stereo_renderer.h"

namespace turbidock::experiments {

std::vector<FixedView> DrawFixedViews(const Scenario& scenario, const std::vector<Pose>& X_HM) {
  const sim::Scene scene = sim::LoadScene(SceneFile(scenario), scenario.rig);
  const mjModel& model = *scene.model;
  const sim::MjDataPtr data(mj_makeData(&model));
  const std::unique_ptr<sim::GlContext> context = sim::MakeGlContext(scenario.renderer);
  sim::StereoRenderer renderer(*context, scene);
  const sim::SurfaceTable surfaces = sim::SurfaceTable::FromScene(scene);

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
                     .X_HE = sim::LampPoses(scene),
                     .rendered = {}});
    renderer.Render(*data, /*tick=*/0, &views.back().rendered);
  }
  return views;
}

FixedCameras::FixedCameras(const FixedView& view, const Scenario& scenario, const SeedTree& seeds)
    : sensor_(scenario.sensor, seeds.Stream("camera.left").NextU64(),
              seeds.Stream("camera.right").NextU64()) {
  sim::Water(scenario.optics, view.rig, view.surfaces, view.X_HE).Apply(view.rendered, &radiance_);
}

}  // namespace turbidock::experiments
