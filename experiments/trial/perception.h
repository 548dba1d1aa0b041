#pragma once
// The other side of a trial's loop: what the vehicle sees of the marker.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "experiments/trial/camera_schedule.h"
#include "experiments/trial/pose_source.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/world.h"
#include "sim/base/image.h"
#include "sim/base/pose_estimate.h"
#include "sim/base/random.h"
#include "sim/base/stage_timer.h"
#include "vision/pose_estimator.h"

namespace turbidock::trial {

// What the vehicle knows of the marker: from the cameras' images, or from the truth where only
// control is of interest. Either way it is camera_delay_frames old.
//
// A camera that has noise never gives the same image twice: one that is its camera's last again,
// byte for byte, is not believed, and a black one takes its place. Without noise nothing can be
// told.
class Perception {
 public:
  // The cameras have been on for a while: what arrives first shows the vehicle at its start. The
  // options' timer gets the stages of seeing.
  Perception(const Scenario& scenario, const TrialOptions& options, World* world);

  // To be called at every frame, in order. Returns whether an image arrived, with its estimate.
  bool Update(int64_t frame);

  // Whether to make also the pixels that the estimator cannot read.
  void SetFullFrame(bool whole) { whole_images_ = whole || !region_of_interest_; }

  const PoseEstimate& estimate() const { return *estimate_; }  // the latest
  double image_time_s() const { return image_time_s_; }        // when its image was exposed
  const Pose& true_at_image_X_HM() const { return true_at_image_X_HM_; }  // and the marker then
  const StereoImage& latest_images() const { return *seen_; }   // what it was made of, if drawn
  int64_t repeated_images() const { return repeated_images_; }  // so far, of both cameras
  // What to add to a sentence on the trial: cameras that repeat an image by now; empty without any.
  std::string RepeatRemark() const;
  std::string name() const;

 private:
  Snapshot* Slot(int64_t number);
  void Process(int64_t frame);
  void ProcessImages(int64_t number, bool whole);

  World& world_;
  StageTimer* timer_;
  ClockParams clock_;
  CameraSchedule schedule_;
  bool region_of_interest_, whole_images_;
  int whole_every_;       // frames; 0: never
  bool shows_true_pose_;  // in images for an observer
  double drop_probability_;
  Rng drops_;
  // The latest snapshots by their images' numbers: those under way from the sensor to the
  // estimator, and the one there. They become images when they arrive: only then is it known which
  // pixels matter.
  std::vector<Snapshot> snapshots_;
  std::unique_ptr<vision::PoseEstimator> estimator_;
  std::optional<TruePose> true_pose_;
  const PoseEstimate* estimate_ = nullptr;
  double image_time_s_ = 0;
  Pose true_at_image_X_HM_;
  bool noisy_;
  double image_s_;           // from one image to the next
  Stereo<int64_t> repeats_;  // in a row, up to the latest
  int64_t repeated_images_ = 0;
  StereoImage latest_, before_;  // as they arrived
  StereoImage moving_;           // the latest without what repeats, if anything does
  const StereoImage* seen_ = &latest_;
};

}  // namespace turbidock::trial
