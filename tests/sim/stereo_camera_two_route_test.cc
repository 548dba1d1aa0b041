// Rows in bands and vectors against the same written plainly.
#include "sim/stereo_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/base/random.h"
#include "sim/vector_math.h"
#include "tests/sim/optics_scene.h"

namespace turbidock::sim {
namespace {

using testing::Cast;
using testing::LampsAt;
using testing::MarkerAndPlate;

// A sensor, value by value: in double with the exact curve, or in single precision with what the
// fast one is made of.
struct PlainSensor {
  SensorParams params;
  uint64_t key;

  float Normal(int64_t frame, int u, int v, int channel) const {
    const auto row = PhiloxBlock(key, static_cast<uint64_t>(frame), static_cast<uint64_t>(v));
    return NormalFromBits(Mix(static_cast<uint32_t>(3 * u + channel), row[0], row[1]));
  }
  double Exact(float radiance, float normal) const {
    const double linear =
        std::clamp(radiance * params.gain / params.full_scale_radiance_w_m2_sr, 0.0, 1.25);
    double variance = params.read_noise_dn * params.read_noise_dn;
    if (params.shot_noise && linear > 0) {
      const double d = 1e-5 * linear;
      const double slope =
          255 * (Encode(params, linear + d) - Encode(params, linear - d)) / (2 * d);
      variance += slope * slope * linear * params.gain / params.full_well_electrons;
    }
    return std::clamp(255 * Encode(params, linear) + std::sqrt(variance) * double{normal}, 0.0,
                      255.0);
  }
};

// Radiances over six decades, both signs.
Image3f AnyRadiance(int width, int height) {
  Rng rng = SeedTree(5).Stream("radiance");
  Image3f image(width, height);
  for (size_t i = 0; i < image.pixels() * 3; ++i)
    image.data()[i] = static_cast<float>(i % 50 == 0 ? -0.01 : std::pow(10, rng.Uniform(-6, 0)));
  return image;
}

TEST(ImageSensor, AgreesWithThePlainOne) {
  constexpr int kFrame = 12, kWidth = 101, kHeight = 60;
  const Image3f radiance = AnyRadiance(kWidth, kHeight);
  const RadianceStereo stereo{0, radiance, radiance};
  for (const TransferCurve transfer : {TransferCurve::kSrgb, TransferCurve::kPower})
    for (const double read_dn : {0.0, 1.5})
      for (const bool shot : {false, true}) {
        SensorParams params;
        params.transfer = transfer;
        params.read_noise_dn = read_dn;
        params.shot_noise = shot;
        params.full_well_electrons = 3000;
        StereoImage image;
        ImageSensor(params, 3, 4).Expose(stereo, kFrame, &image);
        const PlainSensor plain{params, 4};
        double worst = 0;
        int compared = 0;
        for (int v = 0; v < kHeight; ++v)
          for (int u = 0; u < kWidth; ++u)
            for (int k = 0; k < 3; ++k) {
              const double expected =
                  plain.Exact(radiance.at(u, v)[k], plain.Normal(kFrame, u, v, k));
              worst = std::max(worst, std::abs(image.right.at(u, v)[k] - expected));
              ++compared;
            }
        EXPECT_EQ(compared, 101 * 60 * 3);
        // rounding, and the curve's error
        EXPECT_LE(worst, 0.5 + 0.03) << shot << read_dn;
        EXPECT_GT(worst, 0.49);
      }
}

// The vectorised rows give the very values of scalar arithmetic: the instruction set does not show.
TEST(ImageSensor, IsTheSameWithoutVectors) {
  constexpr int kFrame = 3, kWidth = 333, kHeight = 20;
  const Image3f radiance = AnyRadiance(kWidth, kHeight);
  const SensorParams params;
  const ImageSensor sensor(params, 3, 4);
  StereoImage image;
  sensor.Expose({0, radiance, radiance}, kFrame, &image);
  const PlainSensor plain{params, 3};
  int different = 0;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u)
      for (int k = 0; k < 3; ++k) {
        float value = sensor.SignalDn(radiance.at(u, v)[k]) + 0.5f;
        value += static_cast<float>(params.read_noise_dn) * plain.Normal(kFrame, u, v, k);
        different += static_cast<int>(std::clamp(value, 0.0f, 255.0f)) != image.left.at(u, v)[k];
      }
  EXPECT_EQ(different, 0);
}

TEST(StereoCamera, IsWaterThenSensor) {
  for (const int height_px : {120, 70}) {  // 70: the last band is not whole
    RigParams rig_params;
    rig_params.width_px = 150;
    rig_params.height_px = height_px;
    const StereoRig rig = rig_params.MakeRig();
    for (const double milk : {0.0, 30.0}) {
      const auto surfaces = MarkerAndPlate(Pose::Translation(0.6, 0.02, 0));
      OpticsParams params;
      params.water.milk_ml_m3 = milk;
      params.lamps.enabled = true;
      Water water(params, rig, SurfaceTable(surfaces), LampsAt(0.16));
      const ImageSensor sensor({}, 1, 2);
      StereoCamera camera(water, sensor);
      const RenderedStereo rendered = Cast(surfaces, rig);
      RadianceStereo radiance;
      StereoImage expected, image;
      for (int frame = 4; frame < 6; ++frame) {
        water.Apply(rendered, &radiance);
        sensor.Expose(radiance, frame, &expected);
        camera.Expose(rendered, frame, &image);
        EXPECT_EQ(image.frame, frame);
        EXPECT_EQ(image.left, expected.left);
        EXPECT_EQ(image.right, expected.right);
      }
      EXPECT_NE(image.left, image.right);
    }
  }
}

}  // namespace
}  // namespace turbidock::sim
