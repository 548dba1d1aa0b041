// Whether the estimator makes as much of our images as of a path tracer's of the same scene.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/camera/image_sensor.h"
#include "sim/light/water.h"
#include "tests/light/optics_scene.h"
#include "tests/support/path_traced.h"
#include "vision/fitness.h"
#include "vision/hue_labels.h"

namespace turbidock::camera {
namespace {

// Optics, camera and gain as in tests/data/pathtraced/README.md.
StereoImage Ours(const testing::PathTracedPair& pair) {
  const bool active = pair.name.starts_with("active");
  const StereoRig rig = RigParams{}.MakeRig();
  const auto surfaces = testing::MarkerAndPlate(pair.true_X_HM);
  light::OpticsParams optics;
  optics.water.milk_ml_m3 = pair.milk_ml_m3;
  optics.water.milk_scattering_m2_ml = {0.0182, 0.0204, 0.0224};
  optics.water.milk_asymmetry.setConstant(0.71);
  optics.ball_lights.enabled = active;
  optics.ball_lights.rim_radiance_w_m2_sr = 0.6;
  optics.ball_lights.core_radiance_w_m2_sr = 0;
  optics.lamps.enabled = !active;
  optics.lamps.beam = light::BeamShape::kCone;
  optics.lamps.intensity_w_sr = {1, 1, 1};
  light::RadianceStereo radiance;
  light::Water(optics, rig, light::SurfaceTable(surfaces), testing::LampsAt(0.16))
      .Apply(testing::Cast(surfaces, rig), &radiance);

  SensorParams sensor;
  sensor.full_scale_radiance_w_m2_sr = 1;
  if (!active) {  // the 99.5th percentile of the brightest channel is 0.7
    std::vector<float> brightest;
    for (const Image3f* image : {&radiance.left, &radiance.right})
      for (size_t i = 0; i < image->pixels(); ++i)
        brightest.push_back(*std::max_element(image->data() + 3 * i, image->data() + 3 * i + 3));
    const auto nth = brightest.begin() + std::lround(0.995 * brightest.size());
    std::nth_element(brightest.begin(), nth, brightest.end());
    sensor.full_scale_radiance_w_m2_sr = static_cast<double>(*nth) / 0.7;
  }
  StereoImage seen;
  ImageSensor(sensor, 1, 2).Digitise(radiance, 0, &seen);
  return seen;
}

double FitnessAt(const Pose& X_HM, const StereoImage& seen) {
  const vision::MarkerParams marker;
  vision::HueLabeller labeller(vision::HueParams{}, marker);
  Stereo<Image1u8> labels;
  for (const Side side : kSides) labeller.Label(seen[side], &labels[side]);
  return vision::Fitness(marker, RigParams{}.MakeRig(), labels).Evaluate(X_HM);
}

TEST(PathTraced, FitnessAtTheTruePoseIsTheSame) {
  double most = 0;
  int pairs = 0;
  for (const testing::PathTracedPair& pair : testing::PathTracedPairs()) {
    const double here = FitnessAt(pair.true_X_HM, Ours(pair));
    const double there = FitnessAt(pair.true_X_HM, pair.seen);
    EXPECT_NEAR(here, there, 0.1) << pair.name;
    RecordProperty(pair.name, std::to_string(here) + " " + std::to_string(there));
    most = std::max(most, std::abs(here - there));
    ++pairs;
  }
  EXPECT_EQ(pairs, 8);
  EXPECT_GT(most, 1e-4) << "the same images?";
}

}  // namespace
}  // namespace turbidock::camera
