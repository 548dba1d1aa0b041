#include "experiments/studies/estimate/estimate.h"

#include <fmt/format.h>

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

}  // namespace

EstimateSettings LoadEstimateSettings(const std::string& marker_file,
                                      const std::vector<std::string>& assignments) {
  EstimateSettings settings;
  if (!marker_file.empty()) {
    settings.marker.box_m.setZero();
    config::ReadFields(config::LoadYaml(marker_file), &settings.marker, nullptr);
    try {
      CheckFields(settings.marker, "");
    } catch (const ConfigError& error) {
      throw ConfigError(marker_file + ": " + error.what());
    }
  }
  const config::Layers layers{.assignments = assignments};
  settings.estimator =
      vision::RmGaOptions::Of(config::Peek(layers, "estimator.preset", settings.estimator.preset));
  config::ReadLayers(layers, &settings);
  return settings;
}

EstimateSummary RunEstimate(const EstimateInput& input, const EstimateSettings& settings,
                            const std::function<void(const EstimatedFrame&)>& observe) {
  Stereo<std::unique_ptr<media::ImageSource>> sources;
  StereoImage seen;
  for (const Side side : kSides) {
    sources[side] = media::OpenImages(input.images[side]);
    if (!sources[side]->Next(&seen[side]))
      throw ConfigError(input.images[side] + ": holds no images");
  }
  media::RequirePairs(input.images.left, input.images.right);
  const bool is_still = sources.left->is_still();
  if (sources.right->is_still() != is_still)
    throw ConfigError(fmt::format("{} and {}: one is a still image and the other is not",
                                  input.images.left, input.images.right));
  const std::vector<std::string> rig_files =
      input.rig_files.empty() ? std::vector{config::AssetPath("rig_default.yaml")}
                              : input.rig_files;
  const config::RigFromFile from_file =
      config::LoadRig(rig_files, seen.left.width(), seen.left.height());
  const StereoRig& rig = from_file.rig;
  Stereo<std::optional<vision::Undistorter>> undistorters;
  for (const Side side : kSides)
    if (!from_file.distortion[side].is_none())
      undistorters[side].emplace(rig[side], from_file.distortion[side]);
  vision::RmGa estimator(settings.estimator, settings.marker, settings.hue, rig,
                         SeedTree(input.seed).Stream("vision.rm_ga"));
  estimator.set_frame_time(input.frame_time_s);

  EstimateSummary summary;
  const int64_t most = input.frames.value_or(is_still ? kStillFrames : INT64_MAX);
  for (bool is_new = true; true; is_new = !is_still) {
    for (const Side side : kSides) {
      const MountedCamera& camera = rig[side];
      if (seen[side].width() != camera.width_px || seen[side].height() != camera.height_px)
        throw ConfigError(
            input.images[side],
            fmt::format("{} x {} pixels, must be the rig's {} x {}", seen[side].width(),
                        seen[side].height(), camera.width_px, camera.height_px));
      if (is_new && undistorters[side]) undistorters[side]->Apply(&seen[side]);
    }
    seen.frame = summary.frames++;
    const PoseEstimate& estimate = estimator.Update(seen);
    summary.evaluations += estimate.evaluations;
    summary.generations_least = std::min(summary.generations_least, estimator.generations());
    summary.last = estimate;
    observe({estimate, estimator.generations(), seen, rig});
    if (summary.frames >= most) break;
    if (input.stop_requested && input.stop_requested()) {
      summary.incomplete = fmt::format("stopped after {} frames", summary.frames);
      break;
    }
    if (is_still) continue;
    const bool has_left = sources.left->Next(&seen.left),
               has_right = sources.right->Next(&seen.right);
    if (has_left && has_right) continue;
    if (has_left || has_right)
      summary.incomplete =
          fmt::format("{} ends after {} frames, {} goes on",
                      input.images[has_left ? Side::kRight : Side::kLeft], summary.frames,
                      input.images[has_left ? Side::kLeft : Side::kRight]);
    break;
  }
  return summary;
}

media::Canvas DrawEstimate(const EstimatedFrame& frame, const vision::MarkerParams& marker) {
  const int width = frame.seen.left.width(), height = frame.seen.left.height();
  media::Canvas canvas(2 * width, height + height % 2);
  const double alpha = frame.estimate.detected ? 1 : 0.4;
  for (const Side side : kSides) {
    const media::PixelRect panel{side == Side::kLeft ? 0 : width, 0, width, height};
    canvas.DrawImage(frame.seen[side], panel);
    canvas.Clip(panel);
    media::DrawBalls(vision::ProjectBalls(marker, frame.rig[side], frame.estimate.X_HM), panel, 1,
                     marker.outer_ring_ratio, alpha, &canvas);
    canvas.Unclip();
  }
  const Eigen::Vector3d p_mm = 1000 * frame.estimate.X_HM.p;
  const std::string text = fmt::format(
      "frame {}   F = {:.2f}   {}   x {:.0f}  y {:.0f}  z {:.0f} mm", frame.estimate.frame,
      frame.estimate.fitness, frame.estimate.detected ? "detected" : "not detected", p_mm.x(),
      p_mm.y(), p_mm.z());
  canvas.FillRounded({8, 8, static_cast<int>(canvas.TextWidth(text, 16)) + 20, 28}, 5, {0, 0, 0},
                     0.55);
  canvas.Text({18, 27}, text, 16, {240, 240, 240});
  return canvas;
}

}  // namespace turbidock::estimate
