#pragma once
// Whether anything of the marker can be seen in an image, before the whole of it is made and
// searched.
//
// It spares the simulation work and takes no part in seeing: the estimator is told at most that
// there is nothing in a frame, never where anything is. A real vehicle has no such thing.

#include "sim/base/camera.h"
#include "sim/base/image.h"
#include "sim/base/pose.h"
#include "sim/base/published.h"
#include "vision/fitness.h"
#include "vision/hue_labels.h"
#include "vision/marker_model.h"

namespace turbidock::trial {

class FirstLook {
 public:
  // F of the true pose below which there is nothing to be found: the publication's Area III, "not
  // detected". Our detection begins at almost twice as much.
  static constexpr double kLeastFitness = published::kDetectedFitness;

  FirstLook(const vision::MarkerParams& marker, const vision::HueParams& hue, const StereoRig& rig);

  // A rectangle in each image with all pixels that F of a marker at X_HM reads.
  StereoRegion RegionOf(const Pose& X_HM) const;
  // F of that pose, with colours judged by these pixels alone.
  double Fitness(const StereoImage& images, const Pose& X_HM);

 private:
  vision::MarkerParams marker_;
  StereoRig rig_;
  vision::HueLabeller labeller_;
  Stereo<Image1u8> labels_;
  vision::Fitness fitness_;  // refers to the label images
};

}  // namespace turbidock::trial
