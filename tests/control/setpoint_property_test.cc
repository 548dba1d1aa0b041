// Laws of the led setpoint and of the pose filter.

#include "control/setpoint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "control/pose_filter.h"
#include "sim/base/random.h"

namespace turbidock::control {
namespace {

constexpr ClockParams kClock;  // 30 frames a second

TEST(Setpoint, OffItIsTheDesiredPose) {
  Setpoint setpoint({}, kClock);
  const Axes desired(0.6, 0.1, 0.2, 0.3);
  const Reference& reference = setpoint.Lead(0, desired, Axes::Zero());
  EXPECT_EQ(reference.position, desired);
  EXPECT_EQ(reference.rate, Axes(Axes::Zero()));
}

// From anywhere to anywhere, with a goal that jumps on the way.
TEST(Setpoint, BeginsAtTheSeenPoseKeepsItsLimitsAndStandsStillAtTheGoal) {
  const SetpointParams params{.enabled = true};
  Rng rng = SeedTree(3).Stream("setpoint");
  const auto draw = [&] {
    return Axes(rng.Uniform(0.2, 1.5), rng.Uniform(-0.3, 0.3), rng.Uniform(-0.3, 0.3),
                rng.Uniform(-0.5, 0.5));
  };
  for (int run = 0; run < 200; ++run) {
    Setpoint setpoint(params, kClock);
    const Axes start = draw(), first = draw(), second = draw();
    Reference before = setpoint.Lead(0, first, start);
    EXPECT_EQ(before.position, start);
    EXPECT_EQ(before.rate, Axes(Axes::Zero()));
    const int jump = static_cast<int>(rng.Below(200));
    for (int n = 1; n < 1200; ++n) {
      const Reference now = setpoint.Lead(n, n < jump ? first : second, draw());
      for (int i = 0; i < kAxisCount; ++i) {
        ASSERT_LE(std::abs(now.rate[i]), params.speed[i] * (1 + 1e-12));
        // the last step may take two: it ends at rest
        ASSERT_LE(std::abs(now.rate[i] - before.rate[i]),
                  2 * params.acceleration[i] / 30 * (1 + 1e-9));
        ASSERT_NEAR(now.position[i], before.position[i] + now.rate[i] / 30,
                    2 * params.acceleration[i] / 900);
      }
      before = now;
    }
    EXPECT_EQ(before.position, second);
    EXPECT_EQ(before.rate, Axes(Axes::Zero()));
  }
}

// Its acceleration, which laws feed forward, is the change of its rate, in the last step too; the
// goal is reached from one side, as soon as the limits allow.
TEST(Setpoint, SaysHowItAcceleratesAndDoesNotOvershoot) {
  const SetpointParams params{.enabled = true};
  for (const double way_m : {0.003, 0.02, 0.1, 0.43, 1.2}) {
    Setpoint setpoint(params, kClock);
    const Axes goal(0.5, 0, 0, 0);
    Reference before = setpoint.Lead(0, goal, {0.5 + way_m, 0, 0, 0});
    int arrived = 0;
    for (int n = 1; n < 2000; ++n) {
      const Reference now = setpoint.Lead(n, goal, Axes::Zero());
      ASSERT_NEAR(now.acceleration[kSurge] / 30, now.rate[kSurge] - before.rate[kSurge], 1e-12);
      ASSERT_GE(now.position[kSurge], 0.5 - 1e-12) << way_m << ' ' << n;
      if (!arrived && now.position[kSurge] == 0.5) arrived = n;
      before = now;
    }
    const double v = params.speed[kSurge], a = params.acceleration[kSurge];
    const double least_s = way_m < v * v / a ? 2 * std::sqrt(way_m / a) : way_m / v + v / a;
    EXPECT_NEAR(arrived / 30.0, least_s, 4 / 30.0) << way_m;
  }
}

TEST(Setpoint, TurnsTheShorterWayRound) {
  Setpoint setpoint({.enabled = true}, kClock);
  setpoint.Lead(0, {0, 0, 0, -3}, {0, 0, 0, 3});
  const Reference& reference = setpoint.Lead(240, {0, 0, 0, -3}, Axes::Zero());
  EXPECT_NEAR(reference.position[kYaw], -3, 1e-12);
}

TEST(Setpoint, ARestartBeginsWhereTheMarkerIs) {
  Setpoint setpoint({.enabled = true}, kClock);
  setpoint.Lead(0, {0.6, 0, 0, 0}, {1.2, 0, 0, 0});
  setpoint.Lead(30, {0.6, 0, 0, 0}, {1.1, 0, 0, 0});
  setpoint.Restart();
  EXPECT_EQ(setpoint.Lead(31, {0.6, 0, 0, 0}, {1.0, 0, 0, 0}).position, Axes(1.0, 0, 0, 0));
}

Observation Seen(int64_t frame, const Axes& position) {
  return {.frame = frame, .position = position, .rate = std::nullopt};
}

TEST(PoseFilter, OffItPassesOnWhatItGets) {
  PoseFilter filter({}, kClock);
  const auto out = filter.Update(Seen(5, {1, 2, 3, 0.4}));
  ASSERT_TRUE(out);
  EXPECT_EQ(out->frame, 5);
  EXPECT_EQ(out->position, Axes(1, 2, 3, 0.4));
  EXPECT_FALSE(out->rate);
}

TEST(PoseFilter, FollowsASteadySpeedWithoutLagAndPredictsOverTheLatency) {
  PoseFilter filter({.enabled = true, .latency_s = 0.1}, kClock);
  const Axes speed(-0.1, 0.05, 0.02, 1.0);  // the heading wraps on the way
  for (int n = 0; n < 300; ++n) {
    Axes position = Axes(1, 0, 0, 0) + speed * (n / 30.0);
    position[kYaw] = WrapAngle(position[kYaw]);
    const auto out = filter.Update(Seen(n, position));
    if (n < 200) continue;
    ASSERT_TRUE(out);
    EXPECT_LT((*out->rate - speed).norm(), 1e-6);
    EXPECT_LT(Difference(out->position, position + 0.1 * speed).norm(), 1e-6);
  }
}

// Of a marker at rest: the settled alpha-beta filter passes on the share
// (2 alpha^2 + beta (2 - 3 alpha)) / (alpha (4 - 2 alpha - beta)) of the noise's variance, alpha
// and beta following from the tracking index (Kalata 1984).
TEST(PoseFilter, LeavesOfTheNoiseWhatKalatasFilterLeaves) {
  const PoseFilterParams params{.enabled = true,
                                .noise = {0.006, 0.002, 0.002, 0.02},
                                .acceleration = {0.2, 0.2, 0.05, 0.4},
                                .latency_s = 0};
  PoseFilter filter(params, kClock);
  Rng rng = SeedTree(3).Stream("filter");
  Axes in = Axes::Zero(), out = Axes::Zero();
  for (int n = 0; n < 30000; ++n) {
    Axes error;
    for (int i = 0; i < kAxisCount; ++i) error[i] = params.noise[i] * rng.Normal();
    const auto filtered = filter.Update(Seen(n, error));
    if (n < 300 || !filtered) continue;
    in += error.cwiseAbs2();
    out += filtered->position.cwiseAbs2();
  }
  for (int i = 0; i < kAxisCount; ++i) {
    const double index = params.acceleration[i] / 900 / params.noise[i];
    const double r = (4 + index - std::sqrt(8 * index + index * index)) / 4;
    const double alpha = 1 - r * r, beta = 2 * (2 - alpha) - 4 * std::sqrt(1 - alpha);
    const double share =
        (2 * alpha * alpha + beta * (2 - 3 * alpha)) / (alpha * (4 - 2 * alpha - beta));
    // 30,000 samples, correlated over some 1 / alpha of them
    EXPECT_NEAR(out[i] / in[i], share, 0.1 * share) << i;
  }
}

// A Kalman filter of each axis by hand, whose noise is what is claimed of each estimate, but not
// less than the filter's own.
TEST(PoseFilter, BelievesAnEstimateNoMoreThanItClaims) {
  const PoseFilterParams params{.enabled = true, .latency_s = 0, .gate_sigma = 100};
  PoseFilter filter(params, kClock);
  Rng rng = SeedTree(9).Stream("claims");
  std::array<Eigen::Vector2d, kAxisCount> states;
  std::array<Eigen::Matrix2d, kAxisCount> P;
  const double t = kClock.frame_s();
  const Eigen::Matrix2d A{{1, t}, {0, 1}};
  const Eigen::Vector2d by_acceleration(t * t / 2, t);
  for (int n = 0; n < 60; ++n) {
    Observation seen = Seen(n, Axes::Zero());
    Axes claimed;
    for (int i = 0; i < kAxisCount; ++i) {
      claimed[i] = params.noise[i] * rng.Uniform(0.1, 10);
      seen.position[i] = claimed[i] * rng.Normal();
    }
    if (n % 3) seen.variance = claimed.cwiseAbs2();
    const auto out = filter.Update(seen);
    ASSERT_TRUE(out);
    for (int i = 0; i < kAxisCount; ++i) {
      const auto at = static_cast<size_t>(i);
      const double noise = n % 3 ? std::max(claimed[i], params.noise[i]) : params.noise[i];
      const double a2 = params.acceleration[i] * params.acceleration[i];
      if (n == 0) {
        states[at] = {seen.position[i], 0};
        P[at] = Eigen::Vector2d(noise * noise, a2).asDiagonal();
      } else {
        states[at] = A * states[at];
        P[at] = A * P[at] * A.transpose() + a2 * by_acceleration * by_acceleration.transpose();
        const Eigen::Vector2d gain = P[at].col(0) / (P[at](0, 0) + noise * noise);
        states[at] += gain * (seen.position[i] - states[at][0]);
        P[at] -= gain * P[at].row(0).eval();
      }
      EXPECT_NEAR(out->position[i], states[at][0], 1e-12) << n << ' ' << i;
      EXPECT_NEAR((*out->rate)[i], states[at][1], 1e-12) << n << ' ' << i;
    }
  }
}

TEST(PoseFilter, RefusesOutliersAndBelievesThemWhenTheyLast) {
  PoseFilter filter({.enabled = true, .restart_frames = 4}, kClock);
  for (int n = 0; n < 30; ++n) ASSERT_TRUE(filter.Update(Seen(n, {0.6, 0, 0, 0})));
  for (int n = 30; n < 33; ++n) EXPECT_FALSE(filter.Update(Seen(n, {0.6, 0.3, 0, 0}))) << n;
  const auto out = filter.Update(Seen(33, {0.6, 0.3, 0, 0}));
  ASSERT_TRUE(out);
  EXPECT_EQ(out->position[kSway], 0.3);
  EXPECT_EQ((*out->rate)[kSway], 0);
  // one outlier among good ones is forgotten
  for (int n = 34; n < 60; ++n)
    EXPECT_EQ(filter.Update(Seen(n, {0.6, n % 2 ? 0.3 : 3.0, 0, 0})).has_value(), n % 2 == 1) << n;
}

TEST(PoseFilter, ALongGapStartsItAnew) {
  PoseFilter filter({.enabled = true, .restart_frames = 6}, kClock);
  for (int n = 0; n < 30; ++n) filter.Update(Seen(n, {0.6 - 0.01 * n, 0, 0, 0}));
  const auto out = filter.Update(Seen(40, {1.2, 0.2, 0, 0}));
  ASSERT_TRUE(out);
  EXPECT_EQ(out->position, Axes(1.2, 0.2, 0, 0));
  EXPECT_EQ(*out->rate, Axes(Axes::Zero()));
}

}  // namespace
}  // namespace turbidock::control
