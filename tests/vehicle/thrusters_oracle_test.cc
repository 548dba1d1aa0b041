#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/vehicle/thrusters.h"

namespace turbidock::vehicle {
namespace {

// Exact up to rounding, which accumulates over the thousand smallest steps.
constexpr double kRounding_newton = 1e-12;

// Full ahead for 0.5 s, then full astern for 0.5 s, sampled every 10 ms.
std::vector<double> Response(const ThrusterParams& params, double dt_s) {
  Thrusters thrusters(params.Of({"only"}, "thrusters"), params.Effectiveness(1));
  const int steps_per_sample = static_cast<int>(std::lround(0.01 / dt_s));
  std::vector<double> samples;
  for (int i = 0; i < 100; ++i) {
    const double volts = i < 50 ? 5 : 0;
    for (int k = 0; k < steps_per_sample; ++k) thrusters.Step({.volts = {volts}}, {0}, dt_s);
    samples.push_back(thrusters.thrust_newton()[0]);
  }
  return samples;
}

TEST(ThrusterLag, IsTheExponentialOfItsTimeConstant) {
  const ThrusterParams params;
  const std::vector<double> got = Response(params, 0.002);
  const double turned = 4.9 * (1 - std::exp(-0.5 / params.lag_s));
  for (int i = 0; i < 100; ++i) {
    const double t_s = 0.01 * (i + 1);
    const double expected = i < 50
                                ? 4.9 * (1 - std::exp(-t_s / params.lag_s))
                                : -4.41 + (turned + 4.41) * std::exp(-(t_s - 0.5) / params.lag_s);
    EXPECT_NEAR(got[i], expected, kRounding_newton) << t_s;
  }
}

// The propeller's speed is what lags, and the thrust is its square.
TEST(ThrusterLag, OfTheSpeedIsTheSquareOfItsExponential) {
  ThrusterParams params;
  params.lag_power = 2;
  const std::vector<double> got = Response(params, 0.002);
  const double ahead = std::sqrt(4.9), astern = -std::sqrt(4.41);
  const double turned = ahead * (1 - std::exp(-0.5 / params.lag_s));
  for (int i = 0; i < 100; ++i) {
    const double t_s = 0.01 * (i + 1);
    const double speed = i < 50
                             ? ahead * (1 - std::exp(-t_s / params.lag_s))
                             : astern + (turned - astern) * std::exp(-(t_s - 0.5) / params.lag_s);
    EXPECT_NEAR(got[i], speed * std::abs(speed), kRounding_newton) << t_s;
  }
}

TEST(ThrusterDeadTime, IsTheSameResponseLater) {
  ThrusterParams params;
  const std::vector<double> prompt = Response(params, 0.002);
  params.dead_time_s = 0.08;
  const std::vector<double> late = Response(params, 0.002);
  for (int i = 0; i < 100; ++i)
    EXPECT_NEAR(late[i], i < 8 ? 0 : prompt[i - 8], kRounding_newton) << i;
}

TEST(ThrusterLag, DoesNotDependOnTheStep) {
  for (const double rate : {0.0, 12.0}) {
    ThrusterParams params;
    params.rate_limit_newton_per_s = rate;
    const std::vector<double> fine = Response(params, 0.001);
    for (const double dt_s : {0.002, 0.005, 0.01}) {
      const std::vector<double> coarse = Response(params, dt_s);
      ASSERT_EQ(coarse.size(), fine.size());
      for (size_t i = 0; i < fine.size(); ++i)
        EXPECT_NEAR(coarse[i], fine[i], kRounding_newton) << dt_s << " s, sample " << i;
    }
  }
}

// y' = clamp((T - y) / tau, +-r) by small explicit steps.
TEST(ThrusterLag, RateLimitAgreesWithIntegratingItsDefinition) {
  ThrusterParams params;
  params.rate_limit_newton_per_s = 12;
  const std::vector<double> got = Response(params, 0.005);
  constexpr double kStep_s = 1e-6;
  double y = 0, worst = 0;
  for (int i = 0; i < 100; ++i) {
    const double target = i < 50 ? 4.9 : -4.41;
    for (int k = 0; k < 10000; ++k)
      y += kStep_s * std::clamp((target - y) / params.lag_s, -12.0, 12.0);
    worst = std::max(worst, std::abs(y - got[i]));
  }
  // Explicit Euler at 1 us: error about rate * step = 1.2e-5 N.
  EXPECT_LT(worst, 1.2e-5);
}

}  // namespace
}  // namespace turbidock::vehicle
