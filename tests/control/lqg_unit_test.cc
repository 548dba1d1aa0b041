// The linear-quadratic law on vehicles that are what its model says, and on some that are not.

#include "control/lqg.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sim/base/random.h"

namespace turbidock::control {
namespace {

constexpr ClockParams kClock;  // 30 frames a second

// A point mass on every axis with a lagging thruster, drag and a disturbing force, in small steps;
// turning moves the marker aside. Not the law's code: simple Euler steps.
class Vehicle {
 public:
  explicit Vehicle(const LqgParams& params, const Axes& marker) : marker_(marker) {
    const auto set = [&](int axis, double inertia, double damping, double gain) {
      inertia_[axis] = inertia;
      damping_[axis] = damping;
      gain_[axis] = gain;
    };
    const auto translation = [&](int axis, const LqgParams::Translation& p) {
      set(axis, p.mass_kg, p.damping_newton_s_per_m, p.thrust_newton_per_v);
    };
    translation(kSurge, params.surge);
    translation(kSway, params.sway);
    translation(kHeave, params.heave);
    set(kYaw, params.yaw.inertia_kg_m2, params.yaw.damping_newton_m_s,
        params.yaw.moment_newton_m_per_v);
    lag_s_ = params.thruster_lag_s;
    offset_m_ = params.head_offset_m;
  }

  void Advance(const AxisVolts& volts, const Axes& force) {
    constexpr int kSteps = 200;
    const double dt_s = kClock.frame_s() / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      thrust_ += dt_s / lag_s_ * (gain_.cwiseProduct(ToAxes(volts)) - thrust_);
      speed_ += dt_s * (thrust_ + force - damping_.cwiseProduct(speed_)).cwiseQuotient(inertia_);
      marker_ -= dt_s * speed_;
      marker_[kSway] -= dt_s * speed_[kYaw] * (marker_[kSurge] + offset_m_);
    }
  }
  const Axes& marker() const { return marker_; }

 private:
  Axes marker_, speed_ = Axes::Zero(), thrust_ = Axes::Zero();
  Axes inertia_, damping_, gain_;
  double lag_s_ = 0, offset_m_ = 0;
};

// Runs a loop with one frame of latency; `force` and `noise` are of a frame. Returns the marker's
// places.
std::vector<Axes> RunLoop(const LqgParams& params, Vehicle vehicle, int frames, auto&& force,
                          auto&& noise, const Axes& wanted) {
  Lqg law(params, kClock);
  std::vector<Axes> places;
  Axes before = vehicle.marker();
  for (int n = 0; n < frames; ++n) {
    law.Observe({.frame = n - 1, .position = before + noise(n), .rate = std::nullopt});
    before = vehicle.marker();
    const AxisVolts volts = law.Demand({.position = wanted});
    law.Given(n - 1, volts);
    vehicle.Advance(volts, force(n));
    places.push_back(vehicle.marker());
  }
  return places;
}

Axes Still(int) { return Axes::Zero(); }

TEST(Lqg, DefaultsAreValid) { EXPECT_NO_THROW(CheckFields(LqgParams{}, "")); }

TEST(Lqg, EveryAxisGoesTowardsTheMarkerAndStopsThere) {
  const Axes wanted(0.6, 0.01, -0.02, 0.05);
  for (const double side : {-1.0, 1.0}) {
    const Vehicle vehicle({}, wanted + side * Axes(0.3, 0.1, 0.1, 0.2));
    const std::vector<Axes> places = RunLoop({}, vehicle, 30 * 30, Still, Still, wanted);
    const Axes left = (places.back() - wanted).cwiseAbs();
    EXPECT_LT(left.maxCoeff(), 1e-4) << left.transpose();
  }
}

TEST(Lqg, ACurrentLeavesNoOffset) {
  const Axes wanted(0.6, 0, 0, 0);
  const auto force = [](int) { return Axes(-1, 1.5, 0.5, 0.1); };
  const std::vector<Axes> places = RunLoop({}, Vehicle({}, wanted), 30 * 180, force, Still, wanted);
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
    params.heave.wave_newton = wave_newton;
    params.wave_damping = damping;
    const std::vector<Axes> places =
        RunLoop(params, Vehicle(params, wanted), 30 * 600, waves, Still, wanted);
    double most = 0;
    for (size_t n = 30 * 580; n < places.size(); ++n)
      most = std::max(most, std::abs(places[n][kHeave]));
    return most;
  };
  const double broad_m = amplitude(3, 0.1), sharp_m = amplitude(3, 0.001);
  EXPECT_LT(broad_m, 0.012);
  EXPECT_LT(sharp_m, 0.001);
  EXPECT_GT(amplitude(0, 0.1), 0.019);  // a law that knows of no waves makes it worse
}

// Sway cannot do it alone: its thruster is all but off. Turning keeps the marker in place.
TEST(Lqg, TurnsToKeepTheMarkerInPlaceWhereSwayCannot) {
  const Axes wanted(0.6, 0, 0, 0);
  LqgParams params;
  params.sway.limit_v = 0.2;
  const auto waves = [](int n) { return Axes(0, 3 * std::sin(2 * M_PI * n / 30 / 2.5), 0, 0); };
  const std::vector<Axes> places =
      RunLoop(params, Vehicle(params, wanted), 30 * 60, waves, Still, wanted);
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
      RunLoop({}, Vehicle({}, wanted), 120, Still, jump(60, 64), wanted);
  EXPECT_LT((short_jump.back() - wanted).norm(), 1e-6);
  const std::vector<Axes> long_jump =
      RunLoop({}, Vehicle({}, wanted), 240, Still, jump(60, 240), wanted);
  EXPECT_LT(long_jump.back()[kSway], -0.05);  // goes where it seems to be
}

TEST(Lqg, MissingFramesAreBridgedByTheModel) {
  const Axes wanted(0.6, 0, 0, 0), start(0.7, 0.05, 0.05, 0);
  Lqg every({}, kClock), seldom({}, kClock);
  Vehicle a({}, start), b({}, start);
  for (int n = 0; n < 300; ++n) {
    every.Observe({.frame = n, .position = a.marker(), .rate = std::nullopt});
    if (n % 5 == 0) seldom.Observe({.frame = n, .position = b.marker(), .rate = std::nullopt});
    const AxisVolts volts_a = every.Demand({.position = wanted});
    const AxisVolts volts_b = n % 5 == 0 ? seldom.Demand({.position = wanted}) : AxisVolts{};
    every.Given(n, volts_a);
    seldom.Given(n, volts_b);
    a.Advance(volts_a, Axes::Zero());
    b.Advance(volts_b, Axes::Zero());
  }
  EXPECT_LT((a.marker() - wanted).norm(), 0.01);
  EXPECT_LT((b.marker() - wanted).norm(), 0.03);
}

TEST(LqgDeathTest, RefusesFramesThatGoBack) {
  Lqg law({}, kClock);
  law.Observe({.frame = 3, .position = Axes::Zero(), .rate = std::nullopt});
  EXPECT_DEATH(law.Observe({.frame = 3, .position = Axes::Zero(), .rate = std::nullopt}),
               "frames must increase");
}

}  // namespace
}  // namespace turbidock::control
