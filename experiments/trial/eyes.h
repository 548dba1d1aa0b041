#pragma once
// The other side of a trial's loop: what the vehicle sees of the marker.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "experiments/trial/camera_schedule.h"
#include "experiments/trial/pose_source.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/world.h"
#include "sim/base/image.h"
#include "sim/base/pose_estimate.h"
#include "sim/base/random.h"
#include "sim/base/stage_timer.h"
#include "vision/rm_ga.h"

namespace turbidock::trial {

// What the vehicle knows of the marker: from the cameras' images, or from the truth where only
// control is of interest. Either way it is camera_delay_frames old.
class Eyes {
 public:
  // The cameras have been on for a while: what arrives first shows the vehicle at its start. The
  // options' timer gets the stages of seeing.
  Eyes(const Scenario& scenario, const TrialOptions& options, World* world);

  // To be called at every frame, in order. Returns whether an image arrived, with its estimate.
  bool Update(int64_t frame);

  // Whether to make also the pixels that the estimator cannot read.
  void SeeWhole(bool whole) { whole_images_ = whole || !region_of_interest_; }

  const PoseEstimate& estimate() const { return *estimate_; }  // the latest
  const StereoImage& seen() const { return seen_; }            // what it was made of, if of images
  std::string name() const;

 private:
  Snapshot* Slot(int64_t number);
  void Look(int64_t frame);

  World& world_;
  StageTimer* timer_;
  CameraSchedule schedule_;
  bool region_of_interest_, whole_images_;
  int whole_every_;  // frames; 0: never
  double drop_probability_;
  Rng drops_;
  // The latest snapshots by their images' numbers: those under way from the sensor to the
  // estimator, and the one there. They become images when they arrive: only then is it known which
  // pixels matter.
  std::vector<Snapshot> snapshots_;
  std::optional<vision::RmGa> estimator_;
  std::optional<TruePose> true_pose_;
  const PoseEstimate* estimate_ = nullptr;
  StereoImage seen_;
};

}  // namespace turbidock::trial
