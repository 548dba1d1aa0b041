// Images that never arrive.

#include <gtest/gtest.h>

#include <cmath>

#include "experiments/trial/perception.h"

namespace turbidock::trial {
namespace {

struct Arrivals {
  int images = 0;
  bool first = false;
  int kept = 0;  // frames without an image on which the estimate was the one before
};

Arrivals Count(double drop_probability, int frames) {
  Scenario scenario = LoadScenario("pool_active", {"estimator.pose_source=true_pose"});
  scenario.camera_drop_probability = drop_probability;
  World world(scenario, {});
  Perception perception(scenario, {}, &world);
  Arrivals arrivals;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (int frame = 0; frame < frames; ++frame) {
    const bool arrived = perception.Update(frame);
    if (frame == 0) arrivals.first = arrived;
    arrivals.images += arrived;
    arrivals.kept += !arrived && perception.estimate().X_HM.p == before;
    before = perception.estimate().X_HM.p;
  }
  return arrivals;
}

TEST(DroppedImages, AreTheShareAskedFor) {
  constexpr int kFrames = 2000;
  EXPECT_EQ(Count(0, kFrames).images, kFrames);
  for (const double probability : {0.1, 0.5, 0.9}) {
    const Arrivals arrivals = Count(probability, kFrames);
    // four standard deviations
    EXPECT_NEAR(arrivals.images, kFrames * (1 - probability),
                4 * std::sqrt(kFrames * probability * (1 - probability)));
    EXPECT_TRUE(arrivals.first);
    EXPECT_EQ(arrivals.kept, kFrames - arrivals.images);
  }
}

TEST(DroppedImages, AreTheSameAgain) { EXPECT_EQ(Count(0.3, 300).images, Count(0.3, 300).images); }

}  // namespace
}  // namespace turbidock::trial
