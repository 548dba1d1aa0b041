#pragma once
// The estimator alone, on images from disk.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "experiments/media/canvas.h"
#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "sim/base/camera.h"
#include "sim/base/image.h"
#include "sim/base/pose_estimate.h"
#include "vision/hue_labels.h"
#include "vision/marker_model.h"
#include "vision/rm_ga.h"

namespace turbidock::estimate {

// What `--set` can reach.
struct EstimateSettings {
  vision::MarkerParams marker;
  vision::HueParams hue;
  vision::RmGaOptions estimator;

  static void Fields(auto& self, auto&& field) {
    field("marker", self.marker, Finite(), "the marker");
    field("estimator.hue", self.hue, Finite(), "which pixels agree with a ball");
    field("estimator.rm_ga", self.estimator, Finite(), "the pose search");
  }
};

// The default marker, or a marker file (keys of MarkerParams; one that does not say what box
// carries the balls has none), then the assignments. ConfigError for what is wrong in them.
EstimateSettings LoadEstimateSettings(const std::string& marker_file,
                                      const std::vector<std::string>& assignments);

struct EstimateInput {
  Stereo<std::string> images;          // see ImagePairs
  std::vector<std::string> rig_files;  // see LoadRig; none: the default rig
  std::optional<int64_t> frames;       // stills: how often they are seen, 30; else at most so many
  uint64_t seed = 0;
  std::function<bool()> stop_requested = {};  // polled every frame
};

// One frame, as an observer sees it.
struct EstimatedFrame {
  const PoseEstimate& estimate;
  const StereoImage& seen;  // undistorted
  const StereoRig& rig;
};

// Whether a later look at the same images tells less: not refined after one that was, both
// detected.
bool TellsLess(const PoseEstimate& later, const PoseEstimate& earlier);

struct EstimateSummary {
  PoseEstimate last;  // of still images the last that TellsLess does not pass over
  int64_t frames = 0, evaluations = 0;
  double baseline_m = 0;
  double range_seen = 0;   // by both cameras, of the range in which the marker is looked for
  std::string incomplete;  // why there should be more images; empty when there should not
  std::vector<std::string> notes;  // sentences: what may be wrong with the images
};

// Runs the estimator over the images. ConfigError for images or a rig that cannot be used.
EstimateSummary RunEstimate(const EstimateInput& input, const EstimateSettings& settings,
                            const std::function<void(const EstimatedFrame&)>& observe);

// A frame as an object.
report::Json RecordOf(const EstimatedFrame& frame, const EstimateSettings& settings);

// Kind "estimate", and the study's own keys: the last estimate, sums, and `records`.
report::Report ReportOf(const EstimateSummary& summary, const std::vector<report::Json>& records);
report::Json ResultJson(const EstimateSummary& summary, const EstimateSettings& settings,
                        const std::vector<report::Json>& records);

// Both images side by side with the estimate's circles and figures; its sides are even.
media::Canvas DrawEstimate(const EstimatedFrame& frame, const vision::MarkerParams& marker);

}  // namespace turbidock::estimate
