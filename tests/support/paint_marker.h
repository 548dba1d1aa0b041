#pragma once
// Synthetic stereo images of a marker: anti-aliased discs in plain colours, painted without any of
// the estimator's code.

#include "sim/base/camera.h"
#include "sim/base/image.h"
#include "sim/base/pose.h"
#include "sim/base/random.h"
#include "vision/marker_model.h"

namespace turbidock::testing {

struct PaintOptions {
  double value_dn = 200;     // brightest channel of a ball
  double saturation = 0.85;  // of a ball's colour
  double background_dn = 8;  // grey
  double noise_dn = 0;       // standard deviation, each channel
};

// RGB, 0..255, of a hue (HSV).
Eigen::Vector3d RgbOfHue(double hue_rad, double saturation, double value_dn);

// Both views of a marker at X_HM, nearer balls over farther ones. `rng` is drawn from for noise
// only.
StereoImage PaintMarker(const vision::MarkerParams& marker, const StereoRig& rig, const Pose& X_HM,
                        const PaintOptions& options, Rng* rng);

}  // namespace turbidock::testing
