// What composite video does to colour, and white balance.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sim/base/random.h"
#include "sim/camera/image_sensor.h"

namespace turbidock::camera {
namespace {

constexpr int kWidth = 160, kHeight = 40;

SensorParams Linear(double chroma_blur_px, double read_noise_dn) {
  SensorParams sensor;
  sensor.full_scale_radiance_w_m2_sr = 1;
  sensor.transfer = TransferCurve::kLinear;
  sensor.chroma_blur_px = chroma_blur_px;
  sensor.read_noise_electrons = read_noise_dn / 255 * sensor.full_well_electrons;
  return sensor;
}

// Left half one colour, right half another.
light::RadianceStereo Halves(const Eigen::Array3f& left, const Eigen::Array3f& right) {
  Image3f image(kWidth, kHeight);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u)
      for (int k = 0; k < 3; ++k) image.at(u, v)[k] = (u < kWidth / 2 ? left : right)[k];
  return {image, image};
}

StereoImage Expose(const SensorParams& sensor, const light::RadianceStereo& radiance) {
  StereoImage image;
  ImageSensor(sensor, 1, 2).Digitise(radiance, 7, &image);
  return image;
}

double Luma(const uint8_t* rgb) { return 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2]; }

constexpr int kSetup_dn = CompositeVideo::kSetup_dn;

struct Color {
  double luma = 0, red = 0, blue = 0;  // brightness, and what red and blue have more

  double chroma() const { return std::hypot(red, blue); }
};
Color ColorOf(const uint8_t* rgb) {
  const double luma = Luma(rgb);
  return {luma, rgb[0] - luma, rgb[2] - luma};
}

TEST(ChromaBlur, LeavesGreyEdgesAlone) {
  const light::RadianceStereo grey = Halves({0.2f, 0.2f, 0.2f}, {0.7f, 0.7f, 0.7f});
  Image3u8 expected = Expose(Linear(0, 0), grey).left;
  for (size_t i = 0; i < 3 * expected.pixels(); ++i) expected.data()[i] += kSetup_dn;
  EXPECT_EQ(Expose(Linear(4, 0), grey).left, expected);
}

// The noise of darkness is whole: nothing of it is cut off at zero.
TEST(ChromaBlur, KeepsTheNoiseOfDarkness) {
  const Image3u8 dark = Expose(Linear(2, 4), Halves({0, 0, 0}, {0, 0, 0})).left;
  double sum = 0, squares = 0;
  for (size_t i = 0; i < dark.pixels(); ++i) {
    const double luma = Luma(dark.data() + 3 * i) - kSetup_dn;
    sum += luma, squares += luma * luma;
  }
  const auto n = static_cast<double>(dark.pixels());
  EXPECT_NEAR(sum / n, 0, 0.15);
  // of three equally noisy channels by their shares
  const double sigma_dn = 4 * std::sqrt(0.299 * 0.299 + 0.587 * 0.587 + 0.114 * 0.114);
  EXPECT_NEAR(std::sqrt(squares / n), sigma_dn, 0.15);
}

// Across an edge colour differences are the Gaussian's integral; brightness is as sharp as it was.
TEST(ChromaBlur, SmearsColorButNotBrightness) {
  const double sigma_px = 3;
  const Eigen::Array3f left(0.6f, 0.4f, 0.3f), right(0.3f, 0.5f, 0.6f);
  const Image3u8 sharp = Expose(Linear(0, 0), Halves(left, right)).left;
  const Image3u8 image = Expose(Linear(sigma_px, 0), Halves(left, right)).left;
  const auto red_difference = [](const Eigen::Array3f& c) {
    return 255 * (c[0] - (0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2]));
  };
  int compared = 0;
  for (int u = 20; u < kWidth - 20; ++u) {
    const uint8_t* rgb = image.at(u, 5);
    EXPECT_NEAR(Luma(rgb), Luma(sharp.at(u, 5)) + kSetup_dn, 1) << u;
    const double past_edge = (u + 0.5 - kWidth / 2) / sigma_px;
    const double share = 0.5 * (1 + std::erf(past_edge / std::numbers::sqrt2));
    const double expected = red_difference(left) * (1 - share) + red_difference(right) * share;
    EXPECT_NEAR(rgb[0] - Luma(rgb), expected, 1.5) << u;
    ++compared;
  }
  EXPECT_EQ(compared, 120);
}

// Sampling by pairs and drawing lines between them is part of the blur. Mean of edges between pairs
// and within one.
TEST(ChromaBlur, IsAsWideAsAsked) {
  for (const double sigma_px : {1.1, 1.5, 1.85, 3.0}) {
    double variance_px2 = 0;
    for (const int edge : {kWidth / 2, kWidth / 2 + 1}) {
      light::RadianceStereo radiance = Halves({0.7f, 0.2f, 0.2f}, {0.2f, 0.45f, 0.45f});
      for (int v = 0; v < kHeight; ++v)
        for (int u = kWidth / 2; u < edge; ++u)
          std::copy_n(radiance.left.at(0, v), 3, radiance.left.at(u, v));
      const Image3u8 image = Expose(Linear(sigma_px, 0), radiance).left;
      const auto red = [&](int u) { return ColorOf(image.at(u, 5)).red; };
      const double step_dn = red(0) - red(kWidth - 1);
      for (int u = edge - 16; u < edge + 16; ++u)
        variance_px2 += 0.5 * std::pow(u - edge, 2) * (red(u - 1) - red(u)) / step_dn;
    }
    EXPECT_NEAR(variance_px2, sigma_px * sigma_px, 0.3) << sigma_px;
  }
}

// White noise through a Gaussian keeps 1 / (2 sqrt(pi) sigma) of its variance.
TEST(ChromaBlur, SmoothsNoiseOfColorOnly) {
  const double sigma_px = 2, noise_dn = 6;
  const light::RadianceStereo grey = Halves({0.5f, 0.5f, 0.5f}, {0.5f, 0.5f, 0.5f});
  const auto deviations = [&](double blur_px) {
    const double mean_dn = 127.5 + (blur_px > 0 ? kSetup_dn : 0);
    const Image3u8 image = Expose(Linear(blur_px, noise_dn), grey).left;
    double luma = 0, red = 0;
    for (size_t i = 0; i < image.pixels(); ++i) {
      const uint8_t* rgb = image.data() + 3 * i;
      luma += std::pow(Luma(rgb) - mean_dn, 2);
      red += std::pow(rgb[0] - Luma(rgb), 2);
    }
    const auto n = static_cast<double>(image.pixels());
    return std::pair{std::sqrt(luma / n), std::sqrt(red / n)};
  };
  const auto [sharp_luma, sharp_red] = deviations(0);
  const auto [luma, red] = deviations(sigma_px);
  EXPECT_NEAR(luma / sharp_luma, 1, 0.03);
  EXPECT_NEAR(red / sharp_red, std::sqrt(1 / (2 * std::sqrt(std::numbers::pi) * sigma_px)), 0.02);
}

TEST(ChromaBlur, IsTheSameInARegion) {
  Image3f radiance(kWidth, kHeight);
  Rng rng = SeedTree(3).Stream("radiance");
  for (size_t i = 0; i < 3 * radiance.pixels(); ++i)
    radiance.data()[i] = static_cast<float>(rng.Uniform());
  const ImageSensor sensor(Linear(4, 2), 1, 2);
  const int margin_px = sensor.margin_px();
  StereoImage whole;
  sensor.Digitise({radiance, radiance}, 1, &whole);
  int compared = 0;
  for (const PixelRegion& region : {PixelRegion{0, 3, 9, 20}, PixelRegion{50, 0, 51, 7},
                                    PixelRegion{51, 0, 52, 7}, PixelRegion{140, 30, kWidth, 40}}) {
    StereoImage part;
    Image3f beside(kWidth, kHeight, std::nanf(""));  // what may not be looked at
    for (int v = region.row_begin; v < region.row_end; ++v)
      for (int u = std::max(0, region.column_begin - margin_px);
           u < std::min(kWidth, region.column_end + margin_px); ++u)
        std::copy_n(radiance.at(u, v), 3, beside.at(u, v));
    sensor.Digitise({beside, beside}, {region, {}}, 1, &part);
    for (int v = region.row_begin; v < region.row_end; ++v)
      for (int u = region.column_begin; u < region.column_end; ++u)
        for (int k = 0; k < 3; ++k, ++compared)
          ASSERT_EQ(part.left.at(u, v)[k], whole.left.at(u, v)[k]);
  }
  EXPECT_EQ(compared, 3 * (9 * 17 + 7 + 7 + 20 * 10));
}

// Half the pixels along the same line: half the blur in pixels.
TEST(ChromaBlur, IsAShareOfTheLine) {
  const light::RadianceStereo light = Halves({0.6f, 0.4f, 0.3f}, {0.3f, 0.5f, 0.6f});
  StereoImage half, expected;
  ImageSensor(Linear(6, 0), 1, 2, 320).Digitise(light, 0, &half);
  ImageSensor(Linear(3, 0), 1, 2).Digitise(light, 0, &expected);
  EXPECT_EQ(half.left, expected.left);
}

// Colour becomes shorter by so much, in its own direction; what is weaker is grey. Brightness
// stays.
TEST(ChromaCoring, TakesItsLengthFromColor) {
  for (const double coring_dn : {5.0, 20.0, 60.0}) {
    SensorParams sensor = Linear(0, 0);
    sensor.chroma_coring_dn = coring_dn;
    int grey = 0;
    for (const Eigen::Array3f& rgb :
         {Eigen::Array3f(0.6f, 0.4f, 0.3f), Eigen::Array3f(0.3f, 0.35f, 0.4f),
          Eigen::Array3f(0.2f, 0.6f, 0.2f), Eigen::Array3f(0.5f, 0.48f, 0.5f)}) {
      const Color before = ColorOf(Expose(Linear(0, 0), Halves(rgb, rgb)).left.at(3, 3));
      const Color after = ColorOf(Expose(sensor, Halves(rgb, rgb)).left.at(3, 3));
      const double keep = std::max(0.0, 1 - coring_dn / before.chroma());
      EXPECT_NEAR(after.luma, before.luma + kSetup_dn, 1);
      EXPECT_NEAR(after.red, keep * before.red, 1.2);
      EXPECT_NEAR(after.blue, keep * before.blue, 1.2);
      grey += keep == 0;
    }
    EXPECT_EQ(grey, coring_dn == 5 ? 1 : coring_dn == 20 ? 2 : 3) << coring_dn;
  }
}

// By how near the largest channel is to full scale.
TEST(Highlights, FadeToWhite) {
  SensorParams sensor = Linear(0, 0);
  sensor.highlight_fade = 0.25;
  const struct {
    float peak;
    double keep;
  } cases[] = {{0.5f, 1}, {0.75f, 1}, {0.8f, 0.8}, {0.85f, 0.6}, {0.95f, 0.2}, {1, 0}, {1.05f, 0}};
  for (const auto& [peak, keep] : cases) {
    // dim in the other channels, so that nothing is above 255 with black where it is
    const Eigen::Array3f rgb(peak, 0.1f, 0.1f);
    const double luma = 255 * (0.299 * static_cast<double>(peak) + 0.701 * 0.1);
    const double red = keep * (255 * static_cast<double>(peak) - luma) + luma + kSetup_dn;
    const StereoImage image = Expose(sensor, Halves(rgb, rgb));
    const uint8_t* seen = image.left.at(3, 3);
    EXPECT_NEAR(seen[0], std::min(red, 255.0), 1) << peak;
    EXPECT_NEAR(seen[1], luma + kSetup_dn + keep * (25.5 - luma), 1) << peak;
  }
  // whichever channel of whichever pixel of a pair it is
  for (int bright = 0; bright < 6; ++bright) {
    Image3f pair(kWidth, kHeight);
    for (size_t i = 0; i < pair.pixels(); ++i)
      std::copy_n(std::array{0.6f, 0.2f, 0.2f}.data(), 3, pair.data() + 3 * i);
    for (int u = 0; u < kWidth; ++u)
      if (u % 2 == bright % 2) pair.at(u, 3)[bright / 2] = 1;
    const Color seen = ColorOf(Expose(sensor, {pair, pair}).left.at(40, 3));
    EXPECT_LT(seen.chroma(), 2) << bright;
  }
}

// The line's noise is the same in light and dark, and another in each row, frame and camera. That
// of brightness is white; that of colour has one value every other pixel, with lines between them.
TEST(VideoNoise, ComesAfterTheCamera) {
  SensorParams sensor = Linear(3, 0);
  sensor.video_noise_dn = 4;
  const auto light = Halves({0.1f, 0.1f, 0.1f}, {0.6f, 0.4f, 0.3f});
  const StereoImage image = Expose(sensor, light), clean = Expose(Linear(3, 0), light);
  const auto noise = [&](Side side, int u, int v) {
    const Color a = ColorOf(image[side].at(u, v)), b = ColorOf(clean[side].at(u, v));
    return Eigen::Array3d(a.luma - b.luma, a.red - b.red, a.blue - b.blue);
  };
  // of luma, red and blue, at pixels so far apart
  const auto covariance = [&](Side other, int begin, int end, int columns, int rows) {
    Eigen::Array3d sum = Eigen::Array3d::Zero();
    for (int v = 0; v < kHeight - rows; ++v)
      for (int u = begin; u < end - columns; ++u)
        sum += noise(Side::kLeft, u, v) * noise(other, u + columns, v + rows);
    return Eigen::Array3d(sum / ((kHeight - rows) * (end - begin - columns)));
  };
  const auto expect = [](const Eigen::Array3d& seen, double luma, double color) {
    EXPECT_NEAR(seen[0], luma, 1);
    EXPECT_NEAR(seen[1], color, 1);
    EXPECT_NEAR(seen[2], color, 1);
  };
  // a pixel has 3/4 of its own pair's noise and 1/4 of its neighbour's
  const double own = 16 * (9 + 1) / 16.0;
  expect(covariance(Side::kLeft, 0, kWidth / 2, 0, 0), 16, own);
  expect(covariance(Side::kLeft, kWidth / 2, kWidth, 0, 0), 16, own);
  expect(covariance(Side::kLeft, 0, kWidth, 1, 0), 0, 16 * (9 + 6) / 32.0);
  expect(covariance(Side::kLeft, 0, kWidth, 2, 0), 0, 16 * 3 / 16.0);
  expect(covariance(Side::kLeft, 0, kWidth, 4, 0), 0, 0);
  expect(covariance(Side::kLeft, 0, kWidth, 0, 1), 0, 0);
  expect(covariance(Side::kRight, 0, kWidth, 0, 0), 0, 0);
  double red_with_blue = 0;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u)
      red_with_blue += noise(Side::kLeft, u, v)[1] * noise(Side::kLeft, u, v)[2];
  EXPECT_NEAR(red_with_blue / (kWidth * kHeight), 0, 1);
}

TEST(CompositeVideo, IsTheSameInARegionWithAllOfIt) {
  SensorParams sensor = Linear(2, 3);
  sensor.chroma_coring_dn = 10;
  sensor.highlight_fade = 0.2;
  sensor.video_noise_dn = 3;
  Image3f radiance(kWidth, kHeight);
  Rng rng = SeedTree(3).Stream("radiance");
  for (size_t i = 0; i < 3 * radiance.pixels(); ++i)
    radiance.data()[i] = static_cast<float>(rng.Uniform());
  const ImageSensor camera(sensor, 1, 2);
  StereoImage whole, part;
  camera.Digitise({radiance, radiance}, 1, &whole);
  const PixelRegion region{50, 10, 90, 20};
  camera.Digitise({radiance, radiance}, {region, {}}, 1, &part);
  for (int v = region.row_begin; v < region.row_end; ++v)
    for (int u = region.column_begin; u < region.column_end; ++u)
      for (int k = 0; k < 3; ++k) ASSERT_EQ(part.left.at(u, v)[k], whole.left.at(u, v)[k]);
}

TEST(WhiteBalance, IsAFactorOnTheLight) {
  const light::RadianceStereo light = Halves({0.1f, 0.2f, 0.3f}, {0.3f, 0.2f, 0.1f});
  const light::RadianceStereo balanced = Halves({0.2f, 0.2f, 0.15f}, {0.6f, 0.2f, 0.05f});
  SensorParams sensor = Linear(0, 0);
  const StereoImage expected = Expose(sensor, balanced);
  sensor.white_balance = {2, 1, 0.5};
  EXPECT_EQ(Expose(sensor, light).left, expected.left);
  EXPECT_EQ(Expose(sensor, light).right, expected.right);
}

}  // namespace
}  // namespace turbidock::camera
