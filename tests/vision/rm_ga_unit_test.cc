#include "vision/rm_ga.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <new>

#include "tests/support/paint_marker.h"

namespace {
int64_t allocations = 0;
}  // namespace

// Counts what this binary takes from the heap.
[[gnu::noinline]] void* operator new(size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, const std::nothrow_t&) noexcept {
  std::free(memory);
}

namespace turbidock::vision {
namespace {

using ::testing::HasSubstr;

const Pose kTrue = Pose::FromVectorPart({0.6, 0.03, -0.02}, {0.01, -0.02, 0.05});

StereoImage Blank() {
  StereoImage seen;
  seen.left.Resize(640, 480);
  seen.right.Resize(640, 480);
  return seen;
}

StereoImage Painted(const Pose& X_HM = kTrue) {
  return turbidock::testing::PaintMarker(MarkerParams{}, RigParams{}.MakeRig(), X_HM, {}, nullptr);
}

RmGa MakeSearch(const RmGaOptions& options, uint64_t seed = 1) {
  return RmGa(options, MarkerParams{}, HueParams{}, RigParams{}.MakeRig(),
              SeedTree(seed).Stream("ga"));
}

std::string ProblemOf(const RmGaOptions& options) {
  try {
    MakeSearch(options);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(RmGaOptions, BothPresetsAreValid) {
  EXPECT_EQ(ProblemOf(RmGaOptions{}), "");
  EXPECT_EQ(ProblemOf(RmGaOptions::Published()), "");
}

TEST(RmGaOptions, PublishedPresetHasThePublishedNumbers) {
  const RmGaOptions options = RmGaOptions::Published();
  EXPECT_EQ(options.population, 60);
  EXPECT_EQ(options.generations_per_frame, 9);
  EXPECT_EQ(options.selection_rate, 0.6);
  EXPECT_EQ(options.mutation_rate, 0.1);
  EXPECT_EQ(options.local_mutation_rate, 0);
  EXPECT_EQ(options.restart_after_frames, 0);
  EXPECT_FALSE(options.track);
  EXPECT_FALSE(options.refine);
}

TEST(RmGaOptions, RefusesWhatCannotWork) {
  RmGaOptions options;
  options.population = 2;
  EXPECT_THAT(ProblemOf(options), HasSubstr("estimator.rm_ga.population"));
  options = {};
  options.local_mutation_rate = 1.1;
  EXPECT_THAT(ProblemOf(options), HasSubstr("estimator.rm_ga.local_mutation_rate"));
  options = {};
  options.range.x_min_m = 2;
  EXPECT_THAT(ProblemOf(options), HasSubstr("estimator.rm_ga.range.x_max_m"));
}

TEST(RmGa, RefusesImagesOfAnotherSize) {
  RmGa search = MakeSearch({});
  StereoImage seen = Blank();
  seen.right.Resize(320, 240);
  try {
    search.Update(seen);
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("right image: 320 x 240 pixels"));
    EXPECT_THAT(error.what(), HasSubstr("640 x 480"));
  }
}

TEST(RmGa, KeepsToItsBudgetWhateverItSees) {
  RmGa published = MakeSearch(RmGaOptions::Published());
  RmGa ours = MakeSearch({});
  // Refined, with nothing to refine, and refined again.
  for (const StereoImage& seen : {Painted(), Blank(), Painted()}) {
    EXPECT_EQ(published.Update(seen).evaluations, 60 + 9 * 24);
    const PoseEstimate& estimate = ours.Update(seen);
    EXPECT_EQ(estimate.evaluations, 60 + 20 * 24 - (estimate.covariance ? 0 : 1));
  }
}

TEST(RmGa, ReportsFrameAndFitnessOfItsPose) {
  StereoImage seen = Painted();
  seen.frame = 41;
  RmGa search = MakeSearch({});
  for (int frame = 0; frame < 20; ++frame) search.Update(seen);
  const PoseEstimate& estimate = search.Update(seen);
  EXPECT_EQ(estimate.frame, 41);
  EXPECT_GT(estimate.fitness, 0.9);
  ASSERT_EQ(estimate.ball_fitness.size(), 3u);
  EXPECT_NEAR((estimate.ball_fitness[0] + estimate.ball_fitness[1] + estimate.ball_fitness[2]) / 3,
              estimate.fitness, 1e-12);
  EXPECT_GE(estimate.X_HM.q.w(), 0);
  EXPECT_TRUE(estimate.X_HM.IsFinite());
}

TEST(RmGa, NeverForgetsTheBestOfAnUnchangedImage) {
  const StereoImage seen = Painted();
  for (const RmGaOptions& options : {RmGaOptions{}, RmGaOptions::Published()}) {
    RmGa search = MakeSearch(options, 7);
    double best = -1;
    for (int frame = 0; frame < 40; ++frame) {
      const double fitness = search.Update(seen).fitness;
      EXPECT_GE(fitness, best);
      best = fitness;
    }
  }
}

TEST(RmGa, ResetForgetsTheTrack) {
  const StereoImage seen = Painted();
  RmGa search = MakeSearch({});
  for (int frame = 0; frame < 20; ++frame) search.Update(seen);
  ASSERT_GT(search.Update(seen).fitness, 0.9);
  search.Reset();
  // On a blank image every pose is as good as any other, so the first of the new population shows.
  const Eigen::Vector3d p = search.Update(Blank()).X_HM.p;
  EXPECT_GT((p - kTrue.p).norm(), 0.05);
}

// A population that can only be recombined: once it has come together far from the marker, nothing
// but a restart takes it away.
TEST(RmGa, RestartsAfterTheGivenNumberOfUncertainFrames) {
  RmGaOptions options = RmGaOptions::Published();
  options.mutation_rate = 0;
  options.range = {0.55, 0.65, 0.15, 0.15, 0.05};
  const StereoImage here = Painted(), elsewhere = Painted(Pose::Translation(0.6, -0.1, 0.1));
  for (const int frames : {0, 5, 8}) {
    options.restart_after_frames = frames;
    RmGa search = MakeSearch(options);
    for (int frame = 0; frame < 30; ++frame) search.Update(here);
    const PoseEstimate found = search.Update(here);
    ASSERT_GE(found.fitness, 0.6);
    for (int frame = 0; frame < (frames == 0 ? 40 : frames); ++frame) {
      const PoseEstimate& estimate = search.Update(elsewhere);
      EXPECT_LT((estimate.X_HM.p - found.X_HM.p).norm(), 0.05) << frames << ' ' << frame;
    }
    if (frames == 0) continue;
    EXPECT_GT((search.Update(elsewhere).X_HM.p - found.X_HM.p).norm(), 0.05) << frames;
  }
}

TEST(RmGa, StaysInsideItsSearchRange) {
  RmGaOptions options;
  options.range = {0.5, 0.7, 0.05, 0.06, 0.02};
  RmGa search = MakeSearch(options);
  const StereoImage outside = Painted(Pose::FromVectorPart({0.9, 0.1, 0.1}, {0, 0, 0.1}));
  for (int frame = 0; frame < 30; ++frame) {
    const Pose& X_HM = search.Update(outside).X_HM;
    EXPECT_GE(X_HM.p.x(), 0.5 - 1e-12);
    EXPECT_LE(X_HM.p.x(), 0.7 + 1e-12);
    EXPECT_LE(std::abs(X_HM.p.y()), 0.05 + 1e-12);
    EXPECT_LE(std::abs(X_HM.p.z()), 0.06 + 1e-12);
    EXPECT_LE(X_HM.q.vec().cwiseAbs().maxCoeff(), 0.02 + 1e-12);
  }
}

TEST(RmGa, AllocatesNothingAfterTheFirstFrame) {
  const StereoImage seen = Painted(), blank = Blank();
  for (RmGaOptions options : {RmGaOptions{}, RmGaOptions::Published()}) {
    options.restart_after_frames = 2;
    RmGa search = MakeSearch(options);
    search.Update(seen);
    const int64_t before = allocations;
    ASSERT_GT(before, 0);
    for (int frame = 0; frame < 4; ++frame) search.Update(seen);
    for (int frame = 0; frame < 6; ++frame) search.Update(blank);
    EXPECT_EQ(allocations, before);
  }
}

TEST(RmGa, DetectsNothingInNoise) {
  Rng rng = SeedTree(21).Stream("noise");
  int frames = 0;
  for (uint64_t seed = 0; seed < 6; ++seed) {
    RmGa search = MakeSearch({}, seed);
    StereoImage seen = Blank();
    for (Image3u8* image : {&seen.left, &seen.right})
      for (size_t i = 0; i < 3 * image->pixels(); i += 4) {
        const uint32_t bits = rng.NextU32();
        for (size_t k = 0; k < 4 && i + k < 3 * image->pixels(); ++k)
          image->data()[i + k] = static_cast<uint8_t>(60 + (bits >> 8 * k & 0xff) / (3 + seed));
      }
    for (int frame = 0; frame < 30; ++frame, ++frames) EXPECT_FALSE(search.Update(seen).detected);
  }
  EXPECT_EQ(frames, 180);
}

TEST(RmGa, TracksAMovingMarkerWithoutLosingIt) {
  // Back and forth at 0.2 m/s and 20 degrees a second, with noise.
  Rng noise = SeedTree(3).Stream("noise");
  for (uint64_t seed = 1; seed <= 2; ++seed) {
    RmGa search = MakeSearch({}, seed);
    const double way = 2.1 * static_cast<double>(seed);
    for (int frame = 0; frame < 65; ++frame) {
      const double t_s = std::abs(std::fmod(frame / 30.0, 2.0) - 1);
      const Eigen::Vector3d moved =
          0.2 * (t_s - 0.5) * Eigen::Vector3d(std::cos(way), std::sin(way), 0);
      const Pose X_HM{FromYawPitchRoll(-0.17 + 0.349 * t_s, 0.02, -0.03),
                      Eigen::Vector3d(0.8, 0, 0.02) + moved};
      MarkerParams marker;
      const StereoImage seen = turbidock::testing::PaintMarker(marker, RigParams{}.MakeRig(), X_HM,
                                                               {.noise_dn = 1.5}, &noise);
      const PoseEstimate& estimate = search.Update(seen);
      if (frame < 30) continue;
      EXPECT_TRUE(estimate.detected) << seed << ' ' << frame;
      EXPECT_LT((estimate.X_HM.p - X_HM.p).norm(), 0.01) << seed << ' ' << frame;
    }
  }
}

}  // namespace
}  // namespace turbidock::vision
