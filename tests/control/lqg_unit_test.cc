// The linear-quadratic controller on vehicles that are what its model says, and on some that are
// not.

#include "control/lqg.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "control/thrust_allocation.h"
#include "sim/base/random.h"
#include "tests/control/published_vehicle.h"

namespace turbidock::control {
namespace {

constexpr ClockParams kClock;  // 30 frames a second

// A point mass on every axis with a lagging thruster, drag and a disturbing force, in small steps;
// turning moves the marker aside. Not the controller's code: simple Euler steps.
class Vehicle {
 public:
  explicit Vehicle(const Axes& marker) : marker_(marker) {
    const VehicleModel vehicle = PublishedVehicle();
    inertia_ = vehicle.inertia;
    damping_ = vehicle.DampingAt({0.05, 0.1, 0.05, 0.1});
    lag_s_ = vehicle.thruster_lag_s;
    offset_m_ = vehicle.head_ahead_m;
  }

  void Advance(const Axes& demand, const Axes& force) {
    constexpr int kSteps = 200;
    const double dt_s = kClock.frame_s() / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      thrust_ += dt_s / lag_s_ * (demand - thrust_);
      speed_ += dt_s * (thrust_ + force - damping_.cwiseProduct(speed_)).cwiseQuotient(inertia_);
      marker_ -= dt_s * speed_;
      marker_[kSway] -= dt_s * speed_[kYaw] * (marker_[kSurge] + offset_m_);
    }
  }
  const Axes& marker() const { return marker_; }

 private:
  Axes marker_, speed_ = Axes::Zero(), thrust_ = Axes::Zero();
  Axes inertia_, damping_;
  double lag_s_ = 0, offset_m_ = 0;
};

// Runs a loop with one frame of latency; `force` and `noise` are of a frame. Returns the marker's
// places.
std::vector<Axes> RunLoop(const LqgParams& params, Vehicle vehicle, int frames, auto&& force,
                          auto&& noise, const Axes& wanted) {
  Lqg controller(params, PublishedVehicle(), kClock);
  std::vector<Axes> places;
  Axes before = vehicle.marker();
  for (int n = 0; n < frames; ++n) {
    controller.Observe({.frame = n - 1, .position = before + noise(n), .rate = std::nullopt});
    before = vehicle.marker();
    const Axes demand = controller.Demand({.position = wanted});
    controller.OnCommandApplied(n - 1, demand);
    vehicle.Advance(demand, force(n));
    places.push_back(vehicle.marker());
  }
  return places;
}

Axes Still(int) { return Axes::Zero(); }

TEST(Lqg, DefaultsAreValid) { EXPECT_NO_THROW(CheckFields(LqgParams{}, "")); }

TEST(Lqg, EveryAxisGoesTowardsTheMarkerAndStopsThere) {
  const Axes wanted(0.6, 0.01, -0.02, 0.05);
  for (const double side : {-1.0, 1.0}) {
    const Vehicle vehicle(wanted + side * Axes(0.3, 0.1, 0.1, 0.2));
    const std::vector<Axes> places = RunLoop({}, vehicle, 30 * 30, Still, Still, wanted);
    const Axes left = (places.back() - wanted).cwiseAbs();
    EXPECT_LT(left.maxCoeff(), 1e-4) << left.transpose();
  }
}

// Of any regulator of a position whose rate is a state of its own: where the cost of an error over
// error_m equals that of a force of `effort`, its stiffness is effort / error_m, whatever the drag.
// A thirtieth of a second's hold takes some per cent of it.
TEST(Lqg, ItsStiffnessIsTheEffortOverTheError) {
  const Axes wanted(0.6, 0, 0, 0);
  const double offset_m = 1e-4;
  for (const double effort_share : {0.03, 0.1, 0.273})
    for (const double error_m : {0.01, 0.03}) {
      LqgParams params;
      params.heave.effort_share = effort_share;
      params.heave.error_m = error_m;
      Lqg controller(params, PublishedVehicle(), kClock);
      controller.Observe(
          {.frame = 0, .position = wanted + offset_m * Axes::Unit(kHeave), .rate = std::nullopt});
      const double stiffness = controller.Demand({.position = wanted})[kHeave] / offset_m;
      const double effort =
          effort_share * ForceAllocation(params.allocation, PublishedVehicle()).authority()[kHeave];
      EXPECT_NEAR(stiffness, effort / error_m, 0.1 * effort / error_m)
          << effort_share << ' ' << error_m;
    }
}

TEST(Lqg, WavesThatTurnTheVehicleAreCancelledWhenTheyAreExpected) {
  const Axes wanted(0.6, 0, 0, 0);
  const double inertia = PublishedVehicle().inertia[kYaw];
  const auto waves = [&](int n) {
    return Axes(0, 0, 0, 0.1 * inertia * std::sin(2 * M_PI * n / 30 / 2.5));
  };
  const auto amplitude = [&](double expected_rad_s2) {
    LqgParams params;
    params.yaw.wave_rad_s2 = expected_rad_s2;
    const std::vector<Axes> places =
        RunLoop(params, Vehicle(wanted), 30 * 90, waves, Still, wanted);
    double most = 0;
    for (size_t n = 30 * 70; n < places.size(); ++n)
      most = std::max(most, std::abs(places[n][kYaw]));
    return most;
  };
  EXPECT_LT(amplitude(0.1), 0.6 * amplitude(0));
}

TEST(Lqg, ACurrentLeavesNoOffset) {
  const Axes wanted(0.6, 0, 0, 0);
  const auto force = [](int) { return Axes(-1, 1.5, 0.5, 0.1); };
  const std::vector<Axes> places = RunLoop({}, Vehicle(wanted), 30 * 180, force, Still, wanted);
  // the current's model forgets in a minute, so a thousandth of what 20 N/m would leave may stay
  const Axes left = (places.back() - wanted).cwiseAbs();
  EXPECT_LT(left.maxCoeff(), 1e-3) << left.transpose();
}

// 3 N at the period the filter expects move the vehicle without control 19 mm to either side. The
// sharper the filter's resonance, the more of it is cancelled (and the longer it takes to learn).
TEST(Lqg, WavesOfTheExpectedPeriodAreCancelled) {
  const Axes wanted(0.6, 0, 0, 0);
  const auto waves = [](int n) { return Axes(0, 0, 3 * std::sin(2 * M_PI * n / 30 / 2.5), 0); };
  const auto amplitude = [&](double wave_newton, double damping) {
    LqgParams params;
    params.heave.wave_mps2 = wave_newton / 24;
    params.wave_damping = damping;
    const std::vector<Axes> places =
        RunLoop(params, Vehicle(wanted), 30 * 600, waves, Still, wanted);
    double most = 0;
    for (size_t n = 30 * 580; n < places.size(); ++n)
      most = std::max(most, std::abs(places[n][kHeave]));
    return most;
  };
  const double broad_m = amplitude(3, 0.1), sharp_m = amplitude(3, 0.001);
  EXPECT_LT(broad_m, 0.012);
  EXPECT_LT(sharp_m, 0.001);
  EXPECT_GT(amplitude(0, 0.1), 0.019);  // a controller that knows of no waves makes it worse
}

// Sway cannot do it alone: its thruster is all but off. Turning keeps the marker in place.
TEST(Lqg, TurnsToKeepTheMarkerInPlaceWhereSwayCannot) {
  const Axes wanted(0.6, 0, 0, 0);
  LqgParams params;
  params.sway.limit_share = 0.09;
  const auto waves = [](int n) { return Axes(0, 3 * std::sin(2 * M_PI * n / 30 / 2.5), 0, 0); };
  const std::vector<Axes> places = RunLoop(params, Vehicle(wanted), 30 * 60, waves, Still, wanted);
  double aside_m = 0, turned_rad = 0;
  for (size_t n = 30 * 40; n < places.size(); ++n) {
    aside_m = std::max(aside_m, std::abs(places[n][kSway]));
    turned_rad = std::max(turned_rad, std::abs(places[n][kYaw]));
  }
  // 3 N on 25 kg at 2.5 s move the vehicle 17 mm to either side
  EXPECT_LT(aside_m, 0.008);
  EXPECT_GT(turned_rad, 0.01);
  EXPECT_LT(turned_rad, 0.05);
}

TEST(Lqg, OutliersAreNotUsedUntilTheyLast) {
  const Axes wanted(0.6, 0, 0, 0);
  const auto jump = [](int from, int to) {
    return [=](int n) { return n >= from && n < to ? Axes(0.3, 0.2, -0.2, 0) : Axes::Zero(); };
  };
  const std::vector<Axes> short_jump =
      RunLoop({}, Vehicle(wanted), 120, Still, jump(60, 64), wanted);
  EXPECT_LT((short_jump.back() - wanted).norm(), 1e-6);
  const std::vector<Axes> long_jump =
      RunLoop({}, Vehicle(wanted), 240, Still, jump(60, 240), wanted);
  EXPECT_LT(long_jump.back()[kSway], -0.05);  // goes where it seems to be
}

TEST(Lqg, MissingFramesAreBridgedByTheModel) {
  const Axes wanted(0.6, 0, 0, 0), start(0.7, 0.05, 0.05, 0);
  Lqg every({}, PublishedVehicle(), kClock), seldom({}, PublishedVehicle(), kClock);
  Vehicle a(start), b(start);
  for (int n = 0; n < 300; ++n) {
    every.Observe({.frame = n, .position = a.marker(), .rate = std::nullopt});
    if (n % 5 == 0) seldom.Observe({.frame = n, .position = b.marker(), .rate = std::nullopt});
    const Axes demand_a = every.Demand({.position = wanted});
    const Axes demand_b = n % 5 == 0 ? seldom.Demand({.position = wanted}) : Axes(Axes::Zero());
    every.OnCommandApplied(n, demand_a);
    seldom.OnCommandApplied(n, demand_b);
    a.Advance(demand_a, Axes::Zero());
    b.Advance(demand_b, Axes::Zero());
  }
  EXPECT_LT((a.marker() - wanted).norm(), 0.01);
  EXPECT_LT((b.marker() - wanted).norm(), 0.03);
}

TEST(LqgDeathTest, RefusesFramesThatGoBack) {
  Lqg controller({}, PublishedVehicle(), kClock);
  controller.Observe({.frame = 3, .position = Axes::Zero(), .rate = std::nullopt});
  EXPECT_DEATH(controller.Observe({.frame = 3, .position = Axes::Zero(), .rate = std::nullopt}),
               "frames must increase");
}

// Five seconds without an estimate, in a current, on the way: the vehicle goes where it believes
// to go.
TEST(Lqg, PredictsWhereTheMarkerIsWhileItIsNotSeen) {
  Lqg controller({}, PublishedVehicle(), kClock);
  EXPECT_FALSE(controller.Predict(0));
  const Axes start(0.6, 0.01, -0.01, 0.02), current(0, 0.6, 0, 0.02);
  Vehicle vehicle(start);
  Axes before = start, most_off = Axes::Zero();
  for (int n = 0; n < 25 * 30; ++n) {
    const bool blind = n >= 20 * 30;
    if (!blind) {
      controller.Observe({.frame = n - 1, .position = before, .rate = std::nullopt});
    } else {
      const auto predicted = controller.Predict(n - 1);
      ASSERT_TRUE(predicted);
      most_off = most_off.cwiseMax((*predicted - before).cwiseAbs());
    }
    before = vehicle.marker();
    const double x = std::max(0.35, 0.6 - 0.03 * std::max(0, n - 16 * 30) / 30.0);
    const Axes demand = controller.Demand({.position = {x, 0, 0, 0}});
    controller.OnCommandApplied(n - 1, demand);
    vehicle.Advance(demand, current);
  }
  EXPECT_LT(most_off[kSurge], 0.005);
  EXPECT_LT(most_off[kSway], 0.015);
  EXPECT_LT(most_off[kYaw], 0.03);
  EXPECT_NEAR(vehicle.marker()[kSurge], 0.35, 0.01);
  EXPECT_NEAR(vehicle.marker()[kSway], 0, 0.015);
}

}  // namespace
}  // namespace turbidock::control
