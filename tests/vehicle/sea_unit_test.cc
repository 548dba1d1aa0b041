#include "sim/vehicle/sea.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace turbidock::vehicle {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

Rng Stream(uint64_t seed) { return SeedTree(seed).Stream("sea"); }

SeaParams Everything() {
  SeaParams params{.state = SeaState::kModerate};
  params.current = {.surface_velocity_mps = {0.1, -0.05, 0},
                    .decay_depth_m = 4,
                    .gust_std_mps = 0.02,
                    .gust_time_constant_s = 5};
  params.jonswap.significant_height_m = 0.1;
  params.tether.enabled = true;
  return params;
}

TEST(Sea, DefaultsAreValid) {
  for (const SeaParams& params : {SeaParams(), Everything()})
    EXPECT_NO_THROW(CheckFields(params, "sea"));
}

TEST(Sea, AStateIsItsWaveBeforeThoseSpeltOut) {
  SeaParams named{.state = SeaState::kRough}, spelt;
  named.waves = {{.height_m = 0.1, .period_s = 2}};
  spelt.waves = {{.height_m = 0.2, .period_s = 3, .direction_rad = std::numbers::pi / 2},
                 {.height_m = 0.1, .period_s = 2}};
  const Vector3d p(0.3, -0.2, -1);
  EXPECT_EQ(Sea(named, Stream(5)).At(p, 2).v_W, Sea(spelt, Stream(5)).At(p, 2).v_W);
  named.waves.clear();
  EXPECT_NE(Sea(named, Stream(5)).At(p, 2).v_W, Sea(spelt, Stream(5)).At(p, 2).v_W);
}

TEST(Sea, BadValuesAreRefused) {
  SeaParams params;
  params.waves.push_back({.height_m = 0.1, .period_s = 0});
  try {
    CheckFields(params, "sea");
    FAIL() << "accepted";
  } catch (const ConfigError& e) {
    EXPECT_EQ(e.key(), "sea.waves[0].period_s");
  }
}

TEST(Sea, IsStillUnlessToldOtherwise) {
  Sea still;
  still.Step(0.1);
  for (const Sea& sea : {still, Sea(SeaParams(), Stream(1))}) {
    const WaterMotion motion = sea.At({1, 2, -3}, 4);
    EXPECT_EQ(motion.v_W, Vector3d::Zero());
    EXPECT_EQ(motion.a_W, Vector3d::Zero());
    EXPECT_EQ(sea.TetherForce({0, 0, -1}, {1, 1, 1}, 0), Vector3d::Zero());
  }
}

TEST(Sea, SameSeedSameSeaAndCopiesRunAlike) {
  Sea a(Everything(), Stream(7)), b(Everything(), Stream(7)), other(Everything(), Stream(8));
  for (int i = 0; i < 100; ++i) {
    a.Step(0.01);
    b.Step(0.01);
    other.Step(0.01);
  }
  Sea copy = a;
  copy.Step(0.01);
  EXPECT_EQ(a.At({0, 0, -1}, 1).v_W, b.At({0, 0, -1}, 1).v_W) << "the copy moved the original";
  a.Step(0.01);
  EXPECT_EQ(a.At({0, 0, -1}, 1).v_W, copy.At({0, 0, -1}, 1).v_W);
  EXPECT_NE(a.At({0, 0, -1}, 1).v_W, other.At({0, 0, -1}, 1).v_W);
}

TEST(Sea, PhasesAreDrawnOnlyWhenAsked) {
  SeaParams params{.state = SeaState::kCalm, .random_phases = false};
  const double fixed = Sea(params, Stream(1)).Elevation({0, 0, 0}, 0);
  EXPECT_DOUBLE_EQ(fixed, 0.025);  // a crest
  EXPECT_EQ(Sea(params, Stream(2)).Elevation({0, 0, 0}, 0), fixed);
  params.random_phases = true;
  EXPECT_NE(Sea(params, Stream(1)).Elevation({0, 0, 0}, 0),
            Sea(params, Stream(2)).Elevation({0, 0, 0}, 0));
}

TEST(Sea, CurrentDecaysWithDepthAndStopsGrowingAtTheSurface) {
  SeaParams params;
  params.current.surface_velocity_mps = {0.2, 0, 0};
  EXPECT_EQ(Sea(params, Stream(1)).At({0, 0, -7}, 0).v_W.x(), 0.2);
  params.current.decay_depth_m = 2;
  const Sea sea(params, Stream(1));
  EXPECT_DOUBLE_EQ(sea.At({0, 0, -2}, 0).v_W.x(), 0.2 * std::exp(-1));
  EXPECT_EQ(sea.At({0, 0, 3}, 0).v_W.x(), 0.2);
}

TEST(Tether, CarriesHalfItsDragAndWeightAndPullsWhenTaut) {
  SeaParams params;
  params.current.surface_velocity_mps = {0, 0.1, 0};
  params.tether.enabled = true;
  params.tether.p_WAnchor_m = {-12, 0, -1};
  params.tether.net_weight_newton_per_m = 0.05;
  const Sea sea(params, Stream(1));
  // Slack, along x; the flow across it.
  const Vector3d slack = sea.TetherForce({0, 0, -1}, Vector3d::Zero(), 0);
  EXPECT_NEAR(slack.y(), 0.5 * (0.5 * 1025 * 1.2 * 0.008 * 20 * 0.01), 1e-12);
  EXPECT_NEAR(slack.z(), -0.5, 1e-12);
  EXPECT_NEAR(slack.x(), 0, 1e-12);
  // Moving at twice the current, its middle drifts along: no drag.
  EXPECT_NEAR(sea.TetherForce({0, 0, -1}, {0, 0.2, 0}, 0).y(), 0, 1e-12);
  // Stretched by 0.5 m: 100 N; it lets go rather than push.
  EXPECT_NEAR(sea.TetherForce({8.5, 0, -1}, Vector3d::Zero(), 0).x(), -100, 1e-9);
  EXPECT_NEAR(sea.TetherForce({8.5, 0, -1}, {-10, 0, 0}, 0).x(), 0, 1e-9);
  // Flow along the cable does not count.
  params.current.surface_velocity_mps = {1, 0, 0};
  EXPECT_NEAR(Sea(params, Stream(1)).TetherForce({0, 0, -1}, Vector3d::Zero(), 0).x(), 0, 1e-12);
}

TEST(Sea, BecomesTheOneThatItWouldHaveBeen) {
  SeaParams params;
  params.waves = {{.height_m = 0.1, .period_s = 2.5}};
  SeaParams others = params;
  others.current.surface_velocity_mps = {0.1, -0.2, 0};
  others.state = SeaState::kRough;
  others.jonswap.significant_height_m = 0.2;
  Sea sea(params, Stream(5));
  sea.Step(0.01);
  const Sea other(others, Stream(5));
  EXPECT_NE(sea.At({1, 2, -1}, 3).v_W, other.At({1, 2, -1}, 3).v_W);
  sea.Become(others);
  EXPECT_EQ(sea.At({1, 2, -1}, 3).v_W, other.At({1, 2, -1}, 3).v_W);
  EXPECT_EQ(sea.At({1, 2, -1}, 3).a_W, other.At({1, 2, -1}, 3).a_W);
  sea.Become(params);
  EXPECT_EQ(sea.At({1, 2, -1}, 3).v_W, Sea(params, Stream(5)).At({1, 2, -1}, 3).v_W);
}

TEST(Sea, KeepsItsGustsWhenItBecomesAnother) {
  SeaParams gusty;
  gusty.current.gust_std_mps = 0.1;
  Sea sea(gusty, Stream(6)), same(gusty, Stream(6));
  const auto gust = [](const Sea& s) { return s.At({0, 0, -1}, 0).v_W; };
  SeaParams stronger = gusty;
  stronger.current.gust_std_mps = 0.2;
  for (int i = 0; i < 10; ++i) {
    sea.Step(0.1);
    same.Step(0.1);
  }
  sea.Become(stronger);
  EXPECT_GT(gust(same).norm(), 0);
  EXPECT_LT((gust(sea) - 2 * gust(same)).norm(), 1e-15);
  for (int i = 0; i < 100; ++i) {
    sea.Step(0.1);
    same.Step(0.1);
    EXPECT_LT((gust(sea) - 2 * gust(same)).norm(), 1e-14);  // the same draws
  }
  sea.Become({});
  sea.Step(0.1);
  EXPECT_EQ(gust(sea), Vector3d::Zero());
  sea.Become(gusty);
  EXPECT_EQ(gust(sea), Vector3d::Zero());
  sea.Step(0.1);
  sea.Step(0.1);
  EXPECT_GT(gust(sea).norm(), 0);
}

// Drift is the integral of the current, also of a measured one and from one sea to another.
TEST(Sea, DriftIsTheWayThatTheCurrentWent) {
  constexpr double kTick_s = 0.1;
  const Vector3d p_W(0, 0, -2);
  SeaParams params;
  params.current.decay_depth_m = 2;
  params.current.gust_std_mps = 0.1;
  Sea sea(params, Stream(7), {{0, {0.2, 0, 0.1}}, {4, {-0.4, 0.3, 0}}});
  Vector3d drift = Vector3d::Zero();
  for (int i = 0; i < 100; ++i) {
    if (i == 60) {
      params.current.surface_velocity_mps = {0, 0.5, 0};
      sea.Become(params);
    }
    sea.Step(kTick_s, i * kTick_s);
    const WaterMotion begin = sea.At(p_W, i * kTick_s);
    drift += kTick_s * (begin.v_W + kTick_s / 2 * begin.a_W);
    ASSERT_LT((sea.Drift(p_W) - drift).norm(), 1e-12) << i;
  }
  EXPECT_GT(drift.norm(), 0.5);
}

// Also where its rows are closer than the steps, and rough.
TEST(Sea, AccelerationsOfAMeasuredCurrentAddUpToIt) {
  constexpr double kTick_s = 0.01;
  Rng rng = Stream(3);
  CurrentSeries series;
  for (int i = 0; i <= 1600; ++i) series.push_back({i * kTick_s / 16, {0.01 * rng.Normal(), 0, 0}});
  Sea sea(SeaParams(), Stream(7), series);
  double speed_mps = series.front().v_W.x();
  for (int i = 0; i < 100; ++i) {
    sea.Step(kTick_s, i * kTick_s);
    const WaterMotion begin = sea.At(Vector3d::Zero(), i * kTick_s);
    ASSERT_NEAR(begin.v_W.x(), speed_mps, 1e-12) << i;
    speed_mps += kTick_s * begin.a_W.x();
  }
}

}  // namespace
}  // namespace turbidock::vehicle
