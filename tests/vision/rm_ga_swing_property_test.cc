// A ball of which little can be seen: two balls hold the marker, and what is left of the third's
// outline tells how far it is turned about their line.

#include <gtest/gtest.h>

#include "sim/base/units.h"
#include "tests/support/paint_marker.h"
#include "vision/rm_ga.h"

namespace turbidock::vision {
namespace {

const Pose kTrue = Pose::FromVectorPart({0.6, 0.03, -0.02}, {0.03, -0.06, 0.09});
const StereoRig kRig = RigParams{}.MakeRig();

RmGa MakeSearch(uint64_t seed) {
  return RmGa(RmGaOptions{}, MarkerParams{}, HueParams{}, kRig, SeedTree(seed).Stream("ga"));
}

// Greys what lies on that side of a line across the ball, `share` of its radius off the centre.
void Cover(const BallParams& ball, const CameraIntrinsics& camera, const Pose& X_HC, double share,
           Image3u8* image) {
  const BallCircle circle =
      ProjectBall(camera, X_HC.Inverse() * (kTrue * ball.p_MQ_m), ball.radius_m);
  const auto first = static_cast<int>(circle.u_px + share * circle.radius_px);
  const auto middle = static_cast<int>(circle.v_px), half = static_cast<int>(circle.radius_px) + 3;
  for (int v = middle - half; v <= middle + half; ++v)
    for (int u = first; u <= first + 3 * half; ++u)
      for (int k = 0; k < 3; ++k) image->at(u, v)[k] = 8;
}

// The blue ball but for a crescent: less than what counts as matched.
StereoImage Seen(Rng* noise) {
  const MarkerParams marker;
  StereoImage seen = testing::PaintMarker(marker, kRig, kTrue, {.noise_dn = 1.5}, noise);
  Cover(marker.balls[2], kRig.left, kRig.left.X_HC, -0.5, &seen.left);
  Cover(marker.balls[2], kRig.right, kRig.right.X_HC, -0.5, &seen.right);
  return seen;
}

// Without the swing 8 of the 12 searches, each on its image, end within 5 degrees.
TEST(RmGaSwing, FindsTheTurnAboutTwoBalls) {
  Rng noise = SeedTree(4).Stream("noise");
  int found = 0;
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    const StereoImage seen = Seen(&noise);
    RmGa search = MakeSearch(seed);
    for (int frame = 0; frame < 29; ++frame)
      EXPECT_LE(search.Update(seen).evaluations, 540) << seed << ' ' << frame;
    const PoseEstimate& estimate = search.Update(seen);
    EXPECT_LT(estimate.ball_fitness[2], Detection::kMatchedBallFitness) << seed;
    found += AngleBetween(estimate.X_HM.q, kTrue.q) < units::RadFromDeg(5);
  }
  EXPECT_GE(found, 11);
}

TEST(RmGaSwing, Repeats) {
  Rng noise = SeedTree(5).Stream("noise");
  const StereoImage seen = Seen(&noise);
  RmGa a = MakeSearch(3), b = MakeSearch(3);
  for (int frame = 0; frame < 12; ++frame) {
    EXPECT_EQ(a.Update(seen).X_HM.p, b.Update(seen).X_HM.p) << frame;
    EXPECT_EQ(a.Update(seen).X_HM.q.coeffs(), b.Update(seen).X_HM.q.coeffs()) << frame;
  }
}

// A track goes on when a ball disappears, however long.
TEST(RmGaSwing, ATrackHoldsWithoutTheThirdBall) {
  Rng noise = SeedTree(6).Stream("noise");
  const StereoImage all =
      testing::PaintMarker(MarkerParams{}, kRig, kTrue, {.noise_dn = 1.5}, &noise);
  const StereoImage two = Seen(&noise);
  RmGa search = MakeSearch(1);
  for (int frame = 0; frame < 30; ++frame) search.Update(all);
  ASSERT_TRUE(search.RegionOfInterest());
  for (int frame = 0; frame < 40; ++frame) {
    const PoseEstimate& estimate = search.Update(two);
    EXPECT_TRUE(estimate.detected) << frame;
    EXPECT_TRUE(search.RegionOfInterest()) << frame;
    EXPECT_LT((estimate.X_HM.p - kTrue.p).norm(), 0.01) << frame;
    EXPECT_LT(estimate.ball_fitness[2], 0.2) << frame;
  }
}

}  // namespace
}  // namespace turbidock::vision
