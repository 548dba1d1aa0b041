// A station on its mooring against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "sim/vehicle/mooring.h"

namespace turbidock::vehicle {
namespace {

using Eigen::Vector3d;

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kDt_s = 0.002;
const Vector3d kMooredBody(0.4, -0.3, -1);

Mooring Moored(const MooringParams& params, const Sea& sea, double heading_rad = 0) {
  Mooring mooring(params, heading_rad, SeedTree(1).Stream("mooring"));
  mooring.Reset(sea, kMooredBody);
  return mooring;
}

struct Range {
  Vector3d low = Vector3d::Constant(1e9), high = Vector3d::Constant(-1e9);
  Vector3d middle() const { return (low + high) / 2; }
  Vector3d amplitude() const { return (high - low) / 2; }
};
Range RangeOf(Mooring* mooring, const Sea& sea, double time_s) {
  Range range;
  const auto ticks = static_cast<int>(std::round(time_s / kDt_s));
  for (int tick = 0; tick < ticks; ++tick) {
    mooring->Step(sea, tick * kDt_s, kDt_s);
    range.low = range.low.cwiseMin(mooring->displacement());
    range.high = range.high.cwiseMax(mooring->displacement());
  }
  return range;
}

TEST(Mooring, SwingsWithItsAmplitudesAndPeriod) {
  const MooringParams params{.swing_x_m = 0.1, .swing_y_m = 0.25, .swing_period_s = 5};
  Mooring mooring = Moored(params, Sea());
  const Vector3d start = mooring.displacement();
  const Range range = RangeOf(&mooring, Sea(), 5);
  EXPECT_NEAR(range.amplitude().x(), 0.1, 1e-6);
  EXPECT_NEAR(range.amplitude().y(), 0.25, 1e-6);
  EXPECT_EQ(range.amplitude().z(), 0);
  EXPECT_LT((mooring.displacement() - start).norm(), 1e-9);
  const Vector3d other = [&] {
    Mooring of_other_seed(params, 0, SeedTree(2).Stream("mooring"));
    of_other_seed.Reset(Sea(), kMooredBody);
    return of_other_seed.displacement();
  }();
  EXPECT_GT((other - start).norm(), 0.01) << "the phase is the seed's";
}

// In a small regular wave: |x| / |u| = |i w + 2 zeta w0| / |w0^2 - w^2 + 2 i zeta w0 w|.
TEST(Mooring, FollowsARegularWaveAsADampedOscillatorDoes) {
  SeaParams sea_params;
  sea_params.waves = {{.height_m = 0.02, .period_s = 4, .direction_rad = std::numbers::pi / 3}};
  const Sea sea(sea_params, SeedTree(3).Stream("sea"));
  const double w = kTwoPi / 4;
  const double u_mps = 0.01 * w * std::exp(-w * w / 9.81);  // at the moored body's depth of 1 m
  using namespace std::complex_literals;
  for (const double natural_period_s : {1.0, 4.0, 20.0})
    for (const double zeta : {0.1, 0.7}) {
      Mooring mooring = Moored({.natural_period_s = natural_period_s, .damping_ratio = zeta}, sea);
      const Range range = RangeOf(&mooring, sea, 40);
      const double w0 = kTwoPi / natural_period_s;
      const double expected_m =
          u_mps * std::abs(1i * w + 2 * zeta * w0) / std::abs(w0 * w0 - w * w + 2i * zeta * w0 * w);
      EXPECT_NEAR(range.amplitude().head<2>().norm(), expected_m, 0.02 * expected_m)
          << natural_period_s << " s, " << zeta;
      EXPECT_NEAR(range.amplitude().y() / range.amplitude().x(), std::sqrt(3.0), 0.03);
    }
}

// Where it has been taken: the water moves otherwise there than where it is moored.
TEST(Mooring, FeelsTheWavesWhereItIs) {
  const auto taken = [](Vector3d current_mps, double direction_rad, const Vector3d& moored_body) {
    SeaParams sea_params;
    sea_params.current.surface_velocity_mps = current_mps;
    sea_params.waves = {{.height_m = 0.05, .period_s = 2, .direction_rad = direction_rad}};
    const Sea sea(sea_params, SeedTree(3).Stream("sea"));
    Mooring mooring({.natural_period_s = 20, .damping_ratio = 0.7}, 0,
                    SeedTree(1).Stream("mooring"));
    mooring.Reset(sea, moored_body);
    std::vector<Vector3d> way;
    for (int tick = 0; tick < 2000; ++tick) {
      mooring.Step(sea, tick * kDt_s, kDt_s);
      way.push_back(mooring.displacement());
    }
    return way;
  };
  // A current across the waves takes it along their crests and changes nothing else; one along
  // them takes it to where a body further on has its waves.
  const auto farthest = [](const std::vector<Vector3d>& a, const std::vector<Vector3d>& b,
                           const Vector3d& apart) {
    double most = 0;
    for (size_t i = 0; i < a.size(); ++i) most = std::max(most, (a[i] - b[i] - apart).norm());
    return most;
  };
  const double shift_m = 2 * 0.7 * 20 / kTwoPi * 0.2;
  for (const int axis : {0, 1}) {
    const Vector3d along = Vector3d::Unit(axis), across = Vector3d::Unit(1 - axis);
    const double direction_rad = axis == 0 ? 0 : std::numbers::pi / 2;
    const auto still = taken(Vector3d::Zero(), direction_rad, kMooredBody);
    EXPECT_LT(farthest(taken(0.2 * across, direction_rad, kMooredBody), still, shift_m * across),
              1e-9);
    EXPECT_LT(farthest(taken(0.2 * along, direction_rad, kMooredBody),
                       taken(Vector3d::Zero(), direction_rad, kMooredBody + shift_m * along),
                       shift_m * along),
              1e-3);
    EXPECT_GT(farthest(taken(0.2 * along, direction_rad, kMooredBody), still, shift_m * along),
              5e-3);
  }
}

TEST(Mooring, ACurrentShiftsItByTwoZetaUOverOmega) {
  SeaParams sea_params;
  sea_params.current.surface_velocity_mps = {0.2, -0.1, 0};
  Sea sea(sea_params, SeedTree(3).Stream("sea"));
  Mooring mooring = Moored({.natural_period_s = 6, .damping_ratio = 0.3}, sea);
  const Vector3d expected = 2 * 0.3 * 6 / kTwoPi * sea_params.current.surface_velocity_mps;
  EXPECT_LT((mooring.displacement() - expected).norm(), 1e-9) << "where it stands from the start";
  // another current: it goes there by itself
  sea_params.current.surface_velocity_mps = {0, 0.3, 0};
  sea.Become(sea_params);
  RangeOf(&mooring, sea, 60);
  EXPECT_LT((mooring.displacement() - Vector3d(0, 2 * 0.3 * 6 / kTwoPi * 0.3, 0)).norm(), 1e-6);
}

// psi' = |u| / L sin(psi_u - psi) has tan(d / 2) = tan(d0 / 2) exp(-|u| t / L), d = psi_u - psi.
TEST(Mooring, AVaneTurnsIntoTheCurrent) {
  SeaParams sea_params;
  const double heading_rad = 0.4;
  const auto current_from = [](double heading) -> Vector3d {
    return -0.25 * Vector3d(std::cos(heading), std::sin(heading), 0);
  };
  sea_params.current.surface_velocity_mps = current_from(heading_rad + 1);
  Sea sea(sea_params, SeedTree(3).Stream("sea"));
  Mooring mooring = Moored({.weathervane_arm_m = 2}, sea, heading_rad);
  EXPECT_NEAR(mooring.displacement().z(), 1, 1e-12) << "insertion against the current";
  sea_params.current.surface_velocity_mps = current_from(heading_rad - 1.5);
  sea.Become(sea_params);
  for (const double time_s : {4.0, 4.0, 8.0}) {
    const double before = -1.5 - mooring.displacement().z();
    RangeOf(&mooring, sea, time_s);
    const double after = 2 * std::atan(std::tan(before / 2) * std::exp(-0.25 * time_s / 2));
    EXPECT_NEAR(mooring.displacement().z(), -1.5 - after, 1e-3);
  }
  EXPECT_EQ(mooring.displacement().head<2>(), Eigen::Vector2d::Zero());
}

}  // namespace
}  // namespace turbidock::vehicle
