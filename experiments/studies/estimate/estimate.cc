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

void RequireSize(const Image3u8& image, const CameraIntrinsics& camera, const std::string& name) {
  if (image.width() == camera.width_px && image.height() == camera.height_px) return;
  throw ConfigError(name, fmt::format("{} x {} pixels, must be the rig's {} x {}", image.width(),
                                      image.height(), camera.width_px, camera.height_px));
}

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
  const auto left = media::OpenImages(input.left), right = media::OpenImages(input.right);
  media::RequirePairs(input.left, input.right);
  if (left->is_still() != right->is_still())
    throw ConfigError(fmt::format("{} and {}: one is a still image and the other is not",
                                  input.left, input.right));
  StereoImage seen;
  if (!left->Next(&seen.left)) throw ConfigError(input.left + ": holds no images");
  if (!right->Next(&seen.right)) throw ConfigError(input.right + ": holds no images");
  if (seen.left.width() != seen.right.width() || seen.left.height() != seen.right.height())
    throw ConfigError(fmt::format("{} has {} x {} pixels and {} has {} x {}", input.left,
                                  seen.left.width(), seen.left.height(), input.right,
                                  seen.right.width(), seen.right.height()));
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
  summary.stills = left->is_still();
  const int64_t most = input.frames.value_or(summary.stills ? kStillFrames : INT64_MAX);
  while (true) {
    if (summary.frames == 0 || !summary.stills) {
      RequireSize(seen.left, rig.left, input.left);
      RequireSize(seen.right, rig.right, input.right);
      for (const Side side : kSides)
        if (undistorters[side]) undistorters[side]->Apply(&seen[side]);
    }
    seen.frame = summary.frames++;
    const PoseEstimate& estimate = estimator.Update(seen);
    summary.evaluations += estimate.evaluations;
    summary.generations_least = summary.frames == 1
                                    ? estimator.generations()
                                    : std::min(summary.generations_least, estimator.generations());
    summary.last = estimate;
    observe({estimate, estimator.generations(), seen, rig});
    if (summary.frames >= most) break;
    if (input.stop_requested && input.stop_requested()) {
      summary.incomplete = fmt::format("stopped after {} frames", summary.frames);
      break;
    }
    if (summary.stills) continue;
    const bool more_left = left->Next(&seen.left), more_right = right->Next(&seen.right);
    if (more_left != more_right)
      summary.incomplete =
          fmt::format("{} ends after {} frames, {} goes on", more_left ? input.right : input.left,
                      summary.frames, more_left ? input.left : input.right);
    if (!more_left || !more_right) break;
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
