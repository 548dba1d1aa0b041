#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sim/base/digest.h"
#include "tests/support/paint_marker.h"
#include "vision/rm_ga.h"

namespace turbidock::vision {
namespace {

// A marker that moves away at 0.1 m/s, seen with noise.
std::vector<StereoImage> Frames() {
  Rng noise = SeedTree(12).Stream("noise");
  std::vector<StereoImage> frames;
  for (int frame = 0; frame < 6; ++frame) {
    frames.push_back(turbidock::testing::PaintMarker(MarkerParams{}, RigParams{}.MakeRig(),
                                                     Pose::Translation(0.6 + 0.0033 * frame, 0, 0),
                                                     {.noise_dn = 1.5}, &noise));
    frames.back().frame = frame;
  }
  return frames;
}

void AddTo(Digest* digest, const PoseEstimate& estimate) {
  digest->Add(estimate.frame);
  digest->Add(estimate.X_HM);
  digest->Add(estimate.fitness);
  digest->Add(estimate.evaluations);
  for (const double fitness : estimate.ball_fitness) digest->Add(fitness);
}

std::string DigestOf(const std::vector<StereoImage>& frames, const RmGaOptions& options,
                     uint64_t seed, RmGa* beside = nullptr) {
  RmGa search(options, MarkerParams{}, HueParams{}, RigParams{}.MakeRig(),
              SeedTree(seed).Stream("ga"));
  Digest digest;
  for (const StereoImage& seen : frames) {
    AddTo(&digest, search.Update(seen));
    if (beside) beside->Update(seen);
  }
  return digest.Hex();
}

TEST(RmGaRepeat, SameStreamSameEstimates) {
  const std::vector<StereoImage> frames = Frames();
  for (const RmGaOptions& options : {RmGaOptions{}, RmGaOptions::Published()}) {
    const std::string digest = DigestOf(frames, options, 1);
    EXPECT_EQ(DigestOf(frames, options, 1), digest);
    EXPECT_NE(DigestOf(frames, options, 2), digest);
  }
}

TEST(RmGaRepeat, ASecondSearchBesideItChangesNothing) {
  RmGa beside(RmGaOptions{}, MarkerParams{}, HueParams{}, RigParams{}.MakeRig(),
              SeedTree(9).Stream("ga"));
  const std::vector<StereoImage> frames = Frames();
  EXPECT_EQ(DigestOf(frames, {}, 1, &beside), DigestOf(frames, {}, 1));
}

}  // namespace
}  // namespace turbidock::vision
