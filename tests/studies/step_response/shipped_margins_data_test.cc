// The shipped gains keep the margins that are asked of a loop: 6 dB and 35 degrees on every axis.

#include <gtest/gtest.h>

#include "experiments/studies/step_response/step_response.h"
#include "experiments/trial/scenario.h"
#include "sim/base/units.h"

namespace turbidock::step_response {
namespace {

TEST(ShippedGains, KeepTheirMargins) {
  const trial::Scenario scenario = trial::LoadScenario(
      "sea_night_active", {"control.use=lqg", "estimator.pose_source=true_pose"});
  for (const AxisResponse& axis : MeasureStepResponses(scenario, {.rest_s = 2, .record_s = 2})) {
    ASSERT_TRUE(axis.loop.phase_margin_rad && axis.loop.gain_margin) << AxisName(axis.axis);
    EXPECT_GE(units::DegFromRad(*axis.loop.phase_margin_rad), 35) << AxisName(axis.axis);
    EXPECT_GE(*axis.loop.gain_margin, 2) << AxisName(axis.axis);
    EXPECT_LE(axis.loop.sensitivity_peak, 2) << AxisName(axis.axis);
  }
}

}  // namespace
}  // namespace turbidock::step_response
