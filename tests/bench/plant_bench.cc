// One physics tick of the closed loop's vehicle, against a bare mj_step of the same model.
//
// Both float free beside a station, without contacts: these would cost both the same and hide what
// the water adds. Every batch starts from the same state.

#include <benchmark/benchmark.h>

#include <cstring>

#include "sim/vehicle/plant.h"
#include "tests/check/simple_scene.h"

namespace turbidock::sim {
namespace {

constexpr int kTicks = 480;  // one second
const Pose kStart = Pose::Translation(0, 0, -1);
const ThrusterCommand kCommand{.volts = {3.5, 3.5, 3, 2}};

vehicle::Scene BenchScene() {
  return check::MakeScene(
      std::string(check::kVehicleBody) +
      R"(<geom name="station" type="box" size="0.05 0.3 0.225" pos="1.6 0 -1"/>)");
}

vehicle::SeaParams BenchSea(bool irregular) {
  vehicle::SeaParams params;
  params.current = {.surface_velocity_mps = {0, 0.1, 0},
                    .decay_depth_m = 5,
                    .gust_std_mps = 0.02,
                    .gust_time_constant_s = 10};
  if (irregular)
    params.jonswap = {.significant_height_m = 0.1, .peak_period_s = 2.5};
  else
    params.state = vehicle::SeaState::kModerate;
  return params;
}

void Report(benchmark::State& state) {
  state.SetItemsProcessed(state.iterations() * kTicks);
  state.counters["x_real_time"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

// Argument: 0 one regular wave, 1 a JONSWAP sea.
void PlantSecond(benchmark::State& state) {
  const vehicle::Scene scene = BenchScene();
  vehicle::Plant plant(scene, {}, {},
                       vehicle::Sea(BenchSea(state.range(0) != 0), SeedTree(1).Stream("sea")));
  for (auto _ : state) {
    plant.Reset(kStart);
    for (int i = 0; i < kTicks; ++i)
      if (plant.Step(kCommand)) return state.SkipWithError("the plant failed");
    benchmark::DoNotOptimize(plant.data().qpos);
  }
  Report(state);
}
BENCHMARK(PlantSecond)->Arg(0)->Arg(1)->ArgName("irregular");

void BareMujocoSecond(benchmark::State& state) {
  const vehicle::Scene scene = BenchScene();
  vehicle::Plant plant(scene, {}, {}, vehicle::Sea());
  plant.Reset(kStart);
  const mjModel& m = plant.model();
  const vehicle::MjDataPtr data(mj_makeData(&m));
  // Weightless, as buoyancy makes it, so that it stays where the other is.
  const vehicle::MjModelPtr model(mj_copyModel(nullptr, &m));
  std::memset(model->opt.gravity, 0, sizeof model->opt.gravity);
  for (auto _ : state) {
    mj_resetData(model.get(), data.get());
    std::memcpy(data->qpos, plant.data().qpos, sizeof(mjtNum) * model->nq);
    for (int i = 0; i < kTicks; ++i) mj_step(model.get(), data.get());
    benchmark::DoNotOptimize(data->qpos);
  }
  Report(state);
}
BENCHMARK(BareMujocoSecond);

}  // namespace
}  // namespace turbidock::sim
