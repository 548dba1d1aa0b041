#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/progress.h"
#include "experiments/media/image_source.h"
#include "experiments/media/mp4_writer.h"
#include "experiments/media/png.h"
#include "experiments/studies/estimate/estimate.h"
#include "experiments/system/output_path.h"
#include "sim/base/units.h"

namespace turbidock::estimate {
namespace {

constexpr double kFrame_s = 0.033;  // the published time of a frame

struct EstimateArguments {
  EstimateInput input;
  std::string marker, preset, csv, overlay;
  std::vector<std::string> assignments;
  int frames_per_second = 30;
  bool json = false, wall_clock = false, quiet = false;
};

std::string Summary(const EstimateSummary& summary) {
  const PoseEstimate& e = summary.last;
  const Eigen::Vector3d p_mm = 1000 * e.X_HM.p;
  std::string text = fmt::format(
      "{}: x {:.1f}, y {:.1f}, z {:.1f} mm, quaternion (w x y z) {:.5f} {:.5f} {:.5f} {:.5f}, "
      "F {:.3f}, after {} frames and {} evaluations",
      e.detected ? "detected" : "not detected", p_mm.x(), p_mm.y(), p_mm.z(), e.X_HM.q.w(),
      e.X_HM.q.x(), e.X_HM.q.y(), e.X_HM.q.z(), e.fitness, summary.frames, summary.evaluations);
  if (e.covariance) {
    const Eigen::Matrix<double, 6, 1> deviation = e.covariance->diagonal().cwiseSqrt();
    text += fmt::format("\n  standard deviations {:.2f}, {:.2f}, {:.2f} mm and {:.2f} deg at most",
                        1000 * deviation[0], 1000 * deviation[1], 1000 * deviation[2],
                        units::DegFromRad(deviation.tail<3>().maxCoeff()));
  }
  return text;
}

// The pictures of the estimate: one file for a still pair, a video of a sequence.
class Overlay {
 public:
  Overlay(const std::string& path, int frames_per_second)
      : path_(path), frames_per_second_(frames_per_second) {
    is_video_ = path.ends_with(".mp4");
    if (!is_video_ && !path.ends_with(".png"))
      throw ConfigError("--overlay " + path + ": must end in .png (the last frame) or .mp4");
  }
  void Add(const EstimatedFrame& frame, const vision::MarkerParams& marker) {
    media::Canvas canvas = DrawEstimate(frame, marker);
    if (is_video_) {
      if (!video_) video_.emplace(path_, canvas.width(), canvas.height(), frames_per_second_);
      video_->Add(canvas);
    } else {
      last_.emplace(std::move(canvas));
    }
  }
  void Finish() {
    if (video_) video_->Finish();
    if (last_) media::WritePng(path_, last_->ToImage());
  }

 private:
  std::string path_;
  int frames_per_second_;
  bool is_video_;
  std::optional<media::Mp4Writer> video_;
  std::optional<media::Canvas> last_;
};

int Estimate(const EstimateArguments& arguments) {
  EstimateInput input = arguments.input;
  std::vector<std::string> assignments = arguments.assignments;
  if (!arguments.preset.empty()) assignments.push_back("estimator.preset=" + arguments.preset);
  const EstimateSettings settings = LoadEstimateSettings(arguments.marker, assignments);
  if (arguments.wall_clock) input.frame_time_s = kFrame_s;
  input.stop_requested = app::CatchStopSignals();
  system::OutputPlan outputs;
  for (const std::string& images : {input.left, input.right})
    for (const std::string& file : media::FilesOf(images)) outputs.Reads(file);
  for (const std::string& file : input.rig_files) outputs.Reads(file);
  outputs.Reads(arguments.marker).Writes(arguments.csv).Writes(arguments.overlay).Require();
  std::optional<Overlay> overlay;
  if (!arguments.overlay.empty()) overlay.emplace(arguments.overlay, arguments.frames_per_second);

  app::Progress progress(arguments.quiet);
  std::string csv = EstimateCsvHeader(settings);
  std::vector<std::string> records;
  const EstimateSummary summary = RunEstimate(input, settings, [&](const EstimatedFrame& frame) {
    csv += EstimateCsvRow(frame);
    if (arguments.json) records.push_back(EstimateRecordJson(frame, settings));
    if (overlay) overlay->Add(frame, settings.marker);
  });
  progress.Say(Summary(summary));
  if (!summary.incomplete.empty()) progress.Say("incomplete: " + summary.incomplete);
  if (arguments.wall_clock)
    progress.Say(fmt::format("at least {} generations in each {:.0f} ms frame",
                             summary.generations_least, 1000 * kFrame_s));
  if (!arguments.csv.empty()) system::WriteWhole(arguments.csv, csv);
  if (arguments.json) std::fputs(EstimateJson(summary, settings, records).c_str(), stdout);
  if (overlay) overlay->Finish();
  return app::kExitDone;
}

}  // namespace

void AddEstimate(app::CommandLine& line) {
  auto [estimate, arguments] = line.Add<EstimateArguments>(
      "estimate", "Estimate the marker's pose on images or video from disk", &Estimate);
  EstimateInput& input = arguments.input;
  const char* kinds = "image, folder, pattern ('left_*.png') or video";
  estimate.Add("--left", input.left, std::string("Left camera: ") + kinds).Required();
  estimate.Add("--right", input.right, "Right camera, likewise").Required();
  estimate.Add("--rig", input.rig_files,
               "Rig file, or OpenCV's stereo calibration (may be repeated: intrinsics, "
               "extrinsics; T in metres); the default rig unless given");
  estimate.Add("--marker", arguments.marker, "Marker file; the default marker unless given");
  estimate.Add("--preset", arguments.preset, "Setting of the search; as --set estimator.preset=")
      .OneOf({NameOf(vision::Preset::kDefault), NameOf(vision::Preset::kPublished)});
  estimate
      .Add("--frames", input.frames,
           "Still images: frames they are seen for (30); sequences: at most so many")
      .Positive();
  estimate.Add("--seed", input.seed, "Root of all randomness");
  estimate.AddSet(arguments.assignments,
                  "Set one key of marker, hue or estimator, such as estimator.range.x_max_m=3");
  estimate.Flag("--wall-clock", arguments.wall_clock,
                "As many generations as 33 ms of this machine's time allow; not reproducible");
  estimate.Add("--csv", arguments.csv, "Write a line for each frame");
  estimate.Add("--overlay", arguments.overlay,
               "Draw the estimate on the images: FILE.mp4, or FILE.png of the last frame");
  estimate.Add("--fps", arguments.frames_per_second, "Frames a second of the overlay")
      .Between(1, 240);
  estimate.AddJson(arguments.json);
  estimate.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::estimate
