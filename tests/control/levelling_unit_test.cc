#include "control/levelling.h"

#include <gtest/gtest.h>

#include "control/autopilot.h"
#include "control/pid.h"
#include "tests/control/published_vehicle.h"

namespace turbidock::control {
namespace {

TEST(Levelling, TurnsBackAndBrakes) {
  VehicleModel vehicle = PublishedVehicle();
  vehicle.roll_pitch_inertia = {0.5, 0.25};
  const LevellingParams params{.kp_per_s2 = 4, .kd_per_s = 3};
  const RollPitch moment =
      LevellingMoment(params, vehicle, {.roll_pitch_rad = {0.1, -0.2}, .rate_rad_s = {0, 0.3}});
  EXPECT_NEAR(moment[0], -0.5 * 4 * 0.1, 1e-15);
  EXPECT_NEAR(moment[1], 0.25 * (4 * 0.2 - 3 * 0.3), 1e-15);
  EXPECT_EQ(LevellingMoment({.enabled = false}, vehicle, {.roll_pitch_rad = {1, 1}}),
            RollPitch::Zero());
}

PoseEstimate Nothing(int64_t frame) {
  PoseEstimate estimate;
  estimate.frame = frame;
  estimate.fitness = -1;
  return estimate;
}

// Also while nothing is seen and no controller is in charge.
TEST(Levelling, GoesOnWithoutAMarker) {
  VehicleModel vehicle = PublishedVehicle();
  vehicle.thrusters.pop_back();
  for (const double y : {0.2, -0.2})
    vehicle.thrusters.push_back(
        {.name = "upright", .p_BT = {0, y, 0}, .axis_B = {0, 0, 1}, .curve = {}});
  ControlParams params{.controller = SpecOf<Pid>()};
  const Attitude rolled{.roll_pitch_rad = {0.1, 0}};
  Autopilot autopilot(params, {}, vehicle, {.frames_per_second = 30});
  const ThrusterCommand command = autopilot.Update(Nothing(0), {}, rolled);
  // rolled to the right (its left side up): the left one pushes down, the right one up
  EXPECT_LT(command.volts[3], 2.3);
  EXPECT_GT(command.volts[4], 2.7);
  params.levelling.enabled = false;
  autopilot.SetControl(params);
  EXPECT_EQ(autopilot.Update(Nothing(1), {}, rolled).volts[3], 2.5);
}

}  // namespace
}  // namespace turbidock::control
