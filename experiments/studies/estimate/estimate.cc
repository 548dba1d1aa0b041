#include "experiments/studies/estimate/estimate.h"

#include <fmt/format.h>

#include "experiments/config/data_files.h"
#include "experiments/config/rig_file.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/media/draw_balls.h"
#include "experiments/media/image_source.h"
#include "experiments/report/json.h"
#include "sim/base/random.h"
#include "vision/overlay.h"
#include "vision/undistort.h"

namespace turbidock::estimate {
namespace {

using report::Json;

constexpr int64_t kStillFrames = 30;

void RequireSize(const Image3u8& image, const CameraIntrinsics& camera, const std::string& name) {
  if (image.width() == camera.width_px && image.height() == camera.height_px) return;
  throw ConfigError(name, fmt::format("{} x {} pixels, must be the rig's {} x {}", image.width(),
                                      image.height(), camera.width_px, camera.height_px));
}

// Standard deviations of three coordinates.
std::optional<Eigen::Vector3d> DeviationsOf(const PoseEstimate& estimate, int first) {
  if (!estimate.covariance) return std::nullopt;
  return Eigen::Vector3d(estimate.covariance->diagonal().segment<3>(first).cwiseSqrt());
}

Json ToJson(const PoseEstimate& estimate, const EstimateSettings& settings) {
  Json balls;
  for (size_t b = 0; b < settings.marker.balls.size(); ++b)
    balls[settings.marker.balls[b].name] = estimate.ball_fitness[b];
  return {{"detected", estimate.detected},
          {"position_m", estimate.X_HM.p},
          {"quaternion_wxyz", estimate.X_HM.q},
          {"fitness", estimate.fitness},
          {"ball_fitness", balls},
          {"position_deviation_m", DeviationsOf(estimate, 0)},
          {"rotation_deviation_rad", DeviationsOf(estimate, 3)},
          {"covariance", estimate.covariance}};
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

std::string EstimateJson(const EstimateSummary& summary, const EstimateSettings& settings,
                         const std::vector<std::string>& records) {
  Json json = ToJson(summary.last, settings);
  json["frames"] = summary.frames;
  json["evaluations"] = summary.evaluations;
  json["generations_least"] = summary.generations_least;
  json["complete"] = summary.incomplete.empty();
  json["incomplete_reason"] = summary.incomplete.empty() ? Json() : Json(summary.incomplete);
  json["records"] = Json::array();
  for (const std::string& record : records)
    json["records"].push_back(report::ParseJson(record, "a record"));
  return report::JsonText(json);
}

std::string EstimateRecordJson(const EstimatedFrame& frame, const EstimateSettings& settings) {
  Json json = {{"frame", frame.estimate.frame}};
  json.update(ToJson(frame.estimate, settings));
  json.erase("covariance");
  json["evaluations"] = frame.estimate.evaluations;
  json["generations"] = frame.generations;
  return report::JsonLine(json);
}

std::string EstimateCsvHeader(const EstimateSettings& settings) {
  std::string header =
      "frame,detected,x_m,y_m,z_m,qw,qx,qy,qz,fitness,x_deviation_m,y_deviation_m,z_deviation_m,"
      "evaluations,generations";
  for (const vision::BallParams& ball : settings.marker.balls) header += ",fitness_" + ball.name;
  return header + "\n";
}

std::string EstimateCsvRow(const EstimatedFrame& frame) {
  const PoseEstimate& e = frame.estimate;
  std::string row = fmt::format("{},{:d}", e.frame, e.detected);
  for (const double x : {e.X_HM.p.x(), e.X_HM.p.y(), e.X_HM.p.z(), e.X_HM.q.w(), e.X_HM.q.x(),
                         e.X_HM.q.y(), e.X_HM.q.z(), e.fitness})
    row.append(",").append(FormatNumber(x));
  const std::optional<Eigen::Vector3d> deviations = DeviationsOf(e, 0);
  for (int i = 0; i < 3; ++i)
    row.append(",").append(deviations ? FormatNumber((*deviations)[i]) : "");
  row += fmt::format(",{},{}", e.evaluations, frame.generations);
  for (const double fitness : e.ball_fitness) row.append(",").append(FormatNumber(fitness));
  return row += '\n';
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
