#pragma once
// The estimator alone, on images from disk.

#include <cstdint>
#include <functional>
#include <limits>
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
    field("hue", self.hue, Finite(), "which pixels agree with a ball");
    field("estimator", self.estimator, Finite(), "the pose search");
  }
};

// The default marker, or a marker file (keys of MarkerParams; one that does not say what box
// carries the balls has none), then the assignments. ConfigError for what is wrong in them.
EstimateSettings LoadEstimateSettings(const std::string& marker_file,
                                      const std::vector<std::string>& assignments);

struct EstimateInput {
  Stereo<std::string> images;          // see OpenImages
  std::vector<std::string> rig_files;  // see LoadRig; none: the default rig
  std::optional<int64_t> frames;       // stills: how often they are seen, 30; else at most so many
  uint64_t seed = 0;
  std::optional<double> frame_time_s;         // wall clock, see RmGa::set_frame_time
  std::function<bool()> stop_requested = {};  // polled every frame
};

// One frame, as an observer sees it.
struct EstimatedFrame {
  const PoseEstimate& estimate;
  int generations = 0;
  const StereoImage& seen;  // undistorted
  const StereoRig& rig;
};

struct EstimateSummary {
  PoseEstimate last;
  int64_t frames = 0, evaluations = 0;
  int generations_least = std::numeric_limits<int>::max();
  std::string incomplete;  // why the images ended before both sides did; empty when they did not
};

// Runs the estimator over the images. ConfigError for images or a rig that cannot be used.
EstimateSummary RunEstimate(const EstimateInput& input, const EstimateSettings& settings,
                            const std::function<void(const EstimatedFrame&)>& observe);

// A frame as an object; of all frames' a CSV, its vectors a column for each element.
report::Json RecordOf(const EstimatedFrame& frame, const EstimateSettings& settings);
std::string CsvOf(const std::vector<report::Json>& records);

// Kind "estimate", and the study's own keys: the last estimate, sums, and `records`.
report::Report ReportOf(const EstimateSummary& summary, const std::vector<report::Json>& records);
report::Json ResultJson(const EstimateSummary& summary, const EstimateSettings& settings,
                        const std::vector<report::Json>& records);

// Both images side by side with the estimate's circles and figures; its sides are even.
media::Canvas DrawEstimate(const EstimatedFrame& frame, const vision::MarkerParams& marker);

}  // namespace turbidock::estimate
