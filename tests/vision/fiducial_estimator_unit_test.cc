// Tags painted into both images as a closed form has them, found again.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sim/base/units.h"
#include "tests/support/message_of.h"
#include "tests/support/paint_tags.h"
#include "vision/fiducial_estimator.h"

namespace turbidock::vision {
namespace {

using ::testing::HasSubstr;
using testing::Paint;

FiducialParams TwoTags() {
  FiducialParams params;
  params.tags = {{.id = 0, .p_MT_m = {0.1, 0.15, -0.06}}, {.id = 7, .p_MT_m = {0.1, -0.15, 0.08}}};
  return params;
}

const Pose kAhead = {FromYawPitchRoll(0.1, -0.05, 0.03), {0.7, 0.03, -0.02}};

TEST(FiducialEstimator, FindsThePoseThatWasPainted) {
  const StereoRig rig = RigParams{}.MakeRig();
  FiducialEstimator estimator(TwoTags(), rig);
  for (const Pose& X_HM : {kAhead, Pose{FromYawPitchRoll(-0.15, 0.1, 0), {1.2, -0.1, 0.1}},
                           Pose::Translation(0.35, 0, 0)}) {
    estimator.Reset();  // they are far from each other
    const PoseEstimate& estimate = estimator.Update(Paint(TwoTags(), rig, X_HM));
    EXPECT_EQ(estimator.readings().size(), 4u);
    EXPECT_TRUE(estimate.detected);
    EXPECT_EQ(estimate.fitness, 1);
    EXPECT_LT((estimate.X_HM.p - X_HM.p).norm(), 0.002 * X_HM.p.x());
    // tenths of a pixel of disparity, on tags 0.3 m apart
    EXPECT_LT(AngleBetween(estimate.X_HM.q, X_HM.q), 0.003 + 0.012 * std::pow(X_HM.p.x(), 2));
  }
}

TEST(FiducialEstimator, ReadsEachFamilyAndNoOther) {
  const StereoRig rig = RigParams{}.MakeRig();
  for (const auto& [family, name] : EnumNames<TagFamily>::kNames) {
    SCOPED_TRACE(name);
    FiducialParams params = TwoTags();
    params.family = family;
    params.tags[1].id = TagCount(family) - 2;  // the last of the original ones has no top
    const StereoImage seen = Paint(params, rig, kAhead);
    FiducialEstimator estimator(params, rig);
    const PoseEstimate& estimate = estimator.Update(seen);
    EXPECT_EQ(estimator.readings().size(), 4u);
    ASSERT_TRUE(estimate.detected);
    EXPECT_LT((estimate.X_HM.p - kAhead.p).norm(), 0.003);
    EXPECT_LT(AngleBetween(estimate.X_HM.q, kAhead.q), 0.015);
    FiducialParams other = TwoTags();
    other.family = family == TagFamily::k36h11 ? TagFamily::kAruco4x4 : TagFamily::k36h11;
    EXPECT_FALSE(FiducialEstimator(other, rig).Update(seen).detected);
  }
}

TEST(FiducialEstimator, FindsItByOneTagToo) {
  const StereoRig rig = RigParams{}.MakeRig();
  FiducialParams one = TwoTags();
  one.tags.pop_back();
  // it may hang turned: here by a quarter
  one.tags[0].q_MT_wxyz = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};
  FiducialEstimator estimator(one, rig);
  const PoseEstimate& estimate = estimator.Update(Paint(one, rig, kAhead));
  ASSERT_TRUE(estimate.detected);
  EXPECT_LT((estimate.X_HM.p - kAhead.p).norm(), 0.01);
  EXPECT_LT(AngleBetween(estimate.X_HM.q, kAhead.q), units::RadFromDeg(3));
}

TEST(FiducialEstimator, WithoutATagInBothImagesThereIsNoPose) {
  const StereoRig rig = RigParams{}.MakeRig();
  FiducialEstimator estimator(TwoTags(), rig);
  StereoImage seen = Paint(TwoTags(), rig, kAhead);
  const Pose before = estimator.Update(seen).X_HM;
  seen.right = Image3u8(640, 480, 50);
  seen.frame = 5;
  const PoseEstimate& estimate = estimator.Update(seen);
  EXPECT_EQ(estimator.readings().size(), 2u);
  EXPECT_EQ(estimate.frame, 5);
  EXPECT_FALSE(estimate.detected);
  EXPECT_EQ(estimate.fitness, -1);
  EXPECT_EQ(estimate.X_HM.p, before.p);
}

TEST(FiducialEstimator, DropsATagThatDisagrees) {
  const StereoRig rig = RigParams{}.MakeRig();
  FiducialEstimator estimator(TwoTags(), rig);
  StereoImage seen = Paint(TwoTags(), rig, kAhead);
  // in the right image tag 7 alone hangs lower: no place fits both
  FiducialParams moved = TwoTags();
  moved.tags[1].p_MT_m.z() -= 0.03;
  seen.right = Paint(moved, rig.right, kAhead);
  const PoseEstimate& estimate = estimator.Update(seen);
  ASSERT_TRUE(estimate.detected);
  EXPECT_LT((estimate.X_HM.p - kAhead.p).norm(), 0.01);
}

TEST(FiducialEstimator, OnceFoundItReadsAboutTheTagsAloneUntilTheyAreLost) {
  const StereoRig rig = RigParams{}.MakeRig();
  FiducialEstimator estimator(TwoTags(), rig), other(TwoTags(), rig);
  EXPECT_FALSE(estimator.RegionOfInterest());
  const StereoImage first = Paint(TwoTags(), rig, kAhead);
  estimator.Update(first);
  other.Update(first);
  const std::optional<StereoRegion> region = estimator.RegionOfInterest();
  ASSERT_TRUE(region);
  for (const Side side : kSides) {
    EXPECT_LT((*region)[side].width(), 500);
    for (const FiducialEstimator::Reading& reading : estimator.readings())
      for (const Eigen::Vector2d& corner : reading.corners_px)
        if (reading.side == side) {
          EXPECT_TRUE(
              (*region)[side].Contains(static_cast<int>(corner.x()), static_cast<int>(corner.y())));
        }
  }
  // whatever the other pixels hold
  const StereoImage clean =
      Paint(TwoTags(), rig, {kAhead.q, kAhead.p + Eigen::Vector3d(-0.01, 0.01, 0)});
  StereoImage soiled = clean;
  for (const Side side : kSides)
    for (int v = 0; v < 480; ++v)
      for (int u = 0; u < 640; ++u)
        if (!(*region)[side].Contains(u, v)) *soiled[side].at(u, v) = static_cast<uint8_t>(u ^ v);
  const PoseEstimate& of_clean = other.Update(clean);
  const PoseEstimate& of_soiled = estimator.Update(soiled);
  ASSERT_TRUE(of_clean.detected);
  EXPECT_EQ(of_clean.X_HM.p, of_soiled.X_HM.p);
  // lost, it looks everywhere again
  StereoImage dark;
  dark.left = dark.right = Image3u8(640, 480, 50);
  estimator.Update(dark);
  EXPECT_FALSE(estimator.RegionOfInterest());
}

TEST(FiducialEstimator, TheSameImagesGiveTheSameBits) {
  const StereoRig rig = RigParams{}.MakeRig();
  const StereoImage seen = Paint(TwoTags(), rig, kAhead);
  FiducialEstimator a(TwoTags(), rig), b(TwoTags(), rig);
  b.Update(Paint(TwoTags(), rig, Pose::Translation(0.9, 0, 0)));
  b.Reset();
  const PoseEstimate &of_a = a.Update(seen), &of_b = b.Update(seen);
  EXPECT_EQ(of_a.X_HM.p, of_b.X_HM.p);
  EXPECT_EQ(of_a.X_HM.q.coeffs(), of_b.X_HM.q.coeffs());
}

TEST(FiducialEstimator, RefusesWhatCannotBe) {
  const StereoRig rig = RigParams{}.MakeRig();
  const auto message = [&](auto change) {
    FiducialParams params = TwoTags();
    change(params);
    return testing::MessageOf([&] { FiducialEstimator(params, rig); });
  };
  EXPECT_THAT(message([](auto& p) { p.tags.clear(); }), HasSubstr("estimator.fiducial.tags"));
  EXPECT_THAT(message([](auto& p) { p.tags[1].id = 0; }),
              HasSubstr("estimator.fiducial.tags[1].id: 0 is also that of tags[0]"));
  EXPECT_THAT(message([](auto& p) { p.tags[1].id = 30; }),
              HasSubstr("30 is not in family 16h5, which has 0 to 29"));
  EXPECT_THAT(message([](auto& p) { p.tags[0].size_m = 0; }),
              HasSubstr("estimator.fiducial.tags[0].size_m"));
  EXPECT_THAT(message([](auto& p) { p.tags[0].q_MT_wxyz *= 0.5; }),
              HasSubstr("estimator.fiducial.tags[0].q_MT_wxyz: has length 0.5, must be 1"));
  FiducialEstimator estimator(TwoTags(), rig);
  StereoImage small;
  small.left = small.right = Image3u8(64, 48);
  EXPECT_THAT(testing::MessageOf([&] { estimator.Update(small); }), HasSubstr("left image"));
}

}  // namespace
}  // namespace turbidock::vision
