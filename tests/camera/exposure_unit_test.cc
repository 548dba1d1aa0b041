// Automatic exposure: what it holds, how it gets there, what it meters.

#include "sim/camera/exposure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sim/camera/stereo_camera.h"
#include "tests/light/optics_scene.h"

namespace turbidock::camera {
namespace {

SensorParams Automatic() {
  SensorParams sensor;
  sensor.gain = 4;
  sensor.auto_level = 0.02;
  sensor.full_scale_radiance_w_m2_sr = 0.5;
  return sensor;
}

using Places = std::vector<Eigen::Array3f>;

double GainOf(AutoExposure* exposure, const Places& places) { return exposure->For(places).gain; }

double GreyGain(AutoExposure* exposure, double radiance) {
  return GainOf(exposure, {Eigen::Array3f::Constant(static_cast<float>(radiance))});
}

TEST(AutoExposure, HoldsTheMeanOrStaysAtItsLimit) {
  AutoExposure exposure(Automatic(), 1 / 30.0);
  EXPECT_TRUE(exposure.on());
  EXPECT_NEAR(GreyGain(&exposure, 0.1), 0.02 * 0.5 / 0.1, 1e-7);  // the first has settled
  for (const double dark : {0.002, 0.0}) {
    AutoExposure at_its_limit(Automatic(), 1 / 30.0);
    EXPECT_NEAR(GreyGain(&at_its_limit, dark), 4, 1e-12);
  }
}

// Of ten places one is far above full scale, as a lamp's reflection: it counts as full scale.
TEST(AutoExposure, MetersNoMoreThanFullScale) {
  SensorParams sensor = Automatic();
  sensor.auto_level = 0.2;
  Places places(9, Eigen::Array3f::Constant(0.1f));
  for (const float lamp : {10.0f, 1000.0f}) {
    places.push_back(Eigen::Array3f::Constant(lamp));
    AutoExposure exposure(sensor, 0.03);
    EXPECT_NEAR(GainOf(&exposure, places), (10 * 0.2 - 1) / 9 * 0.5 / 0.1, 1e-4) << lamp;
    places.pop_back();
  }
  // more of the images is above full scale than the level: as dark as it gets
  AutoExposure dazzled(sensor, 0.03);
  EXPECT_NEAR(GainOf(&dazzled, Places(10, Eigen::Array3f::Constant(1000))), 0.2 * 0.5 / 1000, 1e-9);
}

TEST(AutoExposure, IsOffUnlessThereIsALevel) {
  SensorParams fixed = Automatic();
  fixed.auto_level = 0;
  AutoExposure exposure(fixed, 1 / 30.0);
  EXPECT_FALSE(exposure.on());
  EXPECT_EQ(GreyGain(&exposure, 100), 4);
}

// Red and blue come to green's mean, or as near as the limit allows; the gain then holds the mean
// of what is balanced.
TEST(AutoExposure, MakesTheMeanGreyWithinItsLimit) {
  SensorParams sensor = Automatic();
  sensor.auto_white_balance_limit = 2;
  const Amplification grey = AutoExposure(sensor, 0.03).For(Places{{0.2f, 0.1f, 0.08f}});
  EXPECT_NEAR(grey.white_balance[0], 0.5, 1e-6);
  EXPECT_NEAR(grey.white_balance[1], 1, 1e-12);
  EXPECT_NEAR(grey.white_balance[2], 1.25, 1e-6);
  EXPECT_NEAR(grey.gain, 0.02 * 0.5 / 0.1, 1e-7);
  const Amplification bluish = AutoExposure(sensor, 0.03).For(Places{{0.01f, 0.1f, 0.4f}});
  EXPECT_NEAR(bluish.white_balance[0], 2, 1e-6);
  EXPECT_NEAR(bluish.white_balance[2], 0.5, 1e-12);
  // about what was set by hand; a channel without light is no reason to change it
  sensor.white_balance = {2, 1, 1};
  EXPECT_NEAR(AutoExposure(sensor, 0.03).For(Places{{0.05f, 0.1f, 0.1f}}).white_balance[0], 2,
              1e-12);
  EXPECT_NEAR(AutoExposure(sensor, 0.03).For(Places{{0, 0.1f, 0.1f}}).white_balance[0], 2, 1e-6);
  sensor.auto_level = 0;
  EXPECT_NEAR(AutoExposure(sensor, 0.03).For(Places{{0.2f, 0.1f, 0.08f}}).gain, 4, 1e-12);
}

// After a step in brightness the logarithm of the gain is a first-order lag's, whatever the frame
// rate.
TEST(AutoExposure, FollowsWithItsTimeConstant) {
  for (const double frame_s : {0.01, 0.05, 0.25}) {
    SensorParams sensor = Automatic();
    sensor.auto_time_s = 0.5;
    AutoExposure exposure(sensor, frame_s);
    const double before = GreyGain(&exposure, 0.1);
    double after = before;
    for (double t_s = frame_s; t_s <= 1.0 + 1e-9; t_s += frame_s) after = GreyGain(&exposure, 0.2);
    EXPECT_NEAR(std::log(after / before), -std::log(2) * (1 - std::exp(-1.0 / 0.5)), 1e-9)
        << frame_s;
  }
  SensorParams at_once = Automatic();
  at_once.auto_time_s = 0;
  AutoExposure exposure(at_once, 0.03);
  GreyGain(&exposure, 0.1);
  EXPECT_NEAR(GreyGain(&exposure, 0.2), 0.02 * 0.5 / 0.2, 1e-7);
}

light::OpticsParams LampLit(double milk_ml_m3) {
  light::OpticsParams optics;
  optics.ball_lights.enabled = false;
  optics.lamps.enabled = true;
  optics.water.milk_ml_m3 = milk_ml_m3;
  return optics;
}

// The lattice's mean is the images', and the camera's images have the level asked for.
TEST(AutoExposure, MetersBothViews) {
  const StereoRig rig = RigParams{}.MakeRig();
  const auto surfaces = testing::MarkerAndPlate(Pose::Translation(0.6, 0.02, 0.01));
  const view::RenderedStereo seen = testing::Cast(surfaces, rig);
  for (const double milk_ml_m3 : {0.0, 20.0, 100.0}) {
    light::Water water(LampLit(milk_ml_m3), rig, light::SurfaceTable(surfaces),
                       testing::LampsAt(0.16));
    light::RadianceStereo radiance;
    water.Apply(seen, &radiance);
    Eigen::Array3d sum = Eigen::Array3d::Zero();
    size_t count = 0;
    for (const Image3f* image : {&radiance.left, &radiance.right}) {
      for (size_t i = 0; i < image->pixels(); ++i)
        sum += Eigen::Map<const Eigen::Array3f>(image->data() + 3 * i).cast<double>();
      count += image->pixels();
    }
    Eigen::Array3d metered = Eigen::Array3d::Zero();
    const std::span<const Eigen::Array3f> places = water.MeteredRadiance(seen);
    for (const Eigen::Array3f& place : places) metered += place.cast<double>();
    const Eigen::Array3d ratio =
        metered / sum * static_cast<double>(count) / static_cast<double>(places.size());
    EXPECT_NEAR(ratio.minCoeff(), 1, 0.01) << milk_ml_m3;
    EXPECT_NEAR(ratio.maxCoeff(), 1, 0.01) << milk_ml_m3;

    SensorParams sensor = Automatic();
    sensor.gain = 1000;
    sensor.auto_level = 0.1;
    sensor.read_noise_electrons = 0;
    sensor.transfer = TransferCurve::kLinear;
    StereoCamera camera(std::move(water), ImageSensor(sensor, 1, 2), AutoExposure(sensor, 0.03));
    const auto needed_px = [&](int64_t frame) {
      return camera.Seen({{0, 0, 8, 8}, {0, 0, 8, 8}}, frame).left.width();
    };
    EXPECT_EQ(needed_px(1), 640);
    StereoImage image;
    camera.Expose(seen, 1, &image);
    for (const int64_t frame : {1, 2, 14}) EXPECT_LT(needed_px(frame), 64) << frame;
    for (const int64_t frame : {15, 16, 29}) EXPECT_EQ(needed_px(frame), 640) << frame;
    double dn = 0;
    for (const Image3u8* view : {&image.left, &image.right})
      for (size_t i = 0; i < 3 * view->pixels(); ++i) dn += view->data()[i];
    EXPECT_NEAR(dn / static_cast<double>(3 * count), 25.5, 0.7) << milk_ml_m3;
  }
}

}  // namespace
}  // namespace turbidock::camera
