// A failing thruster against what is left of a sound one's thrust.

#include "sim/vehicle/thruster_fault.h"

#include <gtest/gtest.h>

#include "sim/vehicle/plant.h"
#include "tests/check/simple_scene.h"

namespace turbidock::vehicle {
namespace {

std::vector<NumberedThrusterFault> OnFour(const std::vector<ThrusterFault>& faults) {
  return Numbered(faults, {"surge_left", "surge_right", "sway", "heave"}, "faults");
}

TEST(ThrusterFault, ItsFactorHoldsFromItsBeginningAndBeforeItsEnd) {
  const auto faults =
      OnFour({ThrusterFault{{1, 2}, "sway", 0.5}, ThrusterFault{{1.5, 3}, "sway", -0.5},
              ThrusterFault{{1, 2}, "heave", 0}});
  const ThrusterFactors kSound(4, 1.0);
  EXPECT_EQ(FactorsAt(faults, 4, 0.999), kSound);
  EXPECT_EQ(FactorsAt(faults, 4, 1), (ThrusterFactors{1, 1, 0.5, 0}));
  EXPECT_EQ(FactorsAt(faults, 4, 1.5), (ThrusterFactors{1, 1, -0.25, 0}));
  EXPECT_EQ(FactorsAt(faults, 4, 2), (ThrusterFactors{1, 1, -0.5, 1}));
  EXPECT_EQ(FactorsAt(faults, 4, 3), kSound);
}

TEST(ThrusterFault, OfAThrusterThatIsNotThereIsRefused) {
  try {
    OnFour({ThrusterFault{{0, 1}, "sway", 0}, ThrusterFault{{0, 1}, "swey", 0}});
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(),
                 "faults.thrusters[1].thruster: 'swey', must be one of surge_left, "
                 "surge_right, sway, heave");
  }
}

// Thrust in the plant, tick by tick, beside a plant whose thrusters are sound: with a tethered
// body's inflow both would drift apart, so there is none.
TEST(ThrusterFault, LeavesItsShareOfTheThrustInThePlant) {
  const Scene scene = check::OpenWater(check::kWeightless);
  VehicleParams params;
  params.thrusters.inflow_loss_s_per_m = 0;
  const ClockParams clock = check::TicksPerTenth(20);
  Plant sound(scene, params, clock, Sea()), failing(scene, params, clock, Sea()),
      mirrored(scene, params, clock, Sea());
  failing.SetThrusterFaults(
      {ThrusterFault{{0.5, 1}, "surge_left", 0}, ThrusterFault{{0.5, 1}, "surge_right", 0.25},
       ThrusterFault{{0, 5}, "heave", -1}},
      "faults");
  const ThrusterCommand command{.volts = {4, 1.5, 3, 3.5}};
  ThrusterCommand exchanged = command;
  exchanged.volts[3] = kMaxVolts - command.volts[3];
  int during = 0;
  for (int tick = 0; tick < 300; ++tick) {
    const double time_s = failing.time_s();
    ASSERT_FALSE(sound.Step(command));
    ASSERT_FALSE(failing.Step(command));
    ASSERT_FALSE(mirrored.Step(exchanged));
    const ThrusterForces whole = sound.truth().thrust_newton, got = failing.truth().thrust_newton;
    const bool now = 0.5 <= time_s && time_s < 1;
    during += now;
    EXPECT_EQ(got[0], now ? 0 : whole[0]) << time_s;
    EXPECT_EQ(got[1], (now ? 0.25 : 1) * whole[1]) << time_s;
    EXPECT_EQ(got[2], whole[2]) << time_s;
    EXPECT_EQ(got[3], mirrored.truth().thrust_newton[3]) << time_s;
  }
  EXPECT_EQ(during, 100);
  EXPECT_GT(sound.truth().thrust_newton[3], 1);
  EXPECT_LT(failing.truth().thrust_newton[3], -1);
}

}  // namespace
}  // namespace turbidock::vehicle
