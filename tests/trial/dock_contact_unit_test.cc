#include "experiments/trial/recorder.h"

#include <gtest/gtest.h>

#include <functional>

namespace turbidock::trial {
namespace {

constexpr JamParams kJam{.force_newton = 2, .time_s = 1, .progress_m = 0.005};

// `frames` frames at 10 Hz of a script that says what each is like.
DockContact Played(int frames, const std::function<void(int, FrameRecord*)>& script) {
  DockContact contact(kJam);
  for (int i = 0; i < frames; ++i) {
    FrameRecord sample;
    sample.time_s = 0.1 * i;
    script(i, &sample);
    contact.Update(sample);
  }
  return contact;
}

TEST(DockContact, NothingHappensWithoutTouching) {
  const DockContact contact =
      Played(50, [](int i, FrameRecord* s) { s->insertion_depth_m = -0.5 + 0.001 * i; });
  EXPECT_FALSE(contact.first_contact().has_value());
  EXPECT_FALSE(contact.insertion_time_s().has_value());
  EXPECT_FALSE(contact.jam_time_s().has_value());
  EXPECT_EQ(contact.force_max_newton(), 0);
}

TEST(DockContact, FirstTimesAndLargestForceAreKept) {
  const DockContact contact = Played(50, [](int i, FrameRecord* s) {
    s->dock_force_newton = i == 7 ? 1.5 : i == 20 ? 4 : 0;
    s->inserted = i == 30 || i > 40;
  });
  ASSERT_TRUE(contact.first_contact().has_value());
  EXPECT_DOUBLE_EQ(contact.first_contact()->time_s, 0.7);
  EXPECT_EQ(contact.first_contact()->force_newton, 1.5);
  EXPECT_EQ(contact.force_max_newton(), 4);
  EXPECT_DOUBLE_EQ(contact.insertion_time_s().value(), 3.0);
}

TEST(DockContact, HeldInPlaceForLongEnoughIsAJam) {
  // Pushing from frame 5 on, creeping by less than the progress that would count.
  const auto script = [](int i, FrameRecord* s) {
    s->dock_force_newton = i >= 5 ? 2.1 : 0;
    s->insertion_depth_m = 0.03 + 0.0001 * i;
  };
  EXPECT_FALSE(Played(15, script).jam_time_s().has_value());
  EXPECT_NEAR(Played(16, script).jam_time_s().value(), 1.5, 1e-9);
  EXPECT_NEAR(Played(80, script).jam_time_s().value(), 1.5, 1e-9) << "the first time is kept";
}

TEST(DockContact, NoJamWhileThePoleMovesOnOrBack) {
  for (const double per_frame_m : {0.001, -0.001}) {
    const DockContact contact = Played(80, [&](int i, FrameRecord* s) {
      s->dock_force_newton = 5;
      s->insertion_depth_m = per_frame_m * i;
    });
    EXPECT_FALSE(contact.jam_time_s().has_value()) << per_frame_m;
  }
}

TEST(DockContact, NoJamWhenThePushIsWeakOrInterrupted) {
  EXPECT_FALSE(
      Played(80, [](int, FrameRecord* s) { s->dock_force_newton = 2; }).jam_time_s().has_value());
  EXPECT_FALSE(Played(80, [](int i, FrameRecord* s) { s->dock_force_newton = i % 9 ? 5 : 0; })
                   .jam_time_s()
                   .has_value());
}

TEST(DockContact, NoJamInTheHole) {
  const DockContact contact = Played(80, [](int, FrameRecord* s) {
    s->dock_force_newton = 5;
    s->inserted = true;
  });
  EXPECT_FALSE(contact.jam_time_s().has_value());
}

TEST(DockContact, ProgressOnlyPutsTheJamOff) {
  // A slip of 6 mm at frame 5 begins the wait anew.
  const DockContact contact = Played(80, [](int i, FrameRecord* s) {
    s->dock_force_newton = 5;
    s->insertion_depth_m = i < 5 ? 0 : 0.006;
  });
  EXPECT_NEAR(contact.jam_time_s().value(), 1.5, 1e-9);
}

}  // namespace
}  // namespace turbidock::trial
