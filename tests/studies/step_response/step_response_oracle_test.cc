// What is read off an answer, against closed forms; and a loop measured where its answer is known.

#include "experiments/studies/step_response/step_response.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "experiments/trial/scenario.h"

namespace turbidock::step_response {
namespace {

using std::numbers::pi;

// Second order, damping z and natural frequency w: overshoot exp(-pi z / sqrt(1 - z^2)).
TEST(StepResponse, SecondOrderAnswerInClosedForm) {
  constexpr double kZ = 0.4, kOmega = 2, kStep = -0.05;
  StepResponse response{.answer = {.wanted = kStep}};
  const double wd = kOmega * std::sqrt(1 - kZ * kZ);
  for (int n = 0; n < 30000; ++n) {
    const double t = n / 1000.0;
    const double y = 1 - std::exp(-kZ * kOmega * t) *
                             (std::cos(wd * t) + kZ / std::sqrt(1 - kZ * kZ) * std::sin(wd * t));
    response.answer.time_s.push_back(t);
    response.answer.actual.push_back(kStep * y);
  }
  JudgeStep(&response);
  EXPECT_NEAR(response.overshoot, std::exp(-pi * kZ / std::sqrt(1 - kZ * kZ)), 1e-5);
  ASSERT_TRUE(response.rise_time_s && response.settling_time_s);
  // the envelope leaves the band of 5 % at -log(0.05 sqrt(1 - z^2)) / (z w) at the latest
  EXPECT_LE(*response.settling_time_s, -std::log(0.05 * std::sqrt(1 - kZ * kZ)) / (kZ * kOmega));
  EXPECT_GE(*response.settling_time_s, pi / wd);
}

TEST(StepResponse, FirstOrderRiseIsLogNine) {
  StepResponse response{.answer = {.wanted = 1}};
  for (int n = 0; n < 10000; ++n) {
    response.answer.time_s.push_back(n / 1000.0);
    response.answer.actual.push_back(1 - std::exp(-n / 1000.0));
  }
  JudgeStep(&response);
  EXPECT_NEAR(*response.rise_time_s, std::log(9.0), 2e-3);
  EXPECT_NEAR(*response.settling_time_s, -std::log(0.05), 2e-3);
  EXPECT_EQ(response.overshoot, 0);
}

TEST(StepResponse, AnAnswerThatNeverGetsThereHasNoRise) {
  StepResponse response{
      .answer = {.wanted = 0.05, .time_s = {0, 1, 2}, .actual = {0, 0.02, 0.03}, .demand = {}}};
  JudgeStep(&response);
  EXPECT_FALSE(response.rise_time_s);
  EXPECT_FALSE(response.settling_time_s);
}

// What swings through the band at the last moment does not stay in it.
TEST(StepResponse, AnAnswerThatSwingsToTheEndDoesNotSettle) {
  StepResponse response{.answer = {.wanted = 1}};
  for (int n = 0; n <= 600; ++n) {
    response.answer.time_s.push_back(n / 30.0);
    response.answer.actual.push_back(1 + 3 * std::sin(pi * n / 30));
  }
  ASSERT_NEAR(response.answer.actual.back(), 1, 1e-9);
  JudgeStep(&response);
  EXPECT_FALSE(response.settling_time_s);
}

// L = k e^{-s T} / s: the gain is 1 at w = k, where the phase is -90 degrees - k T; the phase is
// -180 degrees at w = pi / 2 T.
TEST(LoopResponse, AnIntegratorWithDelayHasTheseMargins) {
  constexpr double kGain = 2, kDelay_s = 0.3;
  LoopResponse response;
  for (double f = 0.02; f < 5; f *= 1.02) {
    const double w = 2 * pi * f;
    const std::complex<double> L =
        kGain / std::complex<double>(0, w) * std::polar(1.0, -w * kDelay_s);
    response.points.push_back({f, std::abs(L), std::arg(L)});
  }
  JudgeLoop(&response);
  EXPECT_NEAR(*response.crossover_hz, kGain / (2 * pi), 1e-4);
  EXPECT_NEAR(*response.phase_margin_rad, pi / 2 - kGain * kDelay_s, 1e-3);
  EXPECT_NEAR(*response.gain_margin, pi / (2 * kDelay_s) / kGain, 1e-3);
  EXPECT_NEAR(*response.delay_margin_s, (pi / 2 - kGain * kDelay_s) / kGain, 1e-3);
  EXPECT_GT(response.sensitivity_peak, 1);
}

// The proportional controller on the heave axis, where everything about the loop is known: K gain,
// thrust per volt, lag, mass, drag, a frame of delay and half a frame of holding.
TEST(LoopResponse, IsWhatTheLinearModelSays) {
  const trial::Scenario scenario = trial::LoadScenario(
      "pool_active",
      {"estimator.pose_source=true_pose", "control.use=p_voltage",
       "control.p_voltage.heave.kp_v_per_m=5", "control.p_voltage.allocation.dead_band_v=0.25",
       "control.p_voltage.allocation.curve_exponent=2", "vehicle.thrusters.dead_band_volts=0.25",
       "vehicle.thrusters.curve_exponent=2", "vehicle.thrusters.lag_s=0.15",
       "control.p_voltage.allocation.ramp_v=0.001", "vehicle.thrusters.reverse_ratio=1",
       "vehicle.thrusters.inflow_loss_s_per_m=0", "vehicle.hydrodynamics.displaced_volume_m3=0.015",
       "vehicle.hydrodynamics.water_density_kg_m3=1000",
       "vehicle.hydrodynamics.linear_damping_diagonal=[5, 6, 8, 0.1, 0.15, 0.07]",
       "vehicle.hydrodynamics.quadratic_damping_diagonal=[0, 0, 0, 0, 0, 0]"});
  StepOptions options;
  options.axes = {control::kHeave};
  options.frequencies_hz = {0.2, 0.4, 0.8, 1.6};
  options.rest_s = 2;
  options.record_s = 2;
  const std::vector<AxisResponse> responses = MeasureStepResponses(scenario, options);
  ASSERT_EQ(responses.size(), 1u);
  ASSERT_EQ(responses[0].loop.points.size(), 4u);
  for (const LoopPoint& point : responses[0].loop.points) {
    const double w = 2 * pi * point.frequency_hz;
    const std::complex<double> s(0, w);
    // held over a frame, one frame of delay from image to command
    const std::complex<double> hold = (1.0 - std::exp(-s / 30.0)) / (s / 30.0);
    const std::complex<double> L =
        5.0 * (4.9 / 2.25) * hold * std::exp(-s / 30.0) / ((1.0 + 0.15 * s) * s * (24.0 * s + 8.0));
    const std::complex<double> measured = std::polar(point.gain, point.phase_rad);
    EXPECT_LT(std::abs(measured / L - 1.0), 0.05)
        << point.frequency_hz << " Hz: " << measured << " for " << L;
  }
}

}  // namespace
}  // namespace turbidock::step_response
