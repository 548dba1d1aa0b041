#include "vision/genetic_search.h"

#include <gtest/gtest.h>

#include "sim/base/pose.h"
#include "tests/support/paint_marker.h"
#include "vision/hue_labels.h"

namespace turbidock::vision {
namespace {

const Pose kTrue = Pose::FromVectorPart({0.6, 0.03, -0.02}, {0.01, -0.02, 0.05});
const StereoRig kRig = RigParams{}.MakeRig();

// The labels of a painted marker, and F on them.
struct View {
  explicit View(const Pose& X_HM) : fitness(MarkerParams{}, kRig, labels) {
    const StereoImage seen = testing::PaintMarker(MarkerParams{}, kRig, X_HM, {}, nullptr);
    HueLabeller labeller(HueParams{}, MarkerParams{});
    for (const Side side : kSides) labeller.Label(seen[side], &labels[side]);
  }
  Stereo<Image1u8> labels;
  Fitness fitness;
};

TEST(GeneticSearch, CountsItsEvaluationsAndLeavesWhatItIsTold) {
  const View view(kTrue);
  GeneticSearch search({}, MarkerParams{}, &view.fitness);
  Rng rng = SeedTree(1).Stream("ga");
  search.BeginFrame(false, &rng);
  EXPECT_EQ(search.evaluations(), 60);
  search.Breed(0, &rng);
  EXPECT_EQ(search.evaluations(), 60 + 24);
  search.Breed(3, &rng);
  EXPECT_EQ(search.evaluations(), 60 + 24 + 21);
  search.BeginFrame(false, &rng);
  EXPECT_EQ(search.evaluations(), 60);
}

TEST(GeneticSearch, TheBestIsNeverLost) {
  const View view(kTrue);
  GeneticSearch search({}, MarkerParams{}, &view.fitness);
  Rng rng = SeedTree(2).Stream("ga");
  double best = -1;
  for (int frame = 0; frame < 20; ++frame) {
    search.BeginFrame(frame % 5 == 4, &rng);  // restarts keep it too
    for (int i = 0; i < 20; ++i) search.Breed(0, &rng);
    const double f = view.fitness.Evaluate(search.best_X_HM());
    EXPECT_GE(f, best) << frame;
    best = f;
  }
  EXPECT_GE(best, 0.6);  // two balls at least
}

TEST(GeneticSearch, TakesInAPose) {
  const View view(kTrue);
  Rng rng = SeedTree(3).Stream("ga");
  GeneticSearch search({}, MarkerParams{}, &view.fitness);
  search.BeginFrame(false, &rng);
  EXPECT_LT(view.fitness.Evaluate(search.best_X_HM()), 0.5);
  search.Insert(kTrue);
  search.BeginFrame(false, &rng);
  EXPECT_LT((search.best_X_HM().p - kTrue.p).norm(), 0.001);
}

TEST(GeneticSearch, MovesItsPopulationIntoAnotherRange) {
  const View view(kTrue);
  GeneticSearch search({}, MarkerParams{}, &view.fitness);
  Rng rng = SeedTree(4).Stream("ga");
  search.BeginFrame(false, &rng);
  search.Insert(kTrue);
  search.BeginFrame(false, &rng);
  const Pose before = search.best_X_HM();
  const GeneMap whole{SearchRange{}};
  GeneMap::Values motion{0.01, -0.02, 0.03, 0, 0, 0.01};
  search.SearchIn(whole.Around({0.6, 0, 0, 0, 0, 0.05}, {0.1, 0.1, 0.1, 0.1, 0.1, 0.1}), motion);
  const Pose after = search.best_X_HM();
  EXPECT_LT((after.p - before.p - Eigen::Vector3d(0.01, -0.02, 0.03)).norm(), 1e-3);
  EXPECT_NEAR(after.q.z() - before.q.z(), 0.01, 1e-3);
  // What the range does not hold comes to its end.
  search.SearchIn(whole.Around({1.2, 0, 0, 0, 0, 0}, {0.1, 0.1, 0.1, 0.1, 0.1, 0.1}), {});
  EXPECT_NEAR(search.best_X_HM().p.x(), 1.1, 1e-12);
}

}  // namespace
}  // namespace turbidock::vision
