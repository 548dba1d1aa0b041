// The cameras' schedule against what it must do frame by frame, for every period and delay.

#include "experiments/trial/perception.h"

#include <gtest/gtest.h>

#include <map>
#include <optional>

namespace turbidock::trial {
namespace {

TEST(CameraSchedule, EveryImageArrivesAfterItsDelayAndIsKeptUntilTheNext) {
  for (int period = 1; period <= 6; ++period) {
    for (int delay = 0; delay <= 9; ++delay) {
      SCOPED_TRACE(testing::Message() << "period " << period << ", delay " << delay);
      const CameraSchedule cameras(period, delay);
      const int64_t slots = cameras.under_way() + 1;
      std::map<int64_t, int64_t> exposed_at, in_slot;  // by number; number by slot
      std::optional<int64_t> last_exposure, last_number;
      const auto expose = [&](int64_t frame) {
        if (!cameras.ExposesAt(frame)) return;
        const int64_t number = cameras.ExposedAt(frame);
        if (last_exposure) {
          EXPECT_EQ(frame - *last_exposure, period);
          EXPECT_EQ(number, *last_number + 1);
        }
        last_exposure = frame;
        last_number = number;
        exposed_at[number] = frame;
        in_slot[(number % slots + slots) % slots] = number;
      };
      for (int64_t frame = cameras.first_frame(); frame < 0; ++frame) expose(frame);
      for (int64_t frame = 0; frame < 40; ++frame) {
        expose(frame);
        const int64_t latest = cameras.LatestAt(frame);
        ASSERT_TRUE(exposed_at.contains(latest)) << frame;
        EXPECT_EQ((in_slot[(latest % slots + slots) % slots]), latest) << frame;
        const int64_t age = frame - exposed_at[latest];
        EXPECT_GE(age, delay);
        EXPECT_LT(age, delay + period);
        EXPECT_EQ(cameras.ArrivesAt(frame), age == delay);
        EXPECT_TRUE(period > 1 || latest == frame - delay);
      }
    }
  }
}

}  // namespace
}  // namespace turbidock::trial
