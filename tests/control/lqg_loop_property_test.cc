// The loop between the levers it was designed for, and its feed-forward.

#include "control/lqg_loop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "control/lqg.h"
#include "tests/control/published_vehicle.h"

namespace turbidock::control {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr ClockParams kClock;

std::vector<LqgAxis> SwayAndYaw() {
  const LqgAxis sway{.model = {.inertia = 30, .damping = 12},
                     .error = 0.02,
                     .speed = 0.1,
                     .effort = 4,
                     .noise = 0.004,
                     .least = -100,
                     .most = 100};
  const LqgAxis yaw{.model = {.inertia = 0.7, .damping = 0.4},
                    .error = 0.05,
                    .speed = 0.2,
                    .effort = 0.5,
                    .noise = 0.01,
                    .least = -100,
                    .most = 100};
  return {sway, yaw};
}

// After some steps that the two loops share, up to `levers`.
LqgLoop Loop(const std::vector<double>& levers) {
  LqgLoop loop(SwayAndYaw(), levers, kClock.frame_s());
  loop.Start(Vector2d(0.1, -0.2));
  return loop;
}

TEST(LqgLoop, PredictsExactlyBetweenItsLevers) {
  LqgLoop between = Loop({0.4, 1.2}), exact = Loop({0.6});
  for (int n = 0; n < 20; ++n) {
    const Vector2d volts(std::sin(0.3 * n), 0.5 - 0.1 * n);
    between.Predict(volts, 0.6);
    exact.Predict(volts, 0.6);
  }
  EXPECT_LT((between.state() - exact.state()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_GT(exact.state().cwiseAbs().maxCoeff(), 0.1);
}

TEST(LqgLoop, CorrectsAndDemandsInProportionBetweenItsLevers) {
  constexpr double kLow = 0.4, kHigh = 1.2, kLever = 0.6, kShare = 0.25;
  LqgLoop low = Loop({kLow}), high = Loop({kHigh}), between = Loop({kLow, kHigh});
  const Vector2d measured(0.13, -0.17);
  for (LqgLoop* loop : {&low, &high, &between}) loop->Correct(measured, kLever);
  const VectorXd expected = low.state() + kShare * (high.state() - low.state());
  EXPECT_LT((between.state() - expected).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_GT((high.state() - low.state()).cwiseAbs().maxCoeff(), 1e-4);  // or it proves nothing

  LqgLoop low_2 = Loop({kLow}), high_2 = Loop({kHigh}), between_2 = Loop({kLow, kHigh});
  const auto demand = [&](LqgLoop* loop) -> Vector2d {
    loop->StartAhead();
    return loop->Demand(Vector2d(0.05, 0.02), Vector2d(0.1, -0.1), Vector2d(0.2, 0.3), kLever);
  };
  const Vector2d at_low = demand(&low_2), at_high = demand(&high_2), now = demand(&between_2);
  const Vector2d wanted = at_low + kShare * (at_high - at_low);
  EXPECT_LT((now - wanted).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_GT((at_high - at_low).cwiseAbs().maxCoeff(), 1e-3);
}

// A vehicle that is what the controller's model says, in small steps; turning moves the marker
// aside. Places of the marker while it is to move along a path.
template <class Path>
double LargestLag(const Path& path, bool with_rate, bool with_acceleration) {
  const VehicleModel vehicle = PublishedVehicle();
  LqgParams params;
  params.yaw.limit_share = 1;
  Lqg controller(params, vehicle, kClock);
  Axes marker = path(0).position, speed = -path(0).rate, thrust = Axes::Zero();
  const Axes damping = vehicle.DampingAt({0.05, 0.1, 0.05, 0.1});
  Axes before = marker;
  double most = 0;
  constexpr int kSteps = 100, kFrames = 900;
  for (int n = 0; n < kFrames; ++n) {
    controller.Observe({.frame = n - 1, .position = before, .rate = std::nullopt});
    before = marker;
    Reference wanted = path(n);
    if (!with_rate) wanted.rate.setZero();
    if (!with_acceleration) wanted.acceleration.setZero();
    const Axes demand = controller.Demand(wanted);
    controller.OnCommandApplied(n - 1, demand);
    for (int i = 0; i < kSteps; ++i) {
      const double dt_s = kClock.frame_s() / kSteps;
      thrust += dt_s / vehicle.thruster_lag_s * (demand - thrust);
      speed += dt_s * (thrust - damping.cwiseProduct(speed)).cwiseQuotient(vehicle.inertia);
      marker -= dt_s * speed;
      marker[kSway] -= dt_s * speed[kYaw] * (marker[kSurge] + vehicle.head_ahead_m);
    }
    if (n > 600) most = std::max(most, (marker - path(n + 1).position).cwiseAbs().maxCoeff());
  }
  return most;
}

TEST(LqgFeedForward, AMovingSetpointIsFollowedWithoutLag) {
  // In every axis at once, also while turning.
  const auto path = [](int n) {
    const double t_s = n / 30.0;
    Reference r;
    const Axes rate(-0.01, 0.012, -0.015, 0.01);
    r.position = Axes(1.2, -0.15, 0.2, -0.15) + t_s * rate;
    r.rate = rate;
    return r;
  };
  const double with = LargestLag(path, true, true), without = LargestLag(path, false, false);
  EXPECT_LT(with, 0.25 * without) << with << " and " << without;
}

TEST(LqgFeedForward, AnAcceleratingSetpointIsFollowedBetterWhenItsAccelerationIsGiven) {
  const auto path = [](int n) {
    const double t_s = n / 30.0, omega = 1.2;
    Reference r;
    const Axes size(0.03, 0.03, 0.03, 0.03);
    r.position = Axes(0.8, 0, 0, 0) + std::sin(omega * t_s) * size;
    r.rate = omega * std::cos(omega * t_s) * size;
    r.acceleration = -omega * omega * std::sin(omega * t_s) * size;
    return r;
  };
  const double with = LargestLag(path, true, true), half = LargestLag(path, true, false);
  EXPECT_LT(with, 0.8 * half) << with << " and " << half;
}

}  // namespace
}  // namespace turbidock::control
