// A failing thruster against what is left of a sound one's thrust.

#include "sim/vehicle/thruster_fault.h"

#include <gtest/gtest.h>

#include "sim/check/simple_scene.h"
#include "sim/vehicle/plant.h"

namespace turbidock::vehicle {
namespace {

ThrusterFault Fault(ThrusterName thruster, double force_factor, double begin_s, double end_s) {
  ThrusterFault fault;
  fault.thruster = thruster;
  fault.force_factor = force_factor;
  fault.begin_s = begin_s;
  fault.end_s = end_s;
  return fault;
}

TEST(ThrusterFault, ItsFactorHoldsFromItsBeginningAndBeforeItsEnd) {
  const std::vector<ThrusterFault> faults = {Fault(ThrusterName::kSway, 0.5, 1, 2),
                                             Fault(ThrusterName::kSway, -0.5, 1.5, 3),
                                             Fault(ThrusterName::kHeave, 0, 1, 2)};
  EXPECT_EQ(FactorsAt(faults, 0.999), kSoundThrusters);
  EXPECT_EQ(FactorsAt(faults, 1), (ThrusterFactors{1, 1, 0.5, 0}));
  EXPECT_EQ(FactorsAt(faults, 1.5), (ThrusterFactors{1, 1, -0.25, 0}));
  EXPECT_EQ(FactorsAt(faults, 2), (ThrusterFactors{1, 1, -0.5, 1}));
  EXPECT_EQ(FactorsAt(faults, 3), kSoundThrusters);
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
  failing.SetThrusterFaults({Fault(ThrusterName::kSurgeLeft, 0, 0.5, 1),
                             Fault(ThrusterName::kSurgeRight, 0.25, 0.5, 1),
                             Fault(ThrusterName::kHeave, -1, 0, 5)});
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
