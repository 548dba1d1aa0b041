// Where the approach goes: the geometry of the search, and leg after leg.

#include "control/approach.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace turbidock::control {
namespace {

constexpr ClockParams kClock;  // 30 frames a second

ApproachParams Params(ApproachMode mode) {
  ApproachParams params;
  params.mode = mode;
  return params;
}

// A vehicle that moves to where it is wanted, at most as fast as given.
class Follower {
 public:
  Follower(const ApproachParams& params, const AxesPose& start_MH, double speed_mps = 0.15)
      : approach_(params, {}, kClock), now_(start_MH), step_m_(speed_mps / 30) {}

  void Run(double seconds) {
    for (int i = 0; i < std::lround(30 * seconds); ++i) Step();
  }
  // Until the next change between approach and search; the time that took, at most ten minutes.
  double RunToChange() {
    const bool before = approach_.searching();
    int frames = 0;
    do Step();
    while (approach_.searching() == before && ++frames < 18000);
    return frames / 30.0;
  }
  const AxesPose& now() const { return now_; }
  const AxesPose& wanted() const { return wanted_; }
  Approach& approach() { return approach_; }
  int64_t frame() const { return frame_; }

 private:
  void Step() {
    wanted_ = approach_.Update(frame_++, now_);
    const AxesPose way = wanted_ - now_;
    const double share = std::min(1.0, step_m_ / std::max(1e-12, way.distance_m()));
    now_ = {now_.x_m + share * way.x_m, now_.y_m + share * way.y_m, now_.z_m + share * way.z_m,
            wanted_.yaw_rad};
  }

  Approach approach_;
  AxesPose now_, wanted_;
  double step_m_;
  int64_t frame_ = 0;
};

TEST(BoxCorner, GoesRoundTheAxisAndWiderEachTime) {
  ApproachParams params;
  params.box_step_m = 0.3;
  params.box_steps = 2;
  params.box_height_share = 0.5;
  for (int round = 0; round < 4; ++round) {
    const double half = round % 2 ? 0.6 : 0.3;
    std::vector<Eigen::Vector2d> corners;
    for (int leg = 0; leg < kBoxLegs; ++leg) corners.push_back(BoxCorner(params, round, leg));
    EXPECT_EQ(corners.back(), Eigen::Vector2d(0, 0));
    // every corner once, and the middle of the side where it begins
    int on_corner = 0;
    double area2 = 0;
    for (int leg = 1; leg < 5; ++leg) {
      const Eigen::Vector2d &a = corners[static_cast<size_t>(leg)],
                            &b = corners[static_cast<size_t>(leg % 4 + 1)];
      on_corner +=
          std::abs(std::abs(a.x()) - half) < 1e-12 && std::abs(std::abs(a.y()) - half / 2) < 1e-12;
      area2 += a.x() * b.y() - a.y() * b.x();
      // along the sides only
      EXPECT_NEAR((a - b).cwiseAbs().minCoeff(), 0, 1e-12);
    }
    EXPECT_EQ(on_corner, 4);
    EXPECT_NEAR(std::abs(area2) / 2, 2 * half * half, 1e-12);  // 2 half wide, half high
    EXPECT_NEAR((corners[0] - Eigen::Vector2d(-half, 0)).norm(), 0, 1e-12);
  }
}

TEST(Approach, GoesToTheAxisAndSlowlyAlongIt) {
  const ApproachParams params = Params(ApproachMode::kNavigation);
  Follower vehicle(params, {-5, 0.8, -0.3, 0.3});
  const double seconds = vehicle.RunToChange();
  EXPECT_TRUE(vehicle.approach().searching());
  EXPECT_NEAR(vehicle.now().x_m, -params.nearest_x_m, params.arrived_m);
  EXPECT_NEAR(vehicle.now().y_m, 0, 0.01);
  EXPECT_NEAR(vehicle.now().yaw_rad, 0, 1e-12);
  const double staging_s = (std::hypot(3.2, 0.8, 0.3) - params.arrived_m) / 0.15;
  const double axis_s = (params.staging_x_m - params.nearest_x_m) / params.advance_mps;
  EXPECT_NEAR(seconds, staging_s + axis_s, 0.5);
}

TEST(Approach, TurnsToBothSidesGoesRoundAndBacksOff) {
  const ApproachParams params = Params(ApproachMode::kNavigation);
  Follower vehicle(params, {-1.8, 0, 0, 0});
  for (int round = 0; round < 4; ++round) {
    vehicle.RunToChange();
    ASSERT_TRUE(vehicle.approach().searching());
    EXPECT_THAT(vehicle.approach().description(), ::testing::HasSubstr("not found"));
    vehicle.Run(params.sweep_period_s / 4);
    EXPECT_NEAR(vehicle.wanted().yaw_rad, params.sweep_rad, 0.01);
    EXPECT_NEAR(vehicle.wanted().x_m, -params.nearest_x_m + params.closer_m * (round % 3), 1e-12);
    vehicle.Run(params.sweep_period_s / 2);
    EXPECT_NEAR(vehicle.wanted().yaw_rad, -params.sweep_rad, 0.01);
    vehicle.Run(params.sweep_period_s / 4 + 0.5);
    EXPECT_NEAR(vehicle.wanted().yaw_rad, 0, 1e-12);
    EXPECT_NEAR(vehicle.wanted().y_m, -params.box_step_m * (1 + round % 3), 1e-12);
    vehicle.RunToChange();
    ASSERT_FALSE(vehicle.approach().searching());
    EXPECT_NEAR(vehicle.wanted().x_m, -params.staging_x_m, 1e-12);
    EXPECT_THAT(vehicle.approach().description(), ::testing::HasSubstr("back off"));
  }
}

TEST(Approach, WaitsWhereTheMarkerMayHaveBeenFoundAndGoesOn) {
  Follower vehicle(Params(ApproachMode::kNavigation), {-1.8, 0, 0, 0});
  vehicle.Run(6);
  const AxesPose here = vehicle.now(), wanted = vehicle.wanted();
  EXPECT_LT(here.x_m, -1.4);
  AxesPose drifted = here;
  drifted.y_m += 0.05;
  EXPECT_EQ(vehicle.approach().Hold(vehicle.frame(), here), here);
  for (int i = 1; i < 30; ++i)
    EXPECT_EQ(vehicle.approach().Hold(vehicle.frame() + i, drifted), here);
  const AxesPose after = vehicle.approach().Update(vehicle.frame() + 30, here);
  EXPECT_NEAR((after - wanted).distance_m(), 0, 1e-12);
}

// Not by what it cannot reach.
TEST(Approach, GoesOnWhereALegCannotBeEnded) {
  ApproachParams params = Params(ApproachMode::kNavigation);
  params.leg_time_s = 5;
  Follower stuck(params, {-3, 0.5, 0, 0}, 0);
  stuck.Run(4.9);
  EXPECT_EQ(stuck.wanted().x_m, -params.staging_x_m);
  stuck.Run(0.2 + (params.staging_x_m - params.nearest_x_m) / params.advance_mps);
  EXPECT_NEAR(stuck.wanted().x_m, -params.nearest_x_m, 0.01);
  stuck.Run(5.2);
  EXPECT_TRUE(stuck.approach().searching());
}

TEST(Approach, APilotComesAlongTheAxisFromWhereHeIs) {
  const ApproachParams params = Params(ApproachMode::kPilot);
  Follower vehicle(params, {-1.45, 0.15, 0.05, 0});
  vehicle.Run(1);
  EXPECT_NEAR(vehicle.wanted().x_m, -1.45 + params.advance_mps, 0.01);
  EXPECT_NEAR(vehicle.wanted().y_m, 0, 1e-12);
  vehicle.RunToChange();
  EXPECT_NEAR(vehicle.now().x_m, -params.nearest_x_m, params.arrived_m);
  // It looks about from there and, until it is found, from nearer and nearer, then from afar again.
  for (const double nearer_m : {0.2, 0.4, 0.0}) {
    EXPECT_NEAR(vehicle.RunToChange(), params.sweep_period_s, 0.1);
    vehicle.RunToChange();
    EXPECT_NEAR(vehicle.now().x_m, -params.nearest_x_m + nearer_m, params.arrived_m) << nearer_m;
  }
  EXPECT_NEAR(vehicle.now().y_m, 0, 0.01);
}

TEST(Approach, TheAxisIsTheDocksNotTheMarkers) {
  const ApproachParams params = Params(ApproachMode::kNavigation);
  Approach approach(params, {.y_m = 0.1, .z_m = -0.067}, kClock);
  const AxesPose wanted = approach.Update(0, {-5, 0, 0, 0});
  EXPECT_EQ(wanted, (AxesPose{-params.staging_x_m, -0.1, 0.067, -0.0}));
}

TEST(Hand, MovesLateInStepsAndNotAllTheTime) {
  ApproachParams params = Params(ApproachMode::kPilot);
  params.hand_interval_s = 0.5;
  params.hand_delay_s = 0.3;
  params.hand_step_share = 0.1;
  Hand hand(params, kClock);
  const Axes most(10, 5, 5, 1);
  std::vector<double> given;
  for (int frame = 0; frame < 45; ++frame)
    given.push_back(hand.Move(frame, {frame < 15 ? 3.4 : -2.6, 0.2, 0.3, 0}, most).x());
  for (int frame = 0; frame < 45; ++frame)
    EXPECT_NEAR(given[static_cast<size_t>(frame)],
                frame < 9    ? 0
                : frame < 24 ? 3
                             : -3,
                1e-12)
        << frame;
}

TEST(ApproachParams, ValuesMustFitEachOther) {
  ApproachParams params = Params(ApproachMode::kNavigation);
  EXPECT_NO_THROW(CheckFields(params, "procedure.approach"));
  params.nearest_x_m = 1.8;
  try {
    CheckFields(params, "procedure.approach");
    ADD_FAILURE();
  } catch (const ConfigError& error) {
    EXPECT_EQ(std::string(error.what()),
              "procedure.approach.nearest_x_m: 1.8 must be nearer than staging_x_m (1.8)");
  }
}

}  // namespace
}  // namespace turbidock::control
