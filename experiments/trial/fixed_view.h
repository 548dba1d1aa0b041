#pragma once
// A vehicle at rest in front of the marker: what its cameras have before them is drawn once, lit
// once for each sort of water, and exposed anew every frame.

#include <vector>

#include "experiments/trial/scenario.h"
#include "sim/base/pose.h"
#include "sim/base/random.h"
#include "sim/camera/stereo_camera.h"
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

// The scenario's water about such a view: the same for all views of its scene.
light::Water WaterOf(const FixedView& view, const Scenario& scenario);

// The scenario's cameras in front of such a view, which they hold: ExposeHeld gives its images.
// Noise and snow are drawn from `seeds`. `view` must live as long.
camera::StereoCamera HoldView(const FixedView& view, light::Water water, const Scenario& scenario,
                              const SeedTree& seeds);
camera::StereoCamera HoldView(const FixedView& view, const Scenario& scenario,
                              const SeedTree& seeds);

}  // namespace turbidock::trial
