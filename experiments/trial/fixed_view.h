#pragma once
// A vehicle at rest in front of the marker: what its cameras have before them is drawn once, lit
// once for each sort of water, and exposed anew every frame.

#include <cstdint>
#include <vector>

#include "experiments/trial/scenario.h"
#include "sim/base/image.h"
#include "sim/base/pose.h"
#include "sim/camera/image_sensor.h"
#include "sim/camera/lens.h"
#include "sim/light/marine_snow.h"
#include "sim/light/radiance.h"
#include "sim/light/surfaces.h"
#include "sim/light/water.h"
#include "sim/view/rendered.h"

namespace turbidock::trial {

// What is seen, without any light. Needs no OpenGL once it is made, so it can be handed to workers.
struct FixedView {
  Pose X_HM;  // the marker in the camera head
  StereoRig rig;
  light::SurfaceTable surfaces;
  std::vector<Pose> X_HE;  // the lamps in the camera head
  view::RenderedStereo rendered;
};

// The scenario's scene with the marker at each of these poses in the camera head. ConfigError for a
// model that cannot be loaded, SimulatorFault when nothing can be drawn.
std::vector<FixedView> DrawFixedViews(const Scenario& scenario, const std::vector<Pose>& X_HM);

// The cameras of a vehicle at rest: the scenario's water, lamps, ball lights, snow, lenses and
// sensor.
class FixedCameras {
 public:
  // Noise and snow are drawn from `seeds`. Automatic exposure has settled. `view` must live as
  // long.
  FixedCameras(const FixedView& view, const Scenario& scenario, const SeedTree& seeds);

  // Without snow.
  const light::RadianceStereo& radiance() const { return radiance_; }
  void Expose(int64_t frame, StereoImage* out) { sensor_.Expose(LightAt(frame), frame, out); }
  // A region of the images; other pixels stay as they are, in images of the cameras' size.
  void Expose(int64_t frame, const StereoRegion& region, StereoImage* out) {
    sensor_.Expose(LightAt(frame), region, frame, out);
  }

 private:
  const light::RadianceStereo& LightAt(int64_t frame);

  const view::RenderedStereo* rendered_;
  light::Water water_;
  light::MarineSnow snow_;
  camera::StereoLens lens_;
  camera::ImageSensor sensor_;
  light::RadianceStereo radiance_, snowed_;
};

}  // namespace turbidock::trial
