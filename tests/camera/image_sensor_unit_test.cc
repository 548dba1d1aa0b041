// The camera's transfer curve, clipping and noise.
#include "sim/camera/image_sensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sim/base/check.h"
#include "sim/base/random.h"
#include "tests/support/transfer_curve.h"

namespace turbidock::camera {
namespace {

constexpr int kWidth = 320, kHeight = 240;

light::RadianceStereo Flat(float radiance) {
  light::RadianceStereo r;
  r.left = Image3f(kWidth, kHeight, radiance);
  r.right = Image3f(kWidth, kHeight, radiance);
  return r;
}

SensorParams Quiet() {
  SensorParams params;
  params.read_noise_electrons = 0;
  return params;
}

struct Statistics {
  double mean = 0, sigma = 0;
};

Statistics Of(const Image3u8& image) {
  double sum = 0, squares = 0;
  const size_t n = image.pixels() * 3;
  for (size_t i = 0; i < n; ++i) {
    sum += image.data()[i];
    squares += std::pow(image.data()[i], 2);
  }
  return {sum / n, std::sqrt(squares / n - sum * sum / n / n)};
}

// Correlation of two equally long series of values around their means.
template <class A, class B>
double Correlation(size_t n, A a, B b) {
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (size_t i = 0; i < n; ++i) {
    const double x = a(i), y = b(i);
    sa += x, sb += y, saa += x * x, sbb += y * y, sab += x * y;
  }
  return (sab - sa * sb / n) / std::sqrt((saa - sa * sa / n) * (sbb - sb * sb / n));
}

// Noise of so many DN at gain 1.
SensorParams LinearNoise(double read_dn) {
  SensorParams params;
  params.transfer = TransferCurve::kLinear;
  params.read_noise_electrons = read_dn / 255 * params.full_well_electrons;
  return params;
}

// What is encoded as 128 DN.
float MidRadiance(const SensorParams& params) {
  return static_cast<float>(testing::Decode(params, 128 / 255.0) *
                            params.full_scale_radiance_w_m2_sr / params.gain);
}

TEST(SensorParams, DefaultsAreValidAndBadOnesNameTheKey) {
  EXPECT_NO_THROW(ImageSensor(SensorParams{}, 1, 2));
  SensorParams bad;
  bad.read_noise_electrons = -1;
  try {
    ImageSensor(bad, 1, 2);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.key(), "cameras.sensor.read_noise_electrons");
  }
}

TEST(ImageSensor, EncodesWithinATenthOfADn) {
  for (const TransferCurve curve : {TransferCurve::kLinear, TransferCurve::kSrgb,
                                    TransferCurve::kNtsc, TransferCurve::kPower}) {
    SensorParams params = Quiet();
    params.transfer = curve;
    params.gain = 0.5;
    const ImageSensor sensor(params, 1, 2);
    // one value a column, all over the scale
    light::RadianceStereo r = Flat(0);
    for (int u = 0; u < kWidth; ++u)
      for (int k = 0; k < 3; ++k)
        r.left.at(u, 0)[k] = static_cast<float>((u + 0.3) / kWidth / params.gain *
                                                params.full_scale_radiance_w_m2_sr);
    StereoImage image;
    sensor.Digitise(r, 5, &image);
    EXPECT_EQ(image.frame, 5);
    for (int u = 0; u < kWidth; ++u) {
      const double expected = 255 * testing::Encode(params, (u + 0.3) / kWidth);
      EXPECT_NEAR(*image.left.at(u, 0), expected, 0.5 + 0.1) << u;
      if (u > 0) {
        EXPECT_GE(*image.left.at(u, 0), *image.left.at(u - 1, 0));
      }
    }
    EXPECT_EQ(*image.left.at(kWidth - 1, 1), 0);
  }
}

// SMPTE 170M: V = 4.5 L below 0.018, 1.099 L^0.45 - 0.099 above, which meet within 2e-4.
TEST(ImageSensor, NtscCurveIsThatOfItsStandard) {
  SensorParams params;
  params.transfer = TransferCurve::kNtsc;
  const ImageSensor sensor(params, 1, 2);
  const auto encoded = [&](double linear) {
    return sensor.SignalDn(static_cast<float>(linear * params.full_scale_radiance_w_m2_sr)) / 255;
  };
  EXPECT_NEAR(encoded(0.01), 0.045, 1e-6);
  EXPECT_NEAR(encoded(0.017999), encoded(0.018001), 3e-4);
  EXPECT_NEAR(encoded(0.18), 0.409, 5e-4);  // a grey card
  EXPECT_NEAR(encoded(1), 1, 1e-4);
}

TEST(ImageSensor, ClipsAtBothEnds) {
  SensorParams params;
  params.read_noise_electrons = 3 / 255.0 / 12.92 * params.full_well_electrons;  // 3 DN in the dark
  const ImageSensor sensor(params, 1, 2);
  StereoImage image;
  // well above full scale noise cannot be seen; what is no light at all is dark
  sensor.Digitise(Flat(static_cast<float>(2 * params.full_scale_radiance_w_m2_sr)), 0, &image);
  EXPECT_EQ(Of(image.left).mean, 255);
  sensor.Digitise(Flat(std::numeric_limits<float>::infinity()), 0, &image);
  EXPECT_EQ(Of(image.left).mean, 255);
  for (const float dark : {0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN()}) {
    sensor.Digitise(Flat(dark), 0, &image);
    // half the normal distribution: mean of max(0, n) is sigma / sqrt(2 pi), give or take the
    // rounding
    EXPECT_NEAR(Of(image.left).mean, 3 / std::sqrt(2 * M_PI), 0.05) << dark;
  }
}

// 230400 samples: the mean of 3 DN noise is known to 0.0062 (one sigma), its deviation to 0.0044.
// Rounding to whole DN adds 1/12 to the variance. Five sigma and the curve's 0.03 DN are allowed.
TEST(ImageSensor, NoiseHasTheStatedMeanAndDeviation) {
  SensorParams params = LinearNoise(1.5);
  params.gain = 2;  // which the noise stands before
  const ImageSensor sensor(params, 3, 4);
  StereoImage image;
  sensor.Digitise(Flat(MidRadiance(params)), 9, &image);
  for (const Image3u8* view : {&image.left, &image.right}) {
    const Statistics s = Of(*view);
    EXPECT_NEAR(s.mean, 128, 0.061);
    EXPECT_NEAR(s.sigma, std::sqrt(3 * 3 + 1 / 12.0), 0.022);
  }
}

TEST(ImageSensor, ShotNoiseFollowsTheLight) {
  SensorParams params = Quiet();
  params.shot_noise = true;
  params.full_well_electrons = 1000;
  params.transfer = TransferCurve::kLinear;
  const ImageSensor sensor(params, 3, 4);
  StereoImage image;
  for (const double linear : {0.2, 0.8}) {
    sensor.Digitise(Flat(static_cast<float>(linear * params.full_scale_radiance_w_m2_sr)), 1,
                    &image);
    const double expected_dn = 255 * std::sqrt(linear / 1000);  // Poisson
    EXPECT_NEAR(Of(image.left).sigma, std::hypot(expected_dn, std::sqrt(1 / 12.0)),
                0.01 * expected_dn);
  }
  // the same picture with twice the gain and half the light is noisier by sqrt(2)
  params.gain = 2;
  const ImageSensor amplified(params, 3, 4);
  amplified.Digitise(Flat(static_cast<float>(0.25 * params.full_scale_radiance_w_m2_sr)), 1,
                     &image);
  EXPECT_NEAR(Of(image.left).sigma, 255 * std::sqrt(0.5 / 500), 0.1);
}

// Light, noise and all of a channel are multiplied by its white balance.
TEST(ImageSensor, WhiteBalanceAmplifiesLightAndNoise) {
  SensorParams params = LinearNoise(1.5);
  params.white_balance = {2, 1, 0.5};
  const ImageSensor sensor(params, 3, 4);
  StereoImage image;
  sensor.Digitise(Flat(static_cast<float>(0.25 * params.full_scale_radiance_w_m2_sr)), 9, &image);
  for (int k = 0; k < 3; ++k) {
    double sum = 0, squares = 0;
    const auto n = static_cast<double>(image.left.pixels());
    for (size_t i = 0; i < image.left.pixels(); ++i) {
      const double dn = image.left.data()[3 * i + static_cast<size_t>(k)];
      sum += dn, squares += dn * dn;
    }
    const double mean = sum / n, factor = params.white_balance[k];
    EXPECT_NEAR(mean, 255 * 0.25 * factor, 0.06) << k;
    const double sigma = std::sqrt(squares / n - mean * mean);
    EXPECT_NEAR(sigma, std::hypot(1.5 * factor, std::sqrt(1 / 12.0)), 0.03) << k;
  }
}

// Whatever the sensor was told before.
TEST(ImageSensor, AmplifiesAsToldLast) {
  SensorParams params = LinearNoise(1.5);
  params.white_balance = {2, 1, 0.5};
  ImageSensor sensor(params, 3, 4);
  StereoImage before, after, expected;
  const light::RadianceStereo light = Flat(0.3f * MidRadiance(params));
  sensor.Digitise(light, 9, &before);
  sensor.Amplify({1.5, {0.8, 1, 1.4}});
  sensor.Digitise(light, 9, &after);
  params.gain = 1.5;
  params.white_balance = {0.8, 1, 1.4};
  ImageSensor(params, 3, 4).Digitise(light, 9, &expected);
  EXPECT_EQ(after.left, expected.left);
  EXPECT_NE(after.left, before.left);
}

// The amplifier's clip is seen where black stands above zero: white is this much above black.
TEST(ImageSensor, ClipsWhiteBeforeColorIsBlurred) {
  SensorParams params = Quiet();
  params.transfer = TransferCurve::kLinear;
  params.chroma_blur_px = 2;
  params.white_clip = 1;
  StereoImage image;
  light::RadianceStereo red = Flat(0);
  for (size_t i = 0; i < red.left.pixels(); ++i)
    red.left.data()[3 * i] = static_cast<float>(3 * params.full_scale_radiance_w_m2_sr);
  const auto green_of = [&](double clip) {
    params.white_clip = clip;
    ImageSensor(params, 1, 2).Digitise(red, 0, &image);
    return image.left.at(kWidth / 2, 5)[1];
  };
  EXPECT_EQ(green_of(1), 19);  // what red brings into brightness is taken out of green again
  light::RadianceStereo grey = Flat(static_cast<float>(0.9 * params.full_scale_radiance_w_m2_sr));
  for (size_t i = 0; i < grey.left.pixels(); ++i)
    if (i % kWidth < kWidth / 2)
      grey.left.data()[3 * i] = static_cast<float>(3 * params.full_scale_radiance_w_m2_sr);
  const auto blue_beside = [&](double clip) {
    params.white_clip = clip;
    ImageSensor(params, 1, 2).Digitise(grey, 0, &image);
    return image.left.at(kWidth / 2 + 1, 5)[2];
  };
  // the more red is left, the more of it leaks over the edge, and blue is less there
  EXPECT_LT(blue_beside(2.5), blue_beside(1) - 20);
}

// The correlation of n independent pairs is 0 with deviation 1 / sqrt(n) = 0.0021; five of these.
TEST(ImageSensor, NoiseIsIndependentEverywhere) {
  constexpr double kBound = 0.0105;
  const SensorParams params = LinearNoise(1.5);
  const ImageSensor sensor(params, 3, 4);
  StereoImage now, next;
  sensor.Digitise(Flat(MidRadiance(params)), 7, &now);
  sensor.Digitise(Flat(MidRadiance(params)), 8, &next);
  const uint8_t* left = now.left.data();
  const size_t n = now.left.pixels() * 3, row = 3 * kWidth;
  const auto correlation = [&](const uint8_t* a, const uint8_t* b, size_t count) {
    return Correlation(
        count, [a](size_t i) { return a[i]; }, [b](size_t i) { return b[i]; });
  };
  EXPECT_NEAR(correlation(left, left, n), 1, 1e-12);  // the measure works
  EXPECT_LT(std::abs(correlation(left, now.right.data(), n)), kBound);
  EXPECT_LT(std::abs(correlation(left, next.left.data(), n)), kBound);
  for (const size_t distance : {size_t{1}, size_t{2}, size_t{3}, size_t{4}, row, row + 3})
    EXPECT_LT(std::abs(correlation(left, left + distance, n - distance)), kBound) << distance;
  // squares too: noise whose strength is correlated would pass the tests above
  const auto square = [](const uint8_t* p) {
    return [p](size_t i) { return (p[i] - 128.0) * (p[i] - 128.0); };
  };
  EXPECT_LT(std::abs(Correlation(n, square(left), square(now.right.data()))), kBound);
  EXPECT_LT(std::abs(Correlation(n - 1, square(left), square(left + 1))), kBound);
}

TEST(ImageSensor, NoiseDependsOnKeyFrameAndPlaceOnly) {
  const SensorParams params;
  const ImageSensor sensor(params, 3, 4), swapped(params, 4, 3);
  StereoImage a, b, c;
  sensor.Digitise(Flat(MidRadiance(params)), 7, &a);
  sensor.Digitise(Flat(0), 8, &b);  // something in between
  sensor.Digitise(Flat(MidRadiance(params)), 7, &b);
  swapped.Digitise(Flat(MidRadiance(params)), 7, &c);
  EXPECT_EQ(a.left, b.left);
  EXPECT_EQ(a.right, b.right);
  EXPECT_EQ(a.left, c.right);
  EXPECT_NE(a.left, c.left);
}

}  // namespace
}  // namespace turbidock::camera
