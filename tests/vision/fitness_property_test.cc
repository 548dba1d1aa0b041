#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>
#include <vector>

#include "sim/base/random.h"
#include "tests/support/awkward.h"
#include "vision/fitness.h"
#include "vision/gene.h"

namespace turbidock::vision {
namespace {

void FillWithNoise(double density, Rng* rng, Image1u8* labels) {
  for (size_t i = 0; i < labels->pixels(); ++i) {
    uint8_t label = 0;
    for (int b = 0; b < 3; ++b) label |= static_cast<uint8_t>((rng->Uniform() < density) << b);
    labels->data()[i] = label;
  }
}

class FitnessLaw : public ::testing::Test {
 protected:
  const StereoRig rig_ = RigParams{}.MakeRig();
  Stereo<Image1u8> labels_{{640, 480}, {640, 480}};
  const Fitness fitness_{MarkerParams{}, rig_, labels_};
  Rng rng_ = SeedTree(3).Stream("noise");
};

TEST_F(FitnessLaw, StaysInItsRangeAndIsTheMeanOfItsParts) {
  std::vector<Pose> poses = testing::AwkwardPoses();
  const GeneMap map{SearchRange{}};
  for (int i = 0; i < 300; ++i) {
    Gene gene;
    for (uint16_t& field : gene.fields) field = static_cast<uint16_t>(rng_.Below(kFieldMax + 1));
    poses.push_back(GeneMap::PoseOf(map.Decode(gene)));
  }
  for (const double density : {0.02, 0.5, 0.98}) {
    FillWithNoise(density, &rng_, &labels_.left);
    FillWithNoise(density, &rng_, &labels_.right);
    int different = 0;
    double last = 2;
    for (const Pose& X_HM : poses) {
      const FitnessByBall by_ball = fitness_.EvaluateByBall(X_HM);
      ASSERT_GE(by_ball.fitness, -1);
      ASSERT_LE(by_ball.fitness, 1);
      EXPECT_EQ(by_ball.fitness, fitness_.Evaluate(X_HM));
      double sum = 0;
      for (int b = 0; b < 3; ++b) {
        ASSERT_LE(std::abs(by_ball.in.left[b]), 1);
        ASSERT_LE(std::abs(by_ball.in.right[b]), 1);
        sum += by_ball.ball(b);
      }
      EXPECT_NEAR(by_ball.fitness, sum / 3, 1e-12);
      different += by_ball.fitness != last;
      last = by_ball.fitness;
    }
    EXPECT_GT(different, 200);
  }
}

TEST_F(FitnessLaw, NoiseHasTheExpectedMean) {
  // E[F] = 0.2 (2 p - 1) where each point matches with probability p.
  const double density = 0.25;
  FillWithNoise(density, &rng_, &labels_.left);
  FillWithNoise(density, &rng_, &labels_.right);
  double sum = 0;
  int n = 0;
  for (double x_m = 0.5; x_m < 0.9; x_m += 0.01)
    for (double y_m = -0.05; y_m < 0.05; y_m += 0.01, ++n)
      sum += fitness_.Evaluate(Pose::Translation(x_m, y_m, 0));
  EXPECT_GE(n, 400);
  // The standard deviation of one F is 0.05; 400 overlapping circles average to about a tenth.
  EXPECT_NEAR(sum / n, -0.1, 0.01);
}

TEST_F(FitnessLaw, QAndMinusQAreTheSamePose) {
  FillWithNoise(0.3, &rng_, &labels_.left);
  FillWithNoise(0.3, &rng_, &labels_.right);
  const Pose X_HM = Pose::FromVectorPart({0.7, 0.02, 0.03}, {0.05, -0.1, 0.14});
  Pose negated = X_HM;
  negated.q.coeffs() = -negated.q.coeffs();
  EXPECT_EQ(fitness_.Evaluate(X_HM), fitness_.Evaluate(negated));
}

std::vector<Pose> PosesThatReachOverTheEdges(Rng* rng) {
  std::vector<Pose> poses = testing::AwkwardPoses();
  for (int i = 0; i < 700; ++i)
    poses.push_back(Pose::FromVectorPart(
        {rng->Uniform(0.02, 1.6), rng->Uniform(-0.5, 0.5), rng->Uniform(-0.4, 0.4)},
        {rng->Uniform(-0.4, 0.4), rng->Uniform(-0.4, 0.4), rng->Uniform(-0.4, 0.4)}));
  return poses;
}

TEST_F(FitnessLaw, ManyAtOnceAreTheSameBitsAsOneByOne) {
  FillWithNoise(0.4, &rng_, &labels_.left);
  FillWithNoise(0.4, &rng_, &labels_.right);
  const std::vector<Pose> poses = PosesThatReachOverTheEdges(&rng_);
  Fitness fitness = fitness_;
  for (const StereoRegion& region : {StereoRegion{{0, 0, 640, 480}, {0, 0, 640, 480}},
                                     {{201, 153, 402, 377}, {150, 101, 353, 300}},
                                     {{100, 100, 100, 100}, {0, 0, 640, 480}}}) {
    fitness.Confine(region);
    std::vector<double> together(poses.size());
    for (const size_t count : {size_t{1}, size_t{24}, size_t{33}, poses.size()}) {
      std::fill(together.begin(), together.end(), 7);
      fitness.EvaluateAll(std::span(poses).first(count), std::span(together).first(count));
      for (size_t i = 0; i < count; ++i) ASSERT_EQ(together[i], fitness.Evaluate(poses[i])) << i;
      for (size_t i = count; i < poses.size(); ++i) ASSERT_EQ(together[i], 7);
    }
  }
}

TEST_F(FitnessLaw, OutsideItsRegionNothingMatchesWhateverTheLabels) {
  FillWithNoise(0.4, &rng_, &labels_.left);
  FillWithNoise(0.4, &rng_, &labels_.right);
  const StereoRegion region{{201, 153, 402, 377}, {150, 101, 353, 300}};
  Stereo<Image1u8> inside{{640, 480, 0}, {640, 480, 0}};  // the region's labels and nothing else
  for (const Side side : kSides) {
    const PixelRegion& part = region[side];
    for (int v = part.row_begin; v < part.row_end; ++v)
      std::copy_n(labels_[side].at(part.column_begin, v), part.width(),
                  inside[side].at(part.column_begin, v));
  }
  const Fitness plain(MarkerParams{}, rig_, inside);
  Fitness confined = fitness_;
  confined.Confine(region);
  int partly = 0;
  for (const Pose& X_HM : PosesThatReachOverTheEdges(&rng_)) {
    EXPECT_EQ(confined.Evaluate(X_HM), plain.Evaluate(X_HM));
    partly += confined.Evaluate(X_HM) != fitness_.Evaluate(X_HM);
  }
  EXPECT_GT(partly, 200);
}

}  // namespace
}  // namespace turbidock::vision
