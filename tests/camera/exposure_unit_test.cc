// Automatic exposure: what it holds, how it gets there, what it meters.

#include "sim/camera/exposure.h"

#include <gtest/gtest.h>

#include <cmath>

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

TEST(AutoExposure, HoldsTheMeanOrStaysAtItsLimit) {
  AutoExposure exposure(Automatic(), 1 / 30.0);
  EXPECT_TRUE(exposure.on());
  EXPECT_DOUBLE_EQ(exposure.GainFor(0.1), 0.02 * 0.5 / 0.1);  // the first has settled
  EXPECT_DOUBLE_EQ(AutoExposure(Automatic(), 1 / 30.0).GainFor(0.002), 4);
  EXPECT_DOUBLE_EQ(AutoExposure(Automatic(), 1 / 30.0).GainFor(0), 4);
}

TEST(AutoExposure, IsOffUnlessThereIsALevel) {
  SensorParams fixed = Automatic();
  fixed.auto_level = 0;
  AutoExposure exposure(fixed, 1 / 30.0);
  EXPECT_FALSE(exposure.on());
  EXPECT_EQ(exposure.GainFor(100), 4);
}

// After a step in brightness the logarithm of the gain is a first-order lag's, whatever the frame
// rate.
TEST(AutoExposure, FollowsWithItsTimeConstant) {
  for (const double frame_s : {0.01, 0.05, 0.25}) {
    SensorParams sensor = Automatic();
    sensor.auto_time_s = 0.5;
    AutoExposure exposure(sensor, frame_s);
    const double before = exposure.GainFor(0.1);
    double after = before;
    for (double t_s = frame_s; t_s <= 1.0 + 1e-9; t_s += frame_s) after = exposure.GainFor(0.2);
    EXPECT_NEAR(std::log(after / before), -std::log(2) * (1 - std::exp(-1.0 / 0.5)), 1e-9)
        << frame_s;
  }
  SensorParams at_once = Automatic();
  at_once.auto_time_s = 0;
  AutoExposure exposure(at_once, 0.03);
  exposure.GainFor(0.1);
  EXPECT_DOUBLE_EQ(exposure.GainFor(0.2), 0.02 * 0.5 / 0.2);
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
    double sum = 0;
    size_t count = 0;
    for (const Image3f* image : {&radiance.left, &radiance.right}) {
      for (size_t i = 0; i < 3 * image->pixels(); ++i) sum += static_cast<double>(image->data()[i]);
      count += 3 * image->pixels();
    }
    const double mean = sum / static_cast<double>(count);
    EXPECT_NEAR(water.MeanRadiance(seen) / mean, 1, 0.01) << milk_ml_m3;

    SensorParams sensor = Automatic();
    sensor.gain = 1000;
    sensor.auto_level = 0.1;
    sensor.read_noise_dn = 0;
    sensor.transfer = TransferCurve::kPower;
    sensor.power = 1;
    StereoCamera camera(std::move(water), ImageSensor(sensor, 1, 2), AutoExposure(sensor, 0.03));
    EXPECT_EQ(camera.Seen({{0, 0, 8, 8}, {0, 0, 8, 8}}).left.width(), 640);
    StereoImage image;
    camera.Expose(seen, 0, &image);
    double dn = 0;
    for (const Image3u8* view : {&image.left, &image.right})
      for (size_t i = 0; i < 3 * view->pixels(); ++i) dn += view->data()[i];
    // a little is lost where balls clip
    EXPECT_NEAR(dn / static_cast<double>(count), 25.5, 1.5) << milk_ml_m3;
  }
}

}  // namespace
}  // namespace turbidock::camera
