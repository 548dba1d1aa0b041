// The estimator's stages on painted stereo images of 640 x 480.

#include <benchmark/benchmark.h>

#include "tests/support/paint_marker.h"
#include "vision/rm_ga.h"

namespace turbidock::vision {
namespace {

const Pose kPose = Pose::FromVectorPart({0.6, 0.03, -0.02}, {0.01, -0.02, 0.05});

StereoImage Seen(double background_dn) {
  Rng noise = SeedTree(2).Stream("noise");
  return testing::PaintMarker(MarkerParams{}, RigParams{}.MakeRig(), kPose,
                              {.background_dn = background_dn, .noise_dn = 2}, &noise);
}

// Both label images of a stereo pair.
void Labels(benchmark::State& state) {
  const StereoImage seen = Seen(static_cast<double>(state.range(0)));
  HueLabeller labeller(HueParams{}, MarkerParams{});
  Stereo<Image1u8> labels;
  for (auto _ : state) {
    for (const Side side : kSides) labeller.Label(seen[side], &labels[side]);
    benchmark::DoNotOptimize(labels.right.data());
  }
  state.SetItemsProcessed(state.iterations() *
                          static_cast<int64_t>(seen.left.pixels() + seen.right.pixels()));
}
BENCHMARK(Labels)->ArgName("background_dn")->Arg(8)->Arg(90)->Unit(benchmark::kMillisecond);

void OneEvaluation(benchmark::State& state) {
  const StereoImage seen = Seen(8);
  HueLabeller labeller(HueParams{}, MarkerParams{});
  Stereo<Image1u8> labels;
  for (const Side side : kSides) labeller.Label(seen[side], &labels[side]);
  const Fitness fitness(MarkerParams{}, RigParams{}.MakeRig(), labels);
  Pose X_HM = kPose;
  for (auto _ : state) {
    X_HM.p.x() = 1.2 - X_HM.p.x();  // 0.6 m, in turns of rounding
    benchmark::DoNotOptimize(fitness.Evaluate(X_HM));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(OneEvaluation);

// Random poses near the marker, as a generation has them.
void BatchOfEvaluations(benchmark::State& state) {
  const StereoImage seen = Seen(8);
  HueLabeller labeller(HueParams{}, MarkerParams{});
  Stereo<Image1u8> labels;
  for (const Side side : kSides) labeller.Label(seen[side], &labels[side]);
  const Fitness fitness(MarkerParams{}, RigParams{}.MakeRig(), labels);
  Rng rng = SeedTree(4).Stream("poses");
  std::vector<Pose> poses(static_cast<size_t>(state.range(0)), kPose);
  for (Pose& X_HM : poses)
    X_HM.p += 0.03 * Eigen::Vector3d(rng.Normal(), rng.Normal(), rng.Normal());
  std::vector<double> f(poses.size());
  for (auto _ : state) {
    fitness.EvaluateAll(poses, f);
    benchmark::DoNotOptimize(f.data());
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(BatchOfEvaluations)->ArgName("poses")->Arg(24)->Arg(540);

// The outlines of three balls in both images, from where a search ends.
void Refinement(benchmark::State& state) {
  const StereoImage seen = Seen(8);
  PoseRefiner refiner(MarkerParams{}, RigParams{}.MakeRig());
  Pose start = kPose;
  start.p += Eigen::Vector3d(0.004, 0.001, -0.001);
  for (auto _ : state)
    benchmark::DoNotOptimize(refiner.Refine(seen, {{0, 0, 640, 480}, {0, 0, 640, 480}}, start));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(Refinement)->Unit(benchmark::kMicrosecond);

// One frame of the search while it tracks, labels included.
void GaFrame(benchmark::State& state, const RmGaOptions& options) {
  const StereoImage seen = Seen(8);
  RmGa search(options, MarkerParams{}, HueParams{}, RigParams{}.MakeRig(),
              SeedTree(3).Stream("ga"));
  for (int frame = 0; frame < 30; ++frame) search.Update(seen);
  int64_t evaluations = 0;
  for (auto _ : state) evaluations += search.Update(seen).evaluations;
  state.SetItemsProcessed(evaluations);
}
BENCHMARK_CAPTURE(GaFrame, closed_loop, RmGaOptions{})->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(GaFrame, published, RmGaOptions::Published())->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace turbidock::vision
