// Making only the pixels that the estimator can read changes nothing but the time it takes.
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "experiments/trial/trial.h"

namespace turbidock::trial {
namespace {

struct WatchedTrial {
  TrialResult result;
  int partial_frames = 0;  // that left a corner of the left image as it was
};

WatchedTrial WatchTrial(const std::string& scenario, bool region_of_interest) {
  WatchedTrial run;
  Image3u8 last, before;  // the perception have two buffers in turn
  TrialOptions options;
  options.observe = [&](const TrialFrame& frame) {
    constexpr int kCorner_px = 30;  // noise does not repeat itself in 30 pixels
    const uint8_t* corner = frame.seen.left.data();
    run.partial_frames += !before.empty() && std::equal(corner, corner + kCorner_px, before.data());
    before = std::exchange(last, frame.seen.left);
  };
  run.result =
      RunTrial(LoadScenario(scenario, {"trial.duration_s=5", "start.distance_min_m=0.6",
                                       "start.distance_max_m=0.7",
                                       region_of_interest ? "trial.region_of_interest=true"
                                                          : "trial.region_of_interest=false"}),
               options);
  return run;
}

TEST(RegionOfInterest, LeavesTheDigestAlone) {
  for (const char* scenario : {"sea_night_active", "pool_passive"}) {
    const WatchedTrial part = WatchTrial(scenario, true), whole = WatchTrial(scenario, false);
    EXPECT_EQ(part.result.digest, whole.result.digest) << scenario;
    EXPECT_EQ(whole.partial_frames, 0);
    // it has been put to the test
    EXPECT_GT(part.partial_frames, 30) << scenario;
  }
}

}  // namespace
}  // namespace turbidock::trial
