// What makes an image pair of 640 x 480: render, water and sensor, against bare rendering.
//
// The second argument is the distance of the marker in mm: at 1000 the water fills the picture, at
// 450 the station does.

#include <benchmark/benchmark.h>

#include <memory>
#include <string>
#include <vector>

#include "experiments/trial/scenario.h"
#include "sim/camera/image_sensor.h"
#include "sim/camera/stereo_camera.h"
#include "sim/light/surfaces.h"
#include "sim/light/water.h"
#include "sim/view/gl_context.h"
#include "sim/view/stereo_renderer.h"
#include "tests/support/gl_canvas.h"

namespace turbidock::sim {
namespace {

const std::vector<std::string> kScenarios = {"sea_night_active", "sea_night_passive", "pool_active",
                                             "pool_passive"};

// A scenario with the vehicle in front of the marker, seen once.
struct View {
  explicit View(const benchmark::State& state)
      : scenario(trial::LoadScenario(kScenarios[static_cast<size_t>(state.range(0))], {})),
        scene(vehicle::LoadScene(trial::SceneFilesOf(scenario), scenario.rig)),
        data(mj_makeData(scene.model.get())),
        gl(view::MakeOsmesaContext()),
        renderer(*gl, scene),
        water(scenario.light, scenario.rig.MakeRig(), light::SurfaceTable::FromScene(scene),
              light::LampPoses(scene)),
        sensor(scenario.sensor, 1, 2),
        camera(light::Water(water), sensor) {
    const Pose X_HM{FromYawPitchRoll(0.04, 0.02, -0.03),
                    {static_cast<double>(state.range(1)) * 1e-3, 0.02, -0.04}};
    const Pose X_WB = scene.X_WM * X_HM.Inverse() * scene.X_BH.Inverse();
    const mjModel& m = *scene.model;
    mjtNum* qpos = data->qpos + m.jnt_qposadr[m.body_jntadr[scene.vehicle_body]];
    Eigen::Vector3d::Map(qpos) = X_WB.p;
    Eigen::Vector4d::Map(qpos + 3) << X_WB.q.w(), X_WB.q.vec();
    mj_forward(&m, data.get());
    renderer.Render(*data, &rendered);
    water.Apply(rendered, &radiance);
    sensor.Digitise(radiance, 0, &image);
  }

  trial::Scenario scenario;
  vehicle::Scene scene;
  vehicle::MjDataPtr data;
  std::unique_ptr<view::GlContext> gl;
  view::StereoRenderer renderer;
  light::Water water;
  camera::ImageSensor sensor;
  camera::StereoCamera camera;
  view::RenderedStereo rendered;
  light::RadianceStereo radiance;
  StereoImage image;
};

void CountPixels(const View& view, benchmark::State& state) {
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(view.image.left.pixels() +
                                                                    view.image.right.pixels()));
  state.SetLabel(view.scenario.description);
}

// mjr_render and mjr_readPixels of both views with MuJoCo's own colours, and nothing else.
void BareRender(benchmark::State& state) {
  View view(state);
  const CameraIntrinsics& camera = view.scene.rig.left;
  testing::GlCanvas canvas(
      *view.gl, *view.scene.model, camera.width_px, camera.height_px,
      {.shadowsize = 0, .offsamples = 0, .numslices = 28, .numstacks = 16, .numquads = 4});
  std::vector<uint8_t> rgb(view.image.left.pixels() * 3);
  std::vector<float> depth(view.image.left.pixels());
  for (auto _ : state) {
    canvas.Update(*view.data);
    for (const int id : {view.scene.left_camera, view.scene.right_camera}) {
      canvas.Draw(*view.data, id);
      canvas.Read(rgb.data(), depth.data());
    }
  }
  CountPixels(view, state);
}

void Render(benchmark::State& state) {
  View view(state);
  for (auto _ : state) view.renderer.Render(*view.data, &view.rendered);
  CountPixels(view, state);
}

// What the estimator asks for while it tracks the marker: a quarter of each image.
void RenderRegion(benchmark::State& state) {
  View view(state);
  const PixelRegion part = {160, 120, 480, 360};
  for (auto _ : state) view.renderer.Render(*view.data, {part, part}, &view.rendered);
  state.SetItemsProcessed(state.iterations() * 2 * part.width() * part.height());
  state.SetLabel(view.scenario.description);
}

void WaterOnly(benchmark::State& state) {
  View view(state);
  for (auto _ : state) view.water.Apply(view.rendered, &view.radiance);
  CountPixels(view, state);
}

void Sensor(benchmark::State& state) {
  View view(state);
  int64_t frame = 0;
  for (auto _ : state) view.sensor.Digitise(view.radiance, frame++, &view.image);
  CountPixels(view, state);
}

void WaterAndSensor(benchmark::State& state) {
  View view(state);
  int64_t frame = 0;
  for (auto _ : state) view.camera.Expose(view.rendered, frame++, &view.image);
  state.counters["points"] = static_cast<double>(view.camera.water().points());
  CountPixels(view, state);
}

void Cases(benchmark::internal::Benchmark* bench) {
  bench->ArgNames({"scenario", "distance_mm"})
      ->ArgsProduct({{0, 1, 2, 3}, {1000, 450}})
      ->Unit(benchmark::kMillisecond);
}
BENCHMARK(BareRender)->Apply(Cases);
BENCHMARK(Render)->Apply(Cases);
BENCHMARK(RenderRegion)->Apply(Cases);
BENCHMARK(WaterOnly)->Apply(Cases);
BENCHMARK(Sensor)->Apply(Cases);
BENCHMARK(WaterAndSensor)->Apply(Cases);

}  // namespace
}  // namespace turbidock::sim
