#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "sim/vehicle/sea.h"

namespace turbidock::vehicle {
namespace {

using Eigen::Vector3d;

Rng Stream(uint64_t seed) { return SeedTree(seed).Stream("sea"); }

double LargestSpeed(const SeaParams& params, double depth_m) {
  const Sea sea(params, Stream(1));
  double largest = 0;
  for (int i = 0; i < 1000; ++i)
    largest = std::max(largest, sea.At({0, 0, -depth_m}, 0.003 * i).v_W.head<2>().norm());
  return largest;
}

// u = (w H / 2) exp(-k depth): 0.047, 0.080, 0.153 m/s, given to three digits.
TEST(Waves, ReachThePublishedSpeedsAtDepth) {
  EXPECT_NEAR(LargestSpeed({.state = SeaState::kCalm}, 0.5), 0.047, 0.0005);
  EXPECT_NEAR(LargestSpeed({.state = SeaState::kModerate}, 0.7), 0.080, 0.0005);
  EXPECT_NEAR(LargestSpeed({.state = SeaState::kRough}, 0.7), 0.153, 0.0005);
}

// Central differences at 1 mm and 1 ms of functions whose scales are metres and seconds.
TEST(Waves, AreAnIncompressibleIrrotationalFlowWithItsAcceleration) {
  SeaParams params;
  params.waves = {{.height_m = 0.2, .period_s = 3, .direction_rad = 0.7}};
  params.jonswap = {.significant_height_m = 0.3, .peak_period_s = 4, .direction_rad = -2};
  const Sea sea(params, Stream(3));
  constexpr double kStep = 1e-3, kTol = 2e-6;
  Rng places = SeedTree(4).Stream("places");
  for (int i = 0; i < 50; ++i) {
    const Vector3d p(places.Uniform(-5, 5), places.Uniform(-5, 5), places.Uniform(-3, -0.01));
    const double t = places.Uniform(0, 100);
    Eigen::Matrix3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = kStep * Vector3d::Unit(axis);
      gradient.col(axis) = (sea.At(p + step, t).v_W - sea.At(p - step, t).v_W) / (2 * kStep);
    }
    EXPECT_NEAR(gradient.trace(), 0, kTol);
    EXPECT_LT((gradient - gradient.transpose()).norm(), kTol);
    EXPECT_GT(gradient.norm(), 100 * kTol);
    const Vector3d rate = (sea.At(p, t + kStep).v_W - sea.At(p, t - kStep).v_W) / (2 * kStep);
    EXPECT_LT((rate - sea.At(p, t).a_W).norm(), kTol);
    // The surface moves with the water.
    const Vector3d surface(p.x(), p.y(), 0);
    EXPECT_NEAR((sea.Elevation(p, t + kStep) - sea.Elevation(p, t - kStep)) / (2 * kStep),
                sea.At(surface, t).v_W.z(), kTol);
  }
}

TEST(Waves, TravelInTheirDirectionAtTheDeepWaterSpeed) {
  SeaParams params;
  params.random_phases = false;
  params.waves = {{.height_m = 0.2, .period_s = 3, .direction_rad = 0.5}};
  const Sea sea(params, Stream(1));
  const double speed_mps = 9.81 * 3 / (2 * std::numbers::pi);
  const Vector3d ahead = 2 * speed_mps * Vector3d(std::cos(0.5), std::sin(0.5), 0);
  EXPECT_NEAR(sea.Elevation(ahead, 2), 0.1, 1e-12) << "the crest of t = 0";
}

TEST(Jonswap, HasItsSignificantHeightAndSpectrum) {
  SeaParams params;
  params.jonswap = {
      .significant_height_m = 0.4, .peak_period_s = 3, .gamma = 3.3, .components = 500};
  const Sea sea(params, Stream(5));
  // Goertzel-free periodogram: correlate an hour's record with a few frequencies.
  constexpr int kCount = 36000;
  constexpr double kStep_s = 0.1;
  double sum = 0, squares = 0;
  std::vector<double> record;
  for (int i = 0; i < kCount; ++i) {
    record.push_back(sea.Elevation({0, 0, 0}, i * kStep_s));
    sum += record.back();
    squares += record.back() * record.back();
  }
  // Over an hour the cross terms of neighbouring components average out to below a per cent.
  EXPECT_NEAR(4 * std::sqrt(squares / kCount), 0.4, 0.004);
  EXPECT_NEAR(sum / kCount, 0, 1e-3);

  const auto energy_between = [&](double low_hz, double high_hz) {
    double energy = 0;
    const double record_s = kCount * kStep_s;
    for (double n = std::ceil(low_hz * record_s); n < high_hz * record_s; n += 1) {
      const double omega = 2 * std::numbers::pi * n / record_s;
      double c = 0, s = 0;
      for (int i = 0; i < kCount; i += 4) {
        c += record[i] * std::cos(omega * i * kStep_s);
        s += record[i] * std::sin(omega * i * kStep_s);
      }
      energy += 2 * (c * c + s * s) / (kCount / 4) / (kCount / 4);
    }
    return energy;
  };
  // The shares of the energy by band, by quadrature of the spectrum as published (Hasselmann et al.
  // 1973).
  const auto share_between = [](double low, double high) {
    constexpr double kLow = 0.6, kHigh = 3;  // where the sea has waves, in peak frequencies
    double all = 0, within = 0;
    for (double x = kLow; x < kHigh; x += 1e-4) {
      const double sigma = x <= 1 ? 0.07 : 0.09;
      const double energy = std::pow(x, -5) * std::exp(-1.25 / std::pow(x, 4)) *
                            std::pow(3.3, std::exp(-std::pow((x - 1) / sigma, 2) / 2));
      all += energy;
      if (x >= low && x < high) within += energy;
    }
    return within / all;
  };
  const double edges[] = {0.6, 0.85, 0.95, 1, 1.08, 1.2, 1.6, 3};
  for (size_t i = 0; i + 1 < std::size(edges); ++i)
    // a band's edge falls within one of 500 waves' bands, of up to 1 % of the energy
    EXPECT_NEAR(energy_between(edges[i] / 3, edges[i + 1] / 3) / (0.4 * 0.4 / 16),
                share_between(edges[i], edges[i + 1]), 0.006)
        << edges[i];
}

TEST(Gusts, HaveTheirSpreadAndCorrelationAtAnyStep) {
  SeaParams params;
  params.current.gust_std_mps = 0.05;
  params.current.gust_time_constant_s = 2;
  for (const double dt_s : {0.1, 0.5}) {
    Sea sea(params, Stream(11));
    const int lag = static_cast<int>(std::lround(2 / dt_s)), count = 400000;
    std::vector<double> x;
    for (int i = 0; i < count; ++i) {
      sea.Step(dt_s);
      x.push_back(sea.At({0, 0, -1}, 0).v_W.x());
    }
    double variance = 0, lagged = 0;
    for (int i = 0; i + lag < count; ++i) {
      variance += x[i] * x[i];
      lagged += x[i] * x[i + lag];
    }
    // About count * dt / (2 tau) = 10^4 independent values: 1 % standard error, 4 sigma.
    EXPECT_NEAR(variance / (count - lag), 0.0025, 0.04 * 0.0025 * std::sqrt(2)) << dt_s;
    EXPECT_NEAR(lagged / variance, std::exp(-1), 0.04) << dt_s;
  }
}

// Integrated over the ticks, the acceleration gives back the velocity.
TEST(Gusts, AccelerationIsTheChangeOverTheTick) {
  SeaParams params;
  params.current.gust_std_mps = 0.05;
  Sea sea(params, Stream(12));
  sea.Step(0.01);
  Vector3d v = sea.At({0, 0, -1}, 0).v_W;
  for (int i = 0; i < 100; ++i) {
    v += 0.01 * sea.At({0, 0, -1}, 0).a_W;
    sea.Step(0.01);
    EXPECT_LT((sea.At({0, 0, -1}, 0).v_W - v).norm(), 1e-12);
  }
  EXPECT_GT(v.norm(), 1e-3);
  EXPECT_EQ(v.z(), 0);
}

}  // namespace
}  // namespace turbidock::vehicle
