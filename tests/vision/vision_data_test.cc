// The data files of vision, and the search on path-traced images, which share no code with this
// project.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "sim/base/units.h"
#include "tests/support/path_traced.h"
#include "vision/refiner.h"
#include "vision/rm_ga.h"

namespace turbidock::vision {
namespace {

using turbidock::testing::PathTracedPair;
using turbidock::testing::PathTracedPairs;

const std::string kAssets = std::string(TURBIDOCK_TEST_DATA) + "/../../assets/";

TEST(VisionAssets, MarkerAndRigFilesAreTheDefaults) {
  MarkerParams marker;
  marker.balls.clear();
  marker.outer_ring_ratio = 2;
  marker.inner_ring_ratios = {};
  config::ReadFields(config::LoadYaml(kAssets + "marker_default.yaml"), &marker, nullptr);
  CheckFields(marker, "marker");
  EXPECT_EQ(config::SaveYaml(marker), config::SaveYaml(MarkerParams{}));

  RigParams rig{.width_px = 16, .height_px = 16, .horizontal_fov_rad = 2, .baseline_m = 1};
  config::ReadFields(config::LoadYaml(kAssets + "rig_default.yaml"), &rig, nullptr);
  EXPECT_EQ(config::SaveYaml(rig), config::SaveYaml(RigParams{}));
}

TEST(PathTraced, FitnessAtTheTruePose) {
  const MarkerParams marker;
  const StereoRig rig = RigParams{}.MakeRig();
  int pairs = 0;
  double mean = 0;
  for (const PathTracedPair& pair : PathTracedPairs()) {
    HueLabeller labeller(HueParams{}, marker);
    Stereo<Image1u8> labels;
    for (const Side side : kSides) labeller.Label(pair.seen[side], &labels[side]);
    const double f = Fitness(marker, rig, labels).Evaluate(pair.true_X_HM);
    EXPECT_GE(f, 0.70) << pair.name;
    EXPECT_LE(f, 0.95) << pair.name;
    mean += f;
    ++pairs;
  }
  ASSERT_EQ(pairs, 8);
  mean /= pairs;
  EXPECT_NEAR(mean, 0.84, 0.02);
}

// Without the gate on chroma the lit box passes for the green ball.
TEST(PathTraced, HueAloneDoesNotRecogniseTheActiveMarker) {
  const MarkerParams marker;
  HueParams hue_only;
  hue_only.own_chroma_fraction = 0;
  int active = 0;
  for (const PathTracedPair& pair : PathTracedPairs()) {
    if (!pair.name.starts_with("active")) continue;
    HueLabeller labeller(hue_only, marker);
    Stereo<Image1u8> labels;
    for (const Side side : kSides) labeller.Label(pair.seen[side], &labels[side]);
    const double f = Fitness(marker, RigParams{}.MakeRig(), labels).Evaluate(pair.true_X_HM);
    EXPECT_LT(f, 0.6) << pair.name;
    ++active;
  }
  EXPECT_EQ(active, 4);
}

// The default preset from a cold start; every pair at every seed.
TEST(PathTraced, EstimateFromAColdStart) {
  constexpr uint64_t kSeeds = 20;
  constexpr int kFrames = 30;
  std::vector<double> errors_mm;
  for (const PathTracedPair& pair : PathTracedPairs())
    for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
      RmGa search(RmGaOptions{}, MarkerParams{}, HueParams{}, RigParams{}.MakeRig(),
                  SeedTree(seed).Stream("ga"));
      PoseEstimate estimate;
      int64_t evaluations = 0;
      for (int frame = 0; frame < kFrames; ++frame) {
        estimate = search.Update(pair.seen);
        evaluations += estimate.evaluations;
      }
      errors_mm.push_back(units::MmFromM((estimate.X_HM.p - pair.true_X_HM.p).norm()));
      EXPECT_LE(errors_mm.back(), 10) << pair.name << ' ' << seed;
      EXPECT_LE(units::DegFromRad(AngleBetween(estimate.X_HM.q, pair.true_X_HM.q)), 3)
          << pair.name << ' ' << seed;
      EXPECT_TRUE(estimate.detected && estimate.covariance) << pair.name << ' ' << seed;
      EXPECT_GE(estimate.fitness, 0.7) << pair.name << ' ' << seed;
      EXPECT_LE(evaluations, kFrames * 540);
    }
  ASSERT_EQ(errors_mm.size(), 8 * kSeeds);
  std::sort(errors_mm.begin(), errors_mm.end());
  EXPECT_LE(errors_mm[errors_mm.size() / 2], 3);  // measured: 0.5, worst 2.0
}

// As white balance in coastal water leaves them: of 24, 9 were detected before casts were taken
// out.
TEST(PathTraced, AGreenSeaHidesNoMarker) {
  constexpr std::array<double, 3> kCast = {0.45, 1, 0.6};
  int right = 0;
  for (PathTracedPair& pair : PathTracedPairs()) {
    for (const Side side : kSides)
      for (int i = 0; i < 3 * 640 * 480; ++i) {
        uint8_t& value = pair.seen[side].data()[i];
        value = static_cast<uint8_t>(std::lround(kCast[static_cast<size_t>(i % 3)] * value));
      }
    for (uint64_t seed = 1; seed <= 3; ++seed) {
      RmGa search(RmGaOptions{}, MarkerParams{}, HueParams{}, RigParams{}.MakeRig(),
                  SeedTree(seed).Stream("ga"));
      PoseEstimate estimate;
      for (int frame = 0; frame < 15; ++frame) estimate = search.Update(pair.seen);
      const bool is_right = units::MmFromM((estimate.X_HM.p - pair.true_X_HM.p).norm()) <= 10 &&
                            units::DegFromRad(AngleBetween(estimate.X_HM.q, pair.true_X_HM.q)) <= 3;
      EXPECT_TRUE(is_right || !estimate.detected) << pair.name << ' ' << seed;
      right += is_right && estimate.detected;
    }
  }
  EXPECT_GE(right, 22);  // measured: 24
}

// On most of these pairs the box hides up to half of the blue ball.
TEST(PathTraced, RefinementKnowsWhatTheBoxHides) {
  MarkerParams no_box;
  no_box.box_m.setZero();
  const StereoRegion whole{{0, 0, 640, 480}, {0, 0, 640, 480}};
  double worst_mm = 0, with_mm = 0, without_mm = 0;
  int hidden = 0;
  for (const PathTracedPair& pair : PathTracedPairs()) {
    PoseRefiner knowing(MarkerParams{}, RigParams{}.MakeRig());
    PoseRefiner unknowing(no_box, RigParams{}.MakeRig());
    const auto a = knowing.Refine(pair.seen, whole, pair.true_X_HM);
    const auto b = unknowing.Refine(pair.seen, whole, pair.true_X_HM);
    ASSERT_TRUE(a && b) << pair.name;
    EXPECT_LE(a->edges, b->edges);
    hidden += a->edges < b->edges;
    const double error_mm = units::MmFromM((a->X_HM.p - pair.true_X_HM.p).norm());
    worst_mm = std::max(worst_mm, error_mm);
    with_mm += error_mm;
    without_mm += units::MmFromM((b->X_HM.p - pair.true_X_HM.p).norm());
  }
  EXPECT_GE(hidden, 4);  // on the others the box hides nothing
  EXPECT_LT(worst_mm, 2.5);
  EXPECT_GT(without_mm, with_mm);
}

}  // namespace
}  // namespace turbidock::vision
