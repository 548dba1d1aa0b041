#include "sim/vehicle/attitude_sensor.h"

#include <gtest/gtest.h>

#include <cmath>

namespace turbidock::vehicle {
namespace {

Rng Stream(uint64_t seed) { return SeedTree(seed).Stream("attitude"); }

TEST(AttitudeSensor, ReadsRollAndPitchWhateverTheHeading) {
  AttitudeSensor sensor({.bias_std_rad = 0, .noise_std_rad = 0, .rate_noise_std_rad_s = 0},
                        Stream(1));
  for (const double yaw : {-3.0, 0.0, 1.2})
    for (const double pitch : {-1.3, -0.2, 0.4})
      for (const double roll : {-2.0, 0.1, 0.7}) {
        const Attitude attitude = sensor.Read({FromYawPitchRoll(yaw, pitch, roll), {1, 2, -3}},
                                              {.w = {0.1, -0.2, 0.7}, .v = {1, 1, 1}});
        EXPECT_NEAR(attitude.roll_pitch_rad[0], roll, 1e-12);
        EXPECT_NEAR(attitude.roll_pitch_rad[1], pitch, 1e-12);
        EXPECT_EQ(attitude.rate_rad_s, Eigen::Vector2d(0.1, -0.2));
      }
}

// 4000 readings: a mean within 5 standard errors, a standard deviation within 6 %.
TEST(AttitudeSensor, ErrsByAConstantAndByNoise) {
  const AttitudeSensorParams params{
      .bias_std_rad = 0.1, .noise_std_rad = 0.01, .rate_noise_std_rad_s = 0.02};
  const auto mean_and_std = [&](uint64_t seed) {
    AttitudeSensor sensor(params, Stream(seed));
    Eigen::Vector4d sum = Eigen::Vector4d::Zero(), squares = Eigen::Vector4d::Zero();
    for (int i = 0; i < 4000; ++i) {
      const Attitude a = sensor.Read({}, {});
      const Eigen::Vector4d x(a.roll_pitch_rad[0], a.roll_pitch_rad[1], a.rate_rad_s[0],
                              a.rate_rad_s[1]);
      sum += x;
      squares += x.cwiseAbs2();
    }
    const Eigen::Vector4d mean = sum / 4000;
    return std::pair(mean, Eigen::Vector4d((squares / 4000 - mean.cwiseAbs2()).cwiseSqrt()));
  };
  Eigen::Vector2d biases = Eigen::Vector2d::Zero();
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const auto [mean, deviation] = mean_and_std(seed);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(deviation[i] / (i < 2 ? 0.01 : 0.02), 1, 0.06);
    EXPECT_NEAR(mean.tail<2>().norm(), 0, 5 * 0.02 / std::sqrt(4000) * std::sqrt(2));
    biases += mean.head<2>().cwiseAbs2();
  }
  EXPECT_NEAR(std::sqrt(biases.sum() / 40), 0.1, 0.04);
}

}  // namespace
}  // namespace turbidock::vehicle
