#include "experiments/studies/estimate/estimate.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "experiments/config/data_files.h"
#include "experiments/config/rig_file.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/media/draw_balls.h"
#include "experiments/media/image_source.h"
#include "sim/base/random.h"
#include "vision/overlay.h"
#include "vision/undistort.h"

namespace turbidock::estimate {
namespace {

constexpr int64_t kStillFrames = 30;

// Of the range in which the marker is looked for.
double ShareSeenByBoth(const StereoRig& rig, const vision::SearchRange& range) {
  constexpr int kSteps = 20;
  int seen = 0;
  for (int i = 0; i < kSteps * kSteps * kSteps; ++i) {
    const Eigen::Array3i step(i % kSteps, i / kSteps % kSteps, i / (kSteps * kSteps));
    const Eigen::Array3d share = (step.cast<double>() + 0.5) / kSteps;
    const Eigen::Vector3d p_HM(range.x_min_m + share.x() * (range.x_max_m - range.x_min_m),
                               range.y_max_m * (2 * share.y() - 1),
                               range.z_max_m * (2 * share.z() - 1));
    seen += std::ranges::all_of(kSides, [&](Side side) {
      const Eigen::Vector3d p_CM = rig[side].X_HC.Inverse() * p_HM;
      if (p_CM.z() <= 0) return false;
      const Eigen::Vector2d at = rig[side].Project(p_CM);
      return at.x() >= 0 && at.y() >= 0 && at.x() < rig[side].width_px &&
             at.y() < rig[side].height_px;
    });
  }
  return static_cast<double>(seen) / (kSteps * kSteps * kSteps);
}

// What can be told of an image that the estimator does not tolerate (vision/README.md).
void AddNotes(const std::string& name, const Image3u8& image, std::vector<std::string>* notes) {
  int brightest = 0, most_colour = 0;
  size_t white = 0;
  for (size_t i = 0; i < image.pixels(); ++i) {
    const auto [least, most] =
        std::minmax({image.data()[3 * i], image.data()[3 * i + 1], image.data()[3 * i + 2]});
    brightest = std::max<int>(brightest, most);
    most_colour = std::max(most_colour, most - least);
    white += least >= 250;
  }
  if (brightest < 32)
    notes->push_back(fmt::format(
        "{}: the brightest value is {} of 255; if it holds 10 or 12 bits in 16, multiply them.",
        name, brightest));
  else if (most_colour < 16)
    notes->push_back(name + ": is grey; the marker is found by its colours.");
  if (10 * white > image.pixels())
    notes->push_back(fmt::format(
        "{}: {:.0f} % of it is white; with a shorter exposure the balls keep their colours.", name,
        100. * static_cast<double>(white) / static_cast<double>(image.pixels())));
}

}  // namespace

EstimateSettings LoadEstimateSettings(const std::string& marker_file,
                                      const std::vector<std::string>& assignments) {
  EstimateSettings settings;
  if (!marker_file.empty()) {
    settings.marker.box_m.setZero();
    config::Origins origins;
    config::ReadFields(config::LoadYaml(marker_file), &settings.marker, &origins);
    config::CheckSettings(settings.marker, origins);
  }
  config::ReadLayers(config::ParseAssignments(assignments), &settings);
  return settings;
}

EstimateSummary RunEstimate(const EstimateInput& input, const EstimateSettings& settings,
                            const std::function<void(const EstimatedFrame&)>& observe) {
  media::ImagePairs pairs(input.images);
  StereoImage seen;
  if (!pairs.Next(&seen)) throw ConfigError(pairs.incomplete() + ": there are no pairs of images");
  const std::vector<std::string> rig_files =
      input.rig_files.empty() ? std::vector{config::AssetPath("rig_default.yaml")}
                              : input.rig_files;
  const config::RigFromFile from_file =
      config::LoadRig(rig_files, seen.left.width(), seen.left.height());
  const StereoRig& rig = from_file.rig;
  EstimateSummary summary;
  summary.baseline_m = (rig.left.X_HC.p - rig.right.X_HC.p).norm();
  summary.range_seen = ShareSeenByBoth(rig, settings.estimator.range);
  if (summary.range_seen == 0)
    throw ConfigError(fmt::format(
        "{}: both cameras see no part of where the marker is looked for, {} to {} m ahead; the "
        "baseline is {:.3g} m: T must be in metres (or set estimator.rm_ga.range)",
        fmt::join(rig_files, ", "), settings.estimator.range.x_min_m,
        settings.estimator.range.x_max_m, summary.baseline_m));
  Stereo<std::optional<vision::Undistorter>> undistorters;
  for (const Side side : kSides) {
    AddNotes(input.images[side], seen[side], &summary.notes);
    if (!from_file.distortion[side].is_none())
      undistorters[side].emplace(rig[side], from_file.distortion[side]);
  }
  vision::RmGa estimator(settings.estimator, settings.marker, settings.hue, rig,
                         SeedTree(input.seed).Stream("vision.rm_ga"));

  const int64_t most = input.frames.value_or(pairs.is_still() ? kStillFrames : INT64_MAX);
  for (bool is_new = true; true; is_new = !pairs.is_still()) {
    for (const Side side : kSides) {
      const MountedCamera& camera = rig[side];
      if (seen[side].width() != camera.width_px || seen[side].height() != camera.height_px)
        throw ConfigError(
            input.images[side],
            fmt::format(
                "{} x {} pixels, must be the rig's {} x {}{}", seen[side].width(),
                seen[side].height(), camera.width_px, camera.height_px,
                2 * seen[side].width() == camera.width_px
                    ? "; a trial's own pictures are half the size: make_footage.py (examples "
                      "of Python) films whole ones"
                    : ""));
      if (is_new && undistorters[side]) undistorters[side]->Apply(&seen[side]);
    }
    seen.frame = summary.frames++;
    const PoseEstimate& estimate = estimator.Update(seen);
    summary.evaluations += estimate.evaluations;
    if (!pairs.is_still() || !TellsLess(estimate, summary.last)) summary.last = estimate;
    observe({estimate, seen, rig});
    if (summary.frames >= most) break;
    if (input.stop_requested && input.stop_requested()) {
      summary.incomplete = fmt::format("stopped after {} frames", summary.frames);
      break;
    }
    if (!pairs.is_still() && !pairs.Next(&seen)) {
      summary.incomplete = pairs.incomplete();
      break;
    }
  }
  std::ranges::copy(pairs.notes(), std::back_inserter(summary.notes));
  return summary;
}

bool TellsLess(const PoseEstimate& later, const PoseEstimate& earlier) {
  return later.detected && earlier.detected && earlier.covariance && !later.covariance;
}

media::Canvas DrawEstimate(const EstimatedFrame& frame, const vision::MarkerParams& marker) {
  const int width = frame.seen.left.width(), height = frame.seen.left.height();
  media::Canvas canvas(2 * width, height + height % 2);
  for (const Side side : kSides)
    media::DrawBalls(frame.seen[side],
                     vision::ProjectBalls(marker, frame.rig[side], frame.estimate.X_HM),
                     frame.estimate.detected, marker.outer_ring_ratio,
                     {side == Side::kLeft ? 0 : width, 0, width, height}, &canvas);
  const Eigen::Vector3d p_mm = 1000 * frame.estimate.X_HM.p;
  const std::string text = fmt::format(
      "frame {}   F = {:.2f}   {}   x {:.0f}  y {:.0f}  z {:.0f} mm", frame.estimate.frame,
      frame.estimate.fitness, frame.estimate.detected ? "detected" : "not detected", p_mm.x(),
      p_mm.y(), p_mm.z());
  canvas.FillRect({8, 8, static_cast<int>(canvas.TextWidth(text, 16)) + 20, 28}, {0, 0, 0}, 0.55);
  canvas.Text({18, 27}, text, 16, {240, 240, 240});
  return canvas;
}

}  // namespace turbidock::estimate
