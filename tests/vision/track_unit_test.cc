#include "vision/track.h"

#include <gtest/gtest.h>

namespace turbidock::vision {
namespace {

const StereoRig kRig = RigParams{}.MakeRig();

// A frame in which the whole marker is seen at that pose, or nothing of it.
struct Seen {
  PoseEstimate estimate;
  Detection detection;

  void Update(const Pose& X_HM, double fitness, bool is_tracked) {
    estimate.X_HM = X_HM;
    estimate.fitness = fitness;
    estimate.ball_fitness = {fitness, fitness, fitness};
    detection.Update(
        {.fitness = fitness, .ball_fitness = estimate.ball_fitness, .is_tracked = is_tracked});
  }
};

Pose At(double x_m, double y_m) { return Pose::Translation(x_m, y_m, 0); }

TEST(Track, FollowsAfterThreeCertainFrames) {
  Track track(SearchRange{}, MarkerParams{}, kRig);
  Seen seen;
  for (int frame = 0; frame < 2; ++frame) {
    seen.Update(At(0.8, 0.1), 0.9, false);
    EXPECT_FALSE(track.Update(seen.estimate, seen.detection));
    EXPECT_FALSE(track.region());
  }
  seen.Update(At(0.8, 0.1), 0.9, false);
  EXPECT_TRUE(track.Update(seen.estimate, seen.detection));
  ASSERT_TRUE(track.region());
  EXPECT_NEAR(track.range().low()[0], 0.8 - 0.064, 1e-12);
  EXPECT_NEAR(track.range().high()[0], 0.8 + 0.064, 1e-12);
  EXPECT_NEAR(track.range().low()[1], 0.07, 1e-12);
  EXPECT_NEAR(track.range().high()[1], 0.13, 1e-12);
  EXPECT_NEAR(track.range().low()[5], -0.05, 1e-12);
}

TEST(Track, StaysInsideTheSearchRange) {
  Track track(SearchRange{}, MarkerParams{}, kRig);
  Seen seen;
  for (int frame = 0; frame < 3; ++frame) {
    seen.Update(At(0.8, 0.39), 0.9, false);
    track.Update(seen.estimate, seen.detection);
  }
  EXPECT_EQ(track.range().high()[1], 0.4);
}

TEST(Track, LooksWhereConstantVelocityLeads) {
  Track track(SearchRange{}, MarkerParams{}, kRig);
  Seen seen;
  constexpr double kStep_m = 0.004;
  for (int frame = 0; frame < 40; ++frame) {
    seen.Update(At(0.8, kStep_m * frame), 0.9, track.region().has_value());
    track.Update(seen.estimate, seen.detection);
  }
  EXPECT_NEAR(track.motion()[1], kStep_m, 1e-5);
  EXPECT_NEAR(0.5 * (track.range().low()[1] + track.range().high()[1]), 40 * kStep_m, 1e-5);
  EXPECT_NEAR(track.motion()[0], 0, 1e-12);
}

TEST(Track, HoldsTheOutlinesOfAllBallsInItsRegion) {
  Track track(SearchRange{}, MarkerParams{}, kRig);
  Seen seen;
  for (int frame = 0; frame < 3; ++frame) {
    seen.Update(At(0.8, 0), 0.9, false);
    track.Update(seen.estimate, seen.detection);
  }
  ASSERT_TRUE(track.region());
  int checked = 0;
  for (const double x_m : {0.74, 0.86})
    for (const double y_m : {-0.03, 0.03})
      for (const BallParams& ball : MarkerParams{}.balls) {
        const Eigen::Vector3d p_HQ = At(x_m, y_m) * ball.p_MQ_m;
        const BallCircle circle =
            ProjectBall(kRig.left, kRig.left.X_HC.Inverse() * p_HQ, 1.6 * ball.radius_m);
        for (const int side : {-1, 1}) {
          EXPECT_TRUE(track.region()->left.Contains(
              static_cast<int>(circle.u_px + side * circle.radius_px),
              static_cast<int>(circle.v_px + side * circle.radius_px)));
          ++checked;
        }
      }
  EXPECT_EQ(checked, 24);
}

TEST(Track, GivesUpWhenTheMarkerIsNotDetectedOrLongUncertain) {
  for (const double fitness : {0.1, 0.5}) {
    Track track(SearchRange{}, MarkerParams{}, kRig);
    Seen seen;
    for (int frame = 0; frame < 3; ++frame) {
      seen.Update(At(0.8, 0), 0.9, false);
      track.Update(seen.estimate, seen.detection);
    }
    int held = 0;
    while (track.region() && held < 100) {
      seen.Update(At(0.8, 0), fitness, true);
      EXPECT_TRUE(track.Update(seen.estimate, seen.detection));  // another range, the last one too
      ++held;
    }
    EXPECT_EQ(held, fitness < 0.22 ? 3 : 5);
    EXPECT_EQ(track.range().low(), GeneMap(SearchRange{}).low());
    EXPECT_EQ(track.motion(), GeneMap::Values{});
    EXPECT_FALSE(track.Update(seen.estimate, seen.detection));
  }
}

TEST(Track, ForgetsWhenReset) {
  Track track(SearchRange{}, MarkerParams{}, kRig);
  Seen seen;
  for (int frame = 0; frame < 3; ++frame) {
    seen.Update(At(0.8, 0), 0.9, false);
    track.Update(seen.estimate, seen.detection);
  }
  track.Reset();
  EXPECT_FALSE(track.region());
  EXPECT_EQ(track.range().high(), GeneMap(SearchRange{}).high());
}

}  // namespace
}  // namespace turbidock::vision
