// What progress says of the time that is left, against runs whose pace is known.

#include "experiments/command/progress.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace turbidock::command {
namespace {

// Workers that begin together and need `part_s` for each part.
Pace After(int64_t parts, int64_t workers, double part_s, Pace pace = {}, int64_t kept = 0) {
  for (int64_t i = 1; i <= parts; ++i)
    pace.Add(part_s * static_cast<double>((i + workers - 1) / workers), kept + i);
  return pace;
}

TEST(Pace, SaysARangeWhereTheEndIsOpen) {
  // 4 parts in 10 s: 102 more, 830 more
  EXPECT_EQ(After(40, 4, 10).Left(142, 870), "4:15 to 34:35 min left");
  EXPECT_EQ(After(40, 4, 10).Left(44, 870), "10 s to 34:35 min left");
  EXPECT_EQ(After(40, 4, 10).Left(40, 870), "at most 34:35 min left");
  EXPECT_EQ(After(40, 4, 10).Left(44, 44), "10 s left");
}

TEST(Pace, CountsNotWhatIsUnderWay) {
  EXPECT_EQ(Pace().Left(16, 16), "");
  // the first of four that run: three are nearly done
  EXPECT_EQ(After(1, 4, 10).Left(16, 16), "at most 2:30 min left");
  EXPECT_EQ(After(16, 4, 10).Left(16, 16), "");
}

TEST(Pace, IsThatOfTheLatterHalf) {
  // what was kept is there at once and says nothing of the pace
  Pace kept;
  for (int64_t i = 1; i <= 500; ++i) kept.Add(0.5, i);
  EXPECT_EQ(kept.Left(540, 540), "");
  EXPECT_EQ(After(12, 4, 10, kept, 500).Left(540, 540), "1:10 min left");
  // a second for each part, then three
  Pace slower = After(60, 1, 1);
  for (int64_t i = 1; i <= 20; ++i) slower.Add(60 + 3 * static_cast<double>(i), 60 + i);
  EXPECT_EQ(slower.Left(90, 90), "30 s left");
}

TEST(Progress, TakesWhatWasKeptForNoPaceHoweverLateItIsKnown) {
  Progress progress(false);
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  testing::internal::CaptureStderr();
  progress.ShowDone(53, 152, 360, "trials", 0);
  EXPECT_EQ(testing::internal::GetCapturedStderr().find("left"), std::string::npos);
}

}  // namespace
}  // namespace turbidock::command
