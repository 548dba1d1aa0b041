#include "vision/detection.h"

#include <gtest/gtest.h>

#include <array>

namespace turbidock::vision {
namespace {

constexpr std::array<double, 3> kAllMatched = {0.8, 0.8, 0.8}, kTwoMatched = {0.9, 0.9, 0.1};

TEST(Detection, NeedsFramesInARowOnTheWayInAndOut) {
  Detection detection;
  const auto after = [&](double fitness) {
    detection.Update(fitness, kAllMatched, false);
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
    detection.Update(0.6, kAllMatched, false);
    EXPECT_EQ(detection.frames_certain(), frames);
    EXPECT_EQ(detection.frames_uncertain(), 0);
  }
  for (int frames = 1; frames <= 3; ++frames) {
    detection.Update(0.59, kAllMatched, false);
    EXPECT_EQ(detection.frames_certain(), 0);
    EXPECT_EQ(detection.frames_uncertain(), frames);
  }
}

TEST(Detection, TwoBallsAreCertainOnATrackOnly) {
  Detection detection;
  detection.Update(0.63, kTwoMatched, false);
  EXPECT_EQ(detection.frames_uncertain(), 1);
  detection.Update(0.63, kTwoMatched, true);
  EXPECT_EQ(detection.frames_certain(), 1);
}

}  // namespace
}  // namespace turbidock::vision
