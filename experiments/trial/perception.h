#pragma once
// The other side of a trial's loop: what the vehicle sees of the marker.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "experiments/trial/scenario.h"
#include "experiments/trial/world.h"
#include "sim/base/camera.h"
#include "sim/base/image.h"
#include "sim/base/pose_estimate.h"
#include "sim/base/random.h"
#include "sim/base/stage_timer.h"
#include "vision/marker_model.h"
#include "vision/pose_estimator.h"

namespace turbidock::trial {

// When the cameras expose and when an image arrives at the estimator, in frames of the loop.
//
// Images are numbered one after the other; with a period of one frame an image's number is the
// frame of its exposure. An image arrives at frame 0, whatever the delay: the cameras have been on
// for a while.
class CameraSchedule {
 public:
  // Every `period` frames, at least 1; at the estimator `delay` frames later.
  CameraSchedule(int period, int delay) : period_(period), delay_(delay) {}

  int64_t first_frame() const { return -delay_; }  // of the exposures
  bool ExposesAt(int64_t frame) const { return (frame + delay_) % period_ == 0; }
  bool ArrivesAt(int64_t frame) const { return frame % period_ == 0; }
  int64_t ExposureOf(int64_t frame) const { return frame - delay_; }  // of what arrives at it
  // Number of the image exposed at this frame, of the one that arrived last.
  int64_t ExposedAt(int64_t frame) const { return (frame + delay_) / period_ - delay_; }
  int64_t LatestAt(int64_t frame) const { return frame / period_ - delay_; }
  // Images to keep beside the latest, so that none is overwritten while it is still needed.
  int under_way() const { return delay_ == 0 ? 0 : 1 + (delay_ - 1) / period_; }

 private:
  int period_, delay_;
};

// Stands in for an estimator in trials that are about control only.
class TruePose {
 public:
  TruePose(const TruePoseParams& params, const vision::MarkerParams& marker, const StereoRig& rig,
           double frame_s, Rng rng);

  // The estimate of a frame exposed when the marker was at X_HM. The fitness is a mean over balls
  // and images, as the estimator's.
  const PoseEstimate& Update(int64_t frame, const Pose& X_HM);

 private:
  double Fitness(const Pose& X_HM) const;

  TruePoseParams params_;
  vision::MarkerParams marker_;
  StereoRig rig_;
  double frame_s_;
  Rng rng_;
  Eigen::Vector4d noise_ = Eigen::Vector4d::Zero();  // unit variance
  bool started_ = false;
  int64_t frames_in_sight_ = 0;
  PoseEstimate estimate_;
};

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
