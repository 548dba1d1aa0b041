// Rows in bands and vectors against the same written plainly.
#include "sim/camera/stereo_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/base/random.h"
#include "tests/light/optics_scene.h"
#include "tests/support/transfer_curve.h"

namespace turbidock::camera {
namespace {

using testing::Cast;
using testing::LampsAt;
using testing::MarkerAndPlate;

// A sensor, value by value: in double with the exact curve, or in single precision with what the
// fast one is made of.
struct PlainSensor {
  SensorParams params;
  uint64_t key;
  int width;

  float Normal(int64_t frame, int u, int v, int channel) const {
    const auto row = PhiloxBlock(key, static_cast<uint64_t>(frame), static_cast<uint64_t>(v));
    return noise.Of(row[0])[channel * width + u];
  }
  RowNoise noise{3 * width};
  double Exact(float radiance, float normal) const {
    const double electrons =
        std::max(params.full_well_electrons * radiance / params.full_scale_radiance_w_m2_sr, 0.0);
    const double noise_electrons =
        std::sqrt(std::pow(params.read_noise_electrons, 2) + (params.shot_noise ? electrons : 0));
    const double linear =
        params.gain * (electrons + noise_electrons * double{normal}) / params.full_well_electrons;
    return std::clamp(255 * testing::Encode(params, std::min(linear, params.white_clip)), 0.0,
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
  const light::RadianceStereo stereo{radiance, radiance};
  for (const TransferCurve transfer :
       {TransferCurve::kSrgb, TransferCurve::kNtsc, TransferCurve::kPower, TransferCurve::kLinear})
    for (const double read_electrons : {0.0, 20.0})
      for (const bool shot : {false, true}) {
        SensorParams params;
        params.transfer = transfer;
        params.read_noise_electrons = read_electrons;
        params.gain = 2;
        params.shot_noise = shot;
        params.full_well_electrons = 3000;
        StereoImage image;
        ImageSensor(params, 3, 4).Digitise(stereo, kFrame, &image);
        const PlainSensor plain{params, 4, kWidth};
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
        EXPECT_LE(worst, 0.5 + 0.03) << NameOf(transfer) << shot << read_electrons;
        EXPECT_GT(worst, 0.49);
      }
}

// Runs of dark values take a shorter way, which a bright one among them forbids: their digits are
// the same, also where noise lifts them over the end of the curve's straight part.
TEST(ImageSensor, IsTheSameWhereAllIsDark) {
  constexpr int kWidth = 640, kHeight = 60;
  for (const TransferCurve transfer : {TransferCurve::kSrgb, TransferCurve::kNtsc})
    for (const bool shot : {false, true})
      for (const double share : {0.0, 0.3, 0.9}) {
        SensorParams params;
        params.transfer = transfer;
        params.shot_noise = shot;
        params.read_noise_electrons = 8;
        const double toe_end = transfer == TransferCurve::kSrgb ? 0.0031308 : 0.018;
        const Image3f dark(
            kWidth, kHeight,
            static_cast<float>(share * toe_end * params.full_scale_radiance_w_m2_sr));
        Image3f spotted = dark;
        for (int v = 0; v < kHeight; ++v)
          for (int u = 0; u < kWidth; u += 32) *spotted.at(u, v) = 1;
        StereoImage expected, image;
        const ImageSensor sensor(params, 3, 4);
        sensor.Digitise({spotted, spotted}, 5, &expected);
        sensor.Digitise({dark, dark}, 5, &image);
        int different = 0;
        for (int v = 0; v < kHeight; ++v)
          for (int u = 0; u < kWidth; ++u)
            for (int k = 0; k < 3; ++k)
              if (u % 32 != 0) different += image.left.at(u, v)[k] != expected.left.at(u, v)[k];
        EXPECT_EQ(different, 0) << NameOf(transfer) << shot << share;
      }
}

// The vectorised rows give the very values of scalar arithmetic: the instruction set does not show.
TEST(ImageSensor, IsTheSameWithoutVectors) {
  constexpr int kFrame = 3, kWidth = 333, kHeight = 20;
  const Image3f radiance = AnyRadiance(kWidth, kHeight);
  SensorParams params;
  params.transfer = TransferCurve::kLinear;
  const ImageSensor sensor(params, 3, 4);
  StereoImage image;
  sensor.Digitise({radiance, radiance}, kFrame, &image);
  const PlainSensor plain{params, 3, kWidth};
  int different = 0;
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u)
      for (int k = 0; k < 3; ++k) {
        const auto noise = static_cast<float>(params.gain / params.full_well_electrons *
                                              params.read_noise_electrons);
        const float linear = sensor.SignalDn(radiance.at(u, v)[k]) / 255;
        const float value = 255 * (linear + noise * plain.Normal(kFrame, u, v, k)) + 0.5f;
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
      light::OpticsParams params;
      params.water.milk_ml_m3 = milk;
      params.lamps.enabled = true;
      light::Water water(params, rig, light::SurfaceTable(surfaces), LampsAt(0.16));
      const ImageSensor sensor({}, 1, 2);
      StereoCamera camera(water, sensor);
      const view::RenderedStereo rendered = Cast(surfaces, rig);
      light::RadianceStereo radiance;
      StereoImage expected, image;
      for (int frame = 4; frame < 6; ++frame) {
        water.Apply(rendered, &radiance);
        sensor.Digitise(radiance, frame, &expected);
        camera.Expose(rendered, frame, &image);
        EXPECT_EQ(image.frame, frame);
        EXPECT_EQ(image.left, expected.left);
        EXPECT_EQ(image.right, expected.right);
      }
      EXPECT_NE(image.left, image.right);
    }
  }
}

// Particles of a held view too, and beyond the region as far as colour is blurred into it.
TEST(StereoCamera, ExposesARegionOfAHeldViewAsInTheWhole) {
  const StereoRig rig = testing::SmallRig();
  const auto surfaces = MarkerAndPlate(Pose::Translation(0.5, 0.02, 0));
  light::OpticsParams params;
  params.lamps.enabled = true;
  const SensorParams sensor{.chroma_blur_px = 2};
  const light::SnowParams snow{.particles_per_m3 = 10000, .diameter_m = 0.005};
  StereoCamera camera(light::Water(params, rig, light::SurfaceTable(surfaces), LampsAt(0.16)),
                      ImageSensor(sensor, 1, 2), {}, light::MarineSnow(snow, 1.0 / 30, 3));
  const view::RenderedStereo rendered = Cast(surfaces, rig);
  camera.Hold(rendered);
  StereoImage whole, part;
  camera.ExposeHeld(7, &whole);
  const PixelRegion region{rig.left.width_px / 4, rig.left.height_px / 4, rig.left.width_px / 2,
                           rig.left.height_px / 2};
  camera.ExposeHeld({region, region}, 7, &part);
  for (const Side side : kSides)
    for (int v = region.row_begin; v < region.row_end; ++v)
      for (int u = region.column_begin; u < region.column_end; ++u)
        for (int k = 0; k < 3; ++k)
          ASSERT_EQ(part[side].at(u, v)[k], whole[side].at(u, v)[k]) << u << " " << v;
}

// A region's pixels are those of the whole image, whatever is seen beyond what it needs.
TEST(StereoCamera, ExposesARegionAsInTheWhole) {
  const StereoRig rig = testing::SmallRig();
  const int width = rig.left.width_px, height = rig.left.height_px;
  const auto surfaces = MarkerAndPlate(Pose::Translation(0.5, 0.02, 0));
  const view::RenderedStereo rendered = Cast(surfaces, rig);
  Rng rng = SeedTree(6).Stream("regions");
  StereoImage plain;
  struct Case {
    bool active, imperfect, dirty, snowy;
  };
  // each unlike the one before it
  for (const auto& [active, imperfect, dirty, snowy] :
       {Case{true, false, false, false}, Case{true, false, true, false},
        Case{true, false, false, true}, Case{false, false, false, false},
        Case{false, false, false, true}, Case{false, true, false, true}}) {
    light::OpticsParams params;
    params.water.milk_ml_m3 = 40;
    params.ball_lights.enabled = active;
    params.lamps.enabled = !active;
    SensorParams sensor;
    sensor.chroma_blur_px = active ? 0 : 3;
    light::SnowParams snow;
    LensParams lens;
    if (imperfect) {
      sensor.auto_level = 0.05;
      sensor.auto_time_s = 0;  // the gain does not remember
      lens.k1 = -0.1;
    }
    if (snowy) {
      snow.particles_per_m3 = 10000;
      snow.diameter_m = 0.005;
    }
    constexpr double kFrame_s = 1.0 / 30;
    StereoCamera camera(light::Water(params, rig, light::SurfaceTable(surfaces), LampsAt(0.16)),
                        ImageSensor(sensor, 1, 2), AutoExposure(sensor, kFrame_s),
                        light::MarineSnow(snow, kFrame_s, 3), StereoLens(lens, rig));
    if (dirty) {
      DirtFault dirt;
      dirt.radius = 0.2;
      camera.SetPortFaults({{dirt}, {BlurFault{}}});
    }
    StereoImage whole;
    camera.Expose(rendered, 7, &whole);
    EXPECT_NE(whole.left, plain.left);
    plain = whole;
    int64_t inside = 0;
    for (int i = 0; i < 60; ++i) {
      const auto any = [&] {
        PixelRegion r;
        r.column_begin = static_cast<int>(rng.Below(static_cast<uint32_t>(width)));
        r.row_begin = static_cast<int>(rng.Below(static_cast<uint32_t>(height)));
        r.column_end =
            r.column_begin +
            static_cast<int>(rng.Below(static_cast<uint32_t>(width - r.column_begin + 1)));
        r.row_end = r.row_begin +
                    static_cast<int>(rng.Below(static_cast<uint32_t>(height - r.row_begin + 1)));
        return r;
      };
      const StereoRegion region = {any(), any()}, seen = camera.Seen(region, 7);
      view::RenderedStereo partly = rendered;
      const auto spoil = [&](const PixelRegion& keep, view::RenderedView* view) {
        for (int v = 0; v < height; ++v)
          for (int u = 0; u < width; ++u)
            if (!keep.Contains(u, v)) {
              *view->surface.at(u, v) = static_cast<uint16_t>(rng.Below(6));
              *view->depth_m.at(u, v) = static_cast<float>(rng.Uniform(0.1, 1));
            }
      };
      spoil(seen.left, &partly.left);
      spoil(seen.right, &partly.right);
      constexpr uint8_t kBefore = 77;
      StereoImage image{{Image3u8(width, height, kBefore), Image3u8(width, height, kBefore)}};
      camera.Expose(partly, region, 7, &image);
      const auto compare = [&](const PixelRegion& r, const Image3u8& got,
                               const Image3u8& expected) {
        int wrong = 0;
        for (int v = 0; v < height; ++v)
          for (int u = 0; u < width; ++u)
            for (int k = 0; k < 3; ++k) {
              wrong += got.at(u, v)[k] != (r.Contains(u, v) ? expected.at(u, v)[k] : kBefore);
              inside += r.Contains(u, v);
            }
        EXPECT_EQ(wrong, 0) << i;
      };
      compare(region.left, image.left, whole.left);
      compare(region.right, image.right, whole.right);
    }
    EXPECT_GT(inside, 100000);
  }
}

}  // namespace
}  // namespace turbidock::camera
