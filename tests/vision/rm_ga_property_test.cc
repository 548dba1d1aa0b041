// The estimate depends on nothing but the pixels that the estimator says it can reach.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/paint_marker.h"
#include "vision/rm_ga.h"

namespace turbidock::vision {
namespace {

RmGa MakeSearch(const RmGaOptions& options) {
  return RmGa(options, MarkerParams{}, HueParams{}, RigParams{}.MakeRig(),
              SeedTree(6).Stream("ga"));
}

// A marker that comes closer at 0.2 m/s, drifts at 0.1 m/s and turns at 20 degrees a second.
Pose PoseAt(int frame) {
  const double t_s = frame / 30.0;
  return {FromYawPitchRoll(-0.1 + 0.349 * t_s, 0.03, 0.02),
          {0.9 - 0.2 * t_s, -0.05 + 0.1 * t_s, 0.02}};
}

void FillOutside(const PixelRegion& part, Rng* rng, Image3u8* image) {
  for (int v = 0; v < image->height(); ++v)
    for (int u = 0; u < image->width(); ++u) {
      if (part.Contains(u, v)) continue;
      const uint32_t garbage = rng->NextU32();
      for (int k = 0; k < 3; ++k) image->at(u, v)[k] = static_cast<uint8_t>(garbage >> 8 * k);
    }
}

TEST(RmGaReach, OtherPixelsDoNotMatter) {
  RmGa all = MakeSearch({}), reached = MakeSearch({});
  Rng noise = SeedTree(1).Stream("noise"), garbage = SeedTree(1).Stream("garbage");
  int confined = 0;
  double share = 0;
  for (int frame = 0; frame < 60; ++frame) {
    const StereoImage seen = testing::PaintMarker(MarkerParams{}, RigParams{}.MakeRig(),
                                                  PoseAt(frame), {.noise_dn = 1.5}, &noise);
    StereoImage spoilt = seen;
    ASSERT_EQ(all.RegionOfInterest(), reached.RegionOfInterest());
    if (const auto reach = reached.RegionOfInterest()) {
      FillOutside(reach->left, &garbage, &spoilt.left);
      FillOutside(reach->right, &garbage, &spoilt.right);
      ASSERT_NE(seen.left, spoilt.left);
      ++confined;
      share += reach->left.width() * reach->left.height() / (640.0 * 480);
    }
    const PoseEstimate& a = all.Update(seen);
    const PoseEstimate& b = reached.Update(spoilt);
    ASSERT_EQ(a.X_HM.p, b.X_HM.p) << frame;
    ASSERT_EQ(a.X_HM.q.coeffs(), b.X_HM.q.coeffs()) << frame;
    ASSERT_EQ(a.fitness, b.fitness) << frame;
    ASSERT_EQ(a.covariance, b.covariance) << frame;
  }
  EXPECT_GE(confined, 40);
  EXPECT_LT(share / confined, 0.25);
}

TEST(RmGaReach, HoldsTheMarkerAndIsGivenUpWithIt) {
  RmGa search = MakeSearch({});
  EXPECT_FALSE(search.RegionOfInterest());
  const StereoRig rig = RigParams{}.MakeRig();
  int held = 0;
  for (int frame = 0; frame < 60; ++frame) {
    const StereoImage seen = testing::PaintMarker(MarkerParams{}, rig, PoseAt(frame), {}, nullptr);
    if (const auto reach = search.RegionOfInterest())
      for (const BallParams& ball : MarkerParams{}.balls) {
        const Eigen::Vector3d p_HQ = PoseAt(frame) * ball.p_MQ_m;
        const BallCircle left =
            ProjectBall(rig.left, rig.left.X_HC.Inverse() * p_HQ, 1.4 * ball.radius_m);
        for (const auto& [du, dv] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}})
          EXPECT_TRUE(
              reach->left.Contains(static_cast<int>(std::lround(left.u_px + du * left.radius_px)),
                                   static_cast<int>(std::lround(left.v_px + dv * left.radius_px))))
              << frame << ball.name;
        ++held;
      }
    search.Update(seen);
  }
  EXPECT_GE(held, 120);
  const StereoImage blank{{Image3u8(640, 480, 8), Image3u8(640, 480, 8)}};
  for (int frame = 0; frame < 3; ++frame) {
    EXPECT_TRUE(search.RegionOfInterest());
    EXPECT_EQ(search.Update(blank).detected, frame < 2);
  }
  EXPECT_FALSE(search.RegionOfInterest());
}

TEST(RmGaReach, PublishedSearchReadsEverything) {
  RmGa search = MakeSearch(RmGaOptions::Published());
  const StereoImage seen =
      testing::PaintMarker(MarkerParams{}, RigParams{}.MakeRig(), PoseAt(0), {}, nullptr);
  for (int frame = 0; frame < 30; ++frame) {
    search.Update(seen);
    EXPECT_FALSE(search.RegionOfInterest());
  }
}

}  // namespace
}  // namespace turbidock::vision
