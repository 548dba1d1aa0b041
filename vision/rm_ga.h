#pragma once
// RM-GA, the Real-time Multi-step Genetic Algorithm: a genetic search for the pose of highest
// fitness that spends a fixed number of generations on each frame and starts the next frame from
// where it ended, so that it converges in time while the marker moves.
//
// The published setting costs population + generations * replaced evaluations a frame, 276, where
// evaluating everyone in each of 9 generations would give the same estimates for 540; its estimate
// is the best individual. What the default preset adds: other ways for offspring to come about
// (GeneticSearch), a range that follows the marker and so bounds the pixels that are read (Track),
// and refinement of the best pose to a fraction of a pixel (RefinementArbiter). The reported
// fitness stays the published one, of the search's best pose.

#include <optional>
#include <string_view>

#include "sim/base/camera.h"
#include "sim/base/random.h"
#include "vision/detection.h"
#include "vision/fitness.h"
#include "vision/genetic_search.h"
#include "vision/hue_labels.h"
#include "vision/marker_model.h"
#include "vision/pose_estimator.h"
#include "vision/refinement_arbiter.h"
#include "vision/rm_ga_options.h"
#include "vision/track.h"

namespace turbidock::vision {

// Deterministic: the same options, images and random stream give the same estimates. Not copyable.
class RmGa : public PoseEstimator {
 public:
  // Options and parameters are checked (ConfigError).
  RmGa(const RmGaOptions& options, const MarkerParams& marker, const HueParams& hue,
       const StereoRig& rig, Rng rng);
  RmGa(const RmGa&) = delete;
  RmGa& operator=(const RmGa&) = delete;

  const PoseEstimate& Update(const StereoImage& seen) override;
  // The next frame starts from a random population.
  void Reset() override;
  std::optional<StereoRegion> RegionOfInterest() const override { return track_.region(); }
  std::string_view name() const override { return "rm_ga"; }

 private:
  void Report(int64_t frame);
  Stereo<double> Refine(const StereoImage& seen, const StereoRegion& region, int most_evaluations);

  RmGaOptions options_;
  StereoRig rig_;
  StereoRegion whole_;  // both images
  Rng rng_;
  HueLabeller labeller_;
  Stereo<Image1u8> labels_;
  Fitness fitness_;  // refers to the label images
  GeneticSearch search_;
  RefinementArbiter arbiter_;
  Detection detection_;
  Track track_;
  PoseEstimate estimate_;
};

}  // namespace turbidock::vision
