#include "vision/rm_ga.h"

#include <algorithm>
#include <string>

namespace turbidock::vision {
namespace {

// Options that passed their checks, for the members that are made from them.
const RmGaOptions& Checked(const RmGaOptions& options) {
  CheckFields(options, "estimator.rm_ga");
  return options;
}

void CheckSize(const Image3u8& image, const CameraIntrinsics& camera, const char* side) {
  if (image.width() == camera.width_px && image.height() == camera.height_px) return;
  const auto size = [](int width, int height) {
    return std::to_string(width) + " x " + std::to_string(height);
  };
  throw ConfigError(std::string(side) + " image", size(image.width(), image.height()) +
                                                      " pixels, must be the rig's " +
                                                      size(camera.width_px, camera.height_px));
}

}  // namespace

RmGa::RmGa(const RmGaOptions& options, const MarkerParams& marker, const HueParams& hue,
           const StereoRig& rig, Rng rng)
    : options_(Checked(options)),
      rig_(rig),
      whole_(WholeImages(rig)),
      rng_(rng),
      labeller_(hue, marker),
      fitness_(marker, rig, labels_),
      search_(options, marker, &fitness_),
      arbiter_(marker, rig),
      track_(options.range, marker, rig) {
  estimate_.ball_fitness.resize(marker.balls.size());
  if (options.refine) estimate_.ball_support.resize(marker.balls.size());
}

void RmGa::Reset() {
  track_.Reset();
  search_.Reinitialize(track_.range());
  arbiter_.Reset();
  detection_ = {};
  std::ranges::fill(estimate_.ball_fitness, 0);
  std::ranges::fill(estimate_.ball_support, 0);
}

const PoseEstimate& RmGa::Update(const StereoImage& seen) {
  CheckSize(seen.left, rig_.left, "left");
  CheckSize(seen.right, rig_.right, "right");
  const StereoRegion& region = track_.region() ? *track_.region() : whole_;
  fitness_.Confine(region);
  for (const Side side : kSides) labeller_.Label(seen[side], region[side], &labels_[side]);
  Lap(timer(), LoopStage::kLabels);

  const int uncertain = detection_.frames_uncertain();
  const bool restart = options_.restart_after_frames > 0 && uncertain > 0 &&
                       uncertain % options_.restart_after_frames == 0;
  // The last generation leaves the evaluations that refinement may need.
  const int most_refined =
      options_.refine ? std::min(arbiter_.MostEvaluations(), search_.size() - search_.kept()) : 0;
  search_.BeginFrame(restart, &rng_);
  for (int left = options_.generations_per_frame - 1; left >= 0; --left)
    search_.Breed(left == 0 ? most_refined : 0, &rng_);

  Report(seen.frame);
  Detection::Evidence evidence{.fitness = estimate_.fitness,
                               .ball_fitness = estimate_.ball_fitness,
                               .ball_support = estimate_.ball_support,
                               .is_tracked = track_.region().has_value()};
  if (options_.refine) evidence.camera_support = Refine(seen, region, most_refined);
  detection_.Update(evidence);
  estimate_.detected = detection_.detected();
  if (options_.track && track_.Update(estimate_, detection_))
    search_.SearchIn(track_.range(), track_.motion());
  return estimate_;
}

// The search's best pose becomes the estimate.
void RmGa::Report(int64_t frame) {
  const Pose X_HM = search_.best_X_HM();
  const FitnessByBall by_ball = fitness_.EvaluateByBall(X_HM);
  estimate_.frame = frame;
  estimate_.X_HM = X_HM.Canonical();
  estimate_.covariance.reset();
  estimate_.second.reset();
  std::ranges::fill(estimate_.ball_support, 0);
  estimate_.fitness = by_ball.fitness;
  for (int b = 0; b < fitness_.ball_count(); ++b)
    estimate_.ball_fitness[static_cast<size_t>(b)] = by_ball.ball(b);
  estimate_.evaluations = search_.evaluations();
}

// A refined pose becomes the estimate and takes part in the next frame's search. Returns how much
// of it each camera supports.
Stereo<double> RmGa::Refine(const StereoImage& seen, const StereoRegion& region,
                            int most_evaluations) {
  if (estimate_.fitness < Detection::kOffFitness) {
    arbiter_.Reset();
    return {};
  }
  const RefinementArbiter::Verdict verdict =
      arbiter_.Judge(seen, region, fitness_, estimate_, most_evaluations, &rng_);
  estimate_.evaluations += verdict.evaluations;
  if (!verdict.refined) return {};
  estimate_.X_HM = verdict.refined->X_HM.Canonical();
  estimate_.covariance = verdict.refined->covariance;
  estimate_.second = verdict.second;
  std::ranges::copy_n(verdict.refined->support.begin(), std::ssize(estimate_.ball_support),
                      estimate_.ball_support.begin());
  search_.Insert(estimate_.X_HM);
  return verdict.refined->camera_support;
}

}  // namespace turbidock::vision
