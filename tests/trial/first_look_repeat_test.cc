// A first look spares images that show nothing, and changes nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "experiments/trial/first_look.h"
#include "experiments/trial/perception.h"
#include "experiments/trial/trial.h"
#include "experiments/trial/world.h"
#include "sim/base/random.h"
#include "tests/support/awkward.h"
#include "tests/support/message_of.h"
#include "vision/detection.h"

namespace turbidock::trial {
namespace {

void FillWithNoise(Rng* rng, Image3u8* image) {
  for (size_t i = 0; i < 3 * image->pixels(); ++i)
    image->data()[i] = static_cast<uint8_t>(rng->Below(256));
}

TEST(FirstLook, ReadsNothingOutsideItsRegion) {
  FirstLook look({}, {}, RigParams{}.MakeRig());
  std::vector<Pose> poses = testing::AwkwardPoses();
  for (const double y_m : {0.0, 0.2, -0.3, 0.45})
    poses.push_back({FromYawPitchRoll(0.1, -0.1, 0.2), {0.8, y_m, 0.5 * y_m}});
  Rng rng = SeedTree(4).Stream("images");
  StereoImage images{{Image3u8(640, 480), Image3u8(640, 480)}};
  int partly = 0;
  for (const Pose& X_HM : poses) {
    const StereoRegion region = look.RegionOf(X_HM);
    for (const Side side : kSides) FillWithNoise(&rng, &images[side]);
    const double fitness = look.Fitness(images, X_HM);
    StereoImage others = images;
    for (const Side side : kSides) {
      Image3u8 noise(640, 480);
      FillWithNoise(&rng, &noise);
      for (int v = 0; v < 480; ++v)
        for (int u = 0; u < 640; ++u)
          if (!region[side].Contains(u, v)) std::copy_n(noise.at(u, v), 3, others[side].at(u, v));
    }
    EXPECT_EQ(look.Fitness(others, X_HM), fitness);
    EXPECT_TRUE(region.left.empty() || region.left.column_begin >= 0);
    partly +=
        !region.left.empty() && region.left.column_end <= 640 && std::abs(fitness + 0.2) > 1e-9;
  }
  EXPECT_GE(partly, 3);  // it has been put to the test
}

// With all that F reads and no more: a pixel less would be missed.
TEST(FirstLook, ItsRegionIsNoLargerThanTheOuterRings) {
  const StereoRig rig = RigParams{}.MakeRig();
  const FirstLook look({}, {}, rig);
  const Pose X_HM = {FromYawPitchRoll(0.1, -0.1, 0.2), {0.8, 0.02, -0.01}};
  for (const Side side : kSides) {
    const Pose X_CM = rig[side].X_HC.Inverse() * X_HM;
    double left_px = 640, bottom_px = 0;
    for (const vision::BallParams& ball : vision::MarkerParams{}.balls) {
      const Eigen::Vector3d p_CQ = X_CM * ball.p_MQ_m;
      const double ring_px = 1.4 * rig[side].fx_px * 0.02 / p_CQ.z();
      left_px = std::min(left_px, rig[side].Project(p_CQ).x() - ring_px);
      bottom_px = std::max(bottom_px, rig[side].Project(p_CQ).y() + ring_px);
    }
    const PixelRegion region = look.RegionOf(X_HM)[side];
    EXPECT_NEAR(region.column_begin, left_px, 2.5);
    EXPECT_NEAR(region.row_end, bottom_px, 3.5);
  }
}

struct WatchedTrial {
  TrialResult result;
  std::vector<double> fitness;       // by frame
  int partial_frames = 0;            // that left a corner of the left image as it was
  std::vector<int64_t> evaluations;  // likewise; none where a frame was not searched

  std::ptrdiff_t spared() const { return std::ranges::count(evaluations, 0); }
};

WatchedTrial Watch(const std::string& scenario, std::vector<std::string> assignments,
                   bool look_first, bool whole_images = false) {
  assignments.emplace_back(look_first ? "look_first=true" : "look_first=false");
  WatchedTrial run;
  TrialOptions options;
  options.whole_images = whole_images;
  Image3u8 last, before;  // the perception has two buffers in turn
  options.observe = [&](const TrialFrame& frame) {
    constexpr int kCorner_px = 30;  // noise does not repeat itself in 30 pixels
    const uint8_t* corner = frame.seen.left.data();
    run.partial_frames += !before.empty() && std::equal(corner, corner + kCorner_px, before.data());
    before = std::exchange(last, frame.seen.left);
    run.fitness.push_back(frame.record.fitness);
    run.evaluations.push_back(frame.evaluations);
  };
  run.result = RunTrial(LoadScenario(scenario, assignments), options);
  return run;
}

TEST(FirstLook, LeavesFramesAloneThatShowTheMarker) {
  const std::vector<std::string> near = {"duration_s=1.5", "start.distance_min_m=0.6",
                                         "start.distance_max_m=0.7"};
  const WatchedTrial with = Watch("sea_night_active", near, true);
  EXPECT_EQ(with.spared(), 0);
  EXPECT_EQ(with.result.digest, Watch("sea_night_active", near, false).result.digest);
}

TEST(FirstLook, SparesFramesInWhichNothingWouldBeDetected) {
  const std::vector<std::string> far = {"duration_s=1.5", "seed=2"};
  const WatchedTrial with = Watch("paper_sea_night_passive", far, true);
  const WatchedTrial without = Watch("paper_sea_night_passive", far, false);
  EXPECT_EQ(without.spared(), 0);
  EXPECT_GT(with.spared(), 30);
  EXPECT_GT(with.partial_frames, 30);
  EXPECT_EQ(without.partial_frames, 0);
  ASSERT_EQ(with.fitness.size(), without.fitness.size());
  EXPECT_GT(with.evaluations.front(), 0);
  for (size_t i = 0; i < with.fitness.size(); ++i) {
    if (with.evaluations[i] > 0) continue;
    EXPECT_EQ(with.fitness[i], -0.2) << i;
    EXPECT_LT(without.fitness[i], vision::Detection::kOnFitness) << i;
  }
  // whoever wants whole images gets them, and the same trial
  const WatchedTrial whole = Watch("paper_sea_night_passive", far, true, true);
  EXPECT_EQ(whole.result.digest, with.result.digest);
  EXPECT_EQ(whole.partial_frames, 0);
}

// The estimator is not asked of a spared frame: what it said of the frame before must not stand.
TEST(FirstLook, LeavesNoSecondPoseFromTheFrameBefore) {
  const Scenario scenario =
      LoadScenario("pool_active", {"look_first=true",
                                   "ball_lights.balls=[{name: red, color: [1, 0.03, 0.03]}, "
                                   "{name: green, color: [0.03, 1, 0.08]}, "
                                   "{name: blue, color: [0.03, 0.1, 1], current_factor: 0}]"});
  World world(scenario, {});
  const TrialOptions options;
  world.PlaceVehicle(Pose::Translation(0.6, 0, 0).Inverse());
  Perception perception(scenario, options, &world);
  int64_t frame = 0;
  while (frame < 60 && !(perception.Update(frame++) && perception.estimate().second)) continue;
  ASSERT_TRUE(perception.estimate().second);
  ASSERT_FALSE(perception.estimate().detected);
  world.PlaceVehicle(Pose::Translation(0.6, 2, 0).Inverse());
  const int64_t last = frame + 10;
  while (frame < last && perception.estimate().evaluations > 0) perception.Update(frame++);
  ASSERT_EQ(perception.estimate().evaluations, 0);
  EXPECT_FALSE(perception.estimate().second);
  EXPECT_FALSE(perception.estimate().covariance);
  EXPECT_EQ(perception.estimate().ball_support, std::vector<double>(3, 0.0));
}

TEST(FirstLook, HasNoPartInFaultsThatCamerasSee) {
  EXPECT_EQ(Watch("paper_sea_night_passive",
                  {"duration_s=0.2", "seed=2", "faults.images=[{kind: swapped, begin_s: 1}]"}, true)
                .spared(),
            0);
}

TEST(FirstLook, IsForTheSearchByColour) {
  EXPECT_EQ(testing::MessageOf([] { LoadScenario("pool_fiducial", {"look_first=true"}); }),
            "--set look_first: true needs pose_estimator = rm_ga, not fiducial");
}

}  // namespace
}  // namespace turbidock::trial
