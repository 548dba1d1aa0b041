#include "vision/detection.h"

#include <gtest/gtest.h>

#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <span>

#include "vision/normalised_error.h"

namespace turbidock::vision {
namespace {

constexpr std::array<double, 3> kAllMatched = {0.8, 0.8, 0.8}, kTwoMatched = {0.9, 0.9, 0.1};

TEST(Detection, NeedsFramesInARowOnTheWayInAndOut) {
  Detection detection;
  const auto after = [&](double fitness) {
    detection.Update({.fitness = fitness, .ball_fitness = kAllMatched});
    return detection.detected();
  };
  EXPECT_FALSE(after(0.5));
  EXPECT_FALSE(after(0.39));  // begins anew
  EXPECT_FALSE(after(0.4));
  EXPECT_TRUE(after(0.4));
  for (int frame = 0; frame < 5; ++frame) EXPECT_TRUE(after(0.22));  // between the limits
  EXPECT_TRUE(after(0.21));
  EXPECT_TRUE(after(0.21));
  EXPECT_TRUE(after(0.22));  // begins anew
  EXPECT_TRUE(after(0.21));
  EXPECT_TRUE(after(0.21));
  EXPECT_FALSE(after(0.21));
  EXPECT_FALSE(after(0.39));
}

TEST(Detection, IsCertainFromAreaIOn) {
  Detection detection;
  for (int frames = 1; frames <= 3; ++frames) {
    detection.Update({.fitness = 0.6, .ball_fitness = kAllMatched});
    EXPECT_EQ(detection.frames_certain(), frames);
    EXPECT_EQ(detection.frames_uncertain(), 0);
  }
  for (int frames = 1; frames <= 3; ++frames) {
    detection.Update({.fitness = 0.59, .ball_fitness = kAllMatched});
    EXPECT_EQ(detection.frames_certain(), 0);
    EXPECT_EQ(detection.frames_uncertain(), frames);
  }
}

TEST(Detection, TwoBallsAreCertainOnATrackOnly) {
  Detection detection;
  detection.Update({.fitness = 0.63, .ball_fitness = kTwoMatched});
  EXPECT_EQ(detection.frames_uncertain(), 1);
  detection.Update({.fitness = 0.63, .ball_fitness = kTwoMatched, .is_tracked = true});
  EXPECT_EQ(detection.frames_certain(), 1);
}

TEST(Detection, AsksForTheOutlinesOfEachBallAndOfTwoOnATrack) {
  constexpr std::array<double, 3> kAllSeen = {0.9, 0.3, 0.9}, kTwoSeen = {0.9, 0.29, 0.9},
                                  kOneSeen = {0.9, 0.1, 0.29};
  Detection detection;
  const auto after = [&](std::span<const double> support, bool is_tracked) {
    for (int frame = 0; frame < 3; ++frame)
      detection.Update({.fitness = 0.8,
                        .ball_fitness = kAllMatched,
                        .ball_support = support,
                        .is_tracked = is_tracked});
    return detection.holds() && detection.frames_certain() >= 3;
  };
  EXPECT_FALSE(after(kTwoSeen, false));
  EXPECT_TRUE(after(kAllSeen, false));
  EXPECT_FALSE(after(kTwoSeen, false));
  EXPECT_TRUE(after(kTwoSeen, true));
  EXPECT_FALSE(after(kOneSeen, true));
}

// A pair of one image twice: one camera's image has the balls, the other's none of them.
TEST(Detection, AsksForBothCamerasAndForOneOnATrack) {
  constexpr std::array<double, 3> kHalfSeen = {0.5, 0.5, 0.5};
  const auto after = [&](const Stereo<double>& cameras, bool is_tracked) {
    Detection detection;
    for (int frame = 0; frame < 3; ++frame)
      detection.Update({.fitness = 0.6,
                        .ball_fitness = kAllMatched,
                        .ball_support = kHalfSeen,
                        .camera_support = cameras,
                        .is_tracked = is_tracked});
    return detection.holds() && detection.frames_certain() >= 3;
  };
  EXPECT_TRUE(after({0.5, 0.3}, false));
  EXPECT_FALSE(after({0.99, 0.29}, false));
  EXPECT_FALSE(after({0, 0.99}, false));
  EXPECT_TRUE(after({0, 0.99}, true));
}

// A track goes on for two balls; what it is worth without the third was shown before, or not.
TEST(Detection, TellsWhatATrackLacksOnlyAfterItWasConfirmed) {
  constexpr std::array<double, 3> kAllSeen = {0.9, 0.3, 0.9}, kTwoSeen = {0.9, 0.29, 0.9};
  const auto after = [&](int frames, double fitness, std::span<const double> support,
                         const Stereo<double>& cameras) {
    Detection detection;
    for (int frame = 0; frame < frames; ++frame)
      detection.Update({.fitness = 0.8,
                        .ball_fitness = kAllMatched,
                        .ball_support = kAllSeen,
                        .is_tracked = frame > 2});
    detection.Update({.fitness = fitness,
                      .ball_fitness = kAllMatched,
                      .ball_support = support,
                      .camera_support = cameras,
                      .is_tracked = true});
    EXPECT_TRUE(detection.holds());
    return detection.detected();
  };
  constexpr Stereo<double> kBoth{0.9, 0.9}, kOne{0.9, 0.29};
  constexpr int kFew = Detection::kConfirmedFrames - 1, kEnough = Detection::kConfirmedFrames;
  EXPECT_TRUE(after(kFew, 0.4, kAllSeen, kBoth));
  EXPECT_FALSE(after(kFew, 0.8, kTwoSeen, kBoth));
  EXPECT_FALSE(after(kFew, 0.39, kAllSeen, kBoth));
  EXPECT_FALSE(after(kFew, 0.8, kAllSeen, kOne));
  EXPECT_TRUE(after(kEnough, 0.8, kTwoSeen, kBoth));
  EXPECT_TRUE(after(kEnough, 0.39, kAllSeen, kBoth));
  EXPECT_TRUE(after(kEnough, 0.8, kAllSeen, kOne));
}

TEST(NormalisedError2, IsInStandardDeviationsSquared) {
  PoseEstimate estimate;
  const Pose true_X_HM{Eigen::Quaterniond(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitZ())),
                       {0.003, 0, 0}};
  estimate.covariance = PoseCovariance::Zero();
  estimate.covariance->diagonal() << 1e-6, 1e-6, 1e-6, 1e-4, 1e-4, 1e-4;  // 1 mm, 0.01 rad
  EXPECT_FALSE(NormalisedError2(estimate, true_X_HM)) << "not detected";
  estimate.detected = true;
  EXPECT_NEAR(NormalisedError2(estimate, true_X_HM).value_or(0), 9 + 4, 1e-9);
  estimate.covariance.reset();
  EXPECT_FALSE(NormalisedError2(estimate, true_X_HM)) << "claims nothing";
}

TEST(NormalisedError2, ThreeSigmaIsWhereAsMuchLiesBelowAsInOneDimension) {
  const double share = std::erf(3 / std::sqrt(2));
  EXPECT_NEAR(boost::math::quantile(boost::math::chi_squared(6), share), kThreeSigma2, 0.01);
}

}  // namespace
}  // namespace turbidock::vision
