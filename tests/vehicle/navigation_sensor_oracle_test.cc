// The errors of a navigation over many trials, against the closed forms of what they are made of.

#include "sim/vehicle/navigation_sensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace turbidock::vehicle {
namespace {

constexpr int kTrials = 3000;
// Five standard deviations of a variance estimated from as many.
const double kTolerance = 5 * std::sqrt(2.0 / kTrials);

// No error but the least noise that a key allows.
NavigationParams Exact() {
  return {.position_bias_std_m = 0,
          .position_walk_m = 0,
          .travel_error_std = 0,
          .position_noise_std_m = 0.001,
          .rate_hz = 1000,
          .dropout_share = 0,
          .depth_bias_std_m = 0,
          .depth_noise_std_m = 0.001,
          .heading_bias_std_rad = 0,
          .heading_walk_rad = 0,
          .heading_noise_std_rad = 0.0001};
}

NavigationSensor Sensor(const NavigationParams& params, int trial) {
  return {params, SeedTree(static_cast<uint64_t>(trial)).Stream("navigation")};
}

struct Errors {
  std::vector<double> x, y, z, heading;
};

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double MeanSquare(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return sum / static_cast<double>(values.size());
}

// Of every trial after `seconds`, a reading each second, on the way from the first to the last
// pose.
Errors After(int seconds, const NavigationParams& params, const Pose& first, const Pose& last) {
  Errors errors;
  for (int trial = 0; trial < kTrials; ++trial) {
    NavigationSensor sensor = Sensor(params, trial);
    for (int t = 0; t <= seconds; ++t) {
      Pose now = last;
      now.p = first.p + (last.p - first.p) * t / std::max(1, seconds);
      const auto reading = sensor.Read(t, now);
      if (t < seconds) continue;
      errors.x.push_back(reading->fix_xy_m->x() - now.p.x());
      errors.y.push_back(reading->fix_xy_m->y() - now.p.y());
      errors.z.push_back(reading->z_m - now.p.z());
      errors.heading.push_back(WrapAngle(reading->heading_rad - YawOf(now.q)));
    }
  }
  return errors;
}

TEST(NavigationSensor, BiasHasNoMeanAndItsOwnVariance) {
  NavigationParams params = Exact();
  params.position_bias_std_m = 0.3;
  params.depth_bias_std_m = 0.1;
  params.heading_bias_std_rad = 0.09;
  const Pose pose{FromYawPitchRoll(3.1, 0, 0), {-5, 0.5, 0.2}};  // headings wrap
  const Errors errors = After(0, params, pose, pose);
  const auto expect = [](const std::vector<double>& values, double std) {
    EXPECT_NEAR(Mean(values), 0, 5 * std / std::sqrt(kTrials));
    EXPECT_NEAR(MeanSquare(values) / (std * std), 1, kTolerance);
  };
  expect(errors.x, 0.3);
  expect(errors.y, 0.3);
  expect(errors.z, 0.1);
  expect(errors.heading, 0.09);
  // independent: x and y of a trial
  double product = 0;
  for (size_t i = 0; i < errors.x.size(); ++i) product += errors.x[i] * errors.y[i];
  EXPECT_NEAR(product / kTrials / 0.09, 0, 5 / std::sqrt(kTrials));
}

// b^2 + (d t)^2 + w^2 t + n^2
TEST(NavigationSensor, VariancesOfBiasDriftWalkAndNoiseAddUp) {
  NavigationParams params = Exact();
  params.position_bias_std_m = 0.1;
  params.position_drift_std_mps = 0.01;
  params.position_walk_m = 0.03;
  params.position_noise_std_m = 0.05;
  params.heading_walk_rad = 0.01;
  params.heading_noise_std_rad = 0.02;
  for (const int t : {0, 4, 25}) {
    const Errors errors = After(t, params, {}, {});
    const double variance = 0.01 + 1e-4 * t * t + 9e-4 * t + 0.0025;
    EXPECT_NEAR(MeanSquare(errors.x) / variance, 1, kTolerance) << t;
    EXPECT_NEAR(MeanSquare(errors.y) / variance, 1, kTolerance) << t;
    EXPECT_NEAR(MeanSquare(errors.heading) / (1e-4 * t + 4e-4), 1, kTolerance) << t;
  }
}

// The walk does not depend on how often it is asked for.
TEST(NavigationSensor, WalksAsFarInManyStepsAsInOne) {
  NavigationParams params = Exact();
  params.position_walk_m = 0.1;
  std::vector<double> one, many;
  for (int trial = 0; trial < kTrials; ++trial) {
    NavigationSensor rarely = Sensor(params, trial), often = Sensor(params, trial);
    rarely.Read(0, {});
    one.push_back(rarely.Read(4, {})->fix_xy_m->x());
    double last = 0;
    for (int i = 0; i <= 40; ++i) last = often.Read(0.1 * i, {})->fix_xy_m->x();
    many.push_back(last);
  }
  EXPECT_NEAR(MeanSquare(one) / 0.04, 1, kTolerance);
  EXPECT_NEAR(MeanSquare(many) / 0.04, 1, kTolerance);
}

TEST(NavigationSensor, WayIsWrongByAShareAlongAndAcross) {
  NavigationParams params = Exact();
  params.travel_error_std = 0.05;
  const Errors errors = After(10, params, {}, Pose::Translation(3, 4, 1));
  EXPECT_NEAR(MeanSquare(errors.x) / (0.25 * 0.25), 1, kTolerance);
  EXPECT_NEAR(MeanSquare(errors.y) / (0.25 * 0.25), 1, kTolerance);
  EXPECT_NEAR(Mean(errors.z), 0, 1e-3);
  // and back again, nothing is left of it
  NavigationSensor sensor = Sensor(params, 1);
  sensor.Read(0, {});
  EXPECT_GT(sensor.Read(1, Pose::Translation(3, 4, 0))->fix_xy_m->norm(), 4);
  EXPECT_LT(sensor.Read(2, {})->fix_xy_m->norm(), 0.01);
}

TEST(NavigationSensor, FixesComeAtTheirRateDepthAndHeadingAlways) {
  const auto fixes = [](double rate_hz) {
    NavigationParams params = Exact();
    params.rate_hz = rate_hz;
    NavigationSensor sensor = Sensor(params, 1);
    int count = 0;
    for (int frame = 0; frame < 300; ++frame) {
      const auto reading = sensor.Read(frame / 30.0, Pose::Translation(0, 0, 0.5));
      count += reading->fix_xy_m.has_value();
      EXPECT_NEAR(reading->z_m, 0.5, 0.01);
    }
    return count;
  };
  EXPECT_EQ(fixes(1), 10);
  EXPECT_EQ(fixes(10), 100);
  EXPECT_EQ(fixes(1000), 300);
}

// A fifth of the time, for two seconds on average.
TEST(NavigationSensor, DropsOutForItsShareOfTheTime) {
  NavigationParams params = Exact();
  params.dropout_share = 0.2;
  params.dropout_s = 2;
  NavigationSensor sensor = Sensor(params, 7);
  constexpr int kFrames = 600000;
  int missing = 0, dropouts = 0;
  bool was_missing = false;
  for (int frame = 0; frame < kFrames; ++frame) {
    const bool is_missing = !sensor.Read(frame / 30.0, {})->fix_xy_m;
    missing += is_missing;
    dropouts += is_missing && !was_missing;
    was_missing = is_missing;
  }
  // Some 2000 drop-outs: both figures are known to about 3 %.
  EXPECT_NEAR(static_cast<double>(missing) / kFrames, 0.2, 0.03);
  EXPECT_NEAR(missing / 30.0 / dropouts, 2, 0.3);
}

TEST(NavigationSensor, NeverSaysNothing) {
  NavigationSensor sensor = Sensor(NavigationParams::Of(NavigationPreset::kNever), 1);
  for (int t = 0; t < 10; ++t) EXPECT_FALSE(sensor.Read(t, {}));
}

TEST(NavigationSensor, DefaultsAreThePresetThatTheyName) {
  const NavigationParams defaults, preset = NavigationParams::Of(defaults.preset);
  std::vector<double> ours, theirs;
  const auto collect = [](std::vector<double>* into) {
    return [into](const char*, const auto& value, const Range&, const char*) {
      if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, double>)
        into->push_back(value);
    };
  };
  NavigationParams::Fields(defaults, collect(&ours));
  NavigationParams::Fields(preset, collect(&theirs));
  EXPECT_EQ(ours.size(), 13u);
  EXPECT_EQ(ours, theirs);
  for (const auto& [value, name] : EnumNames<NavigationPreset>::kNames) {
    EXPECT_EQ(NavigationParams::Of(value).preset, value);
    EXPECT_NO_THROW(CheckFields(NavigationParams::Of(value), name)) << name;
  }
}

}  // namespace
}  // namespace turbidock::vehicle
