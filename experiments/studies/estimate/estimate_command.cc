#include <fmt/format.h>

#include <optional>
#include <string>
#include <vector>

#include "experiments/command/command_line.h"
#include "experiments/command/progress.h"
#include "experiments/command/report_output.h"
#include "experiments/media/image_source.h"
#include "experiments/media/mp4_writer.h"
#include "experiments/media/png.h"
#include "experiments/studies/estimate/estimate.h"
#include "experiments/system/output_path.h"
#include "sim/base/units.h"

namespace turbidock::estimate {
namespace {

constexpr int kOverlayFramesPerSecond = 30;

struct EstimateArguments {
  EstimateInput input;
  std::string marker, overlay;
  std::vector<std::string> assignments;
  bool json = false, quiet = false;
};

int Estimate(const EstimateArguments& arguments) {
  EstimateInput input = arguments.input;
  const EstimateSettings settings = LoadEstimateSettings(arguments.marker, arguments.assignments);
  input.stop_requested = command::CatchStopSignals();
  system::OutputPlan outputs;
  for (const Side side : kSides) outputs.Reads(media::FilesOf(input.images[side]));
  outputs.Reads(input.rig_files).Reads(arguments.marker).Writes(arguments.overlay).Require();
  const std::string& overlay = arguments.overlay;
  const bool is_video = overlay.ends_with(".mp4");
  if (!overlay.empty() && !is_video && !overlay.ends_with(".png"))
    throw ConfigError("--overlay " + overlay + ": must end in .png (the last frame) or .mp4");

  command::Progress progress(arguments.quiet);
  std::vector<report::Json> records;
  std::optional<media::Mp4Writer> video;
  std::optional<media::Canvas> last;
  const EstimateSummary summary = RunEstimate(input, settings, [&](const EstimatedFrame& frame) {
    records.push_back(RecordOf(frame, settings));
    if (overlay.empty()) return;
    last.emplace(DrawEstimate(frame, settings.marker));
    if (!is_video) return;
    if (!video) video.emplace(overlay, last->width(), last->height(), kOverlayFramesPerSecond);
    video->Add(*last);
  });
  if (arguments.json) {
    if (!summary.incomplete.empty()) progress.Say("incomplete: " + summary.incomplete);
    for (const std::string& note : summary.notes) progress.Say(note);
  }
  report::Json result = ResultJson(summary, settings, records);
  if (last && !is_video) result["overlay"] = overlay;  // for its page, which looks beside it
  command::PrintReport(ReportOf(summary, records), result, arguments.json);
  if (video) video->Finish();
  if (last && !is_video) media::WritePng(overlay, last->ToImage());
  return command::kExitDone;
}

}  // namespace

void AddEstimate(command::CommandLine& line) {
  auto [estimate, arguments] = line.Add<EstimateArguments>(
      "estimate", "Estimate the marker's pose on images or video from disk", &Estimate);
  EstimateInput& input = arguments.input;
  const char* kinds = "image, folder, pattern ('left_*.png') or video";
  estimate.Add("--left", input.images.left, std::string("Left camera: ") + kinds).Required();
  estimate.Add("--right", input.images.right, "Right camera, likewise").Required();
  estimate.Add("--rig", input.rig_files,
               "Rig file, or a stereo calibration of OpenCV, ROS or Kalibr (may be repeated: its "
               "files; lengths in metres); the default rig unless given");
  estimate.Add("--marker", arguments.marker, "Marker file; the default marker unless given");
  estimate
      .Add("--frames", input.frames,
           "Still images: frames they are seen for (30); sequences: at most so many")
      .Positive();
  estimate.Add("--seed", input.seed, "Root of all randomness");
  estimate.AddSet(arguments.assignments,
                  "Set one key of marker or estimator, such as estimator.rm_ga.range.x_max_m=3");
  estimate.Add("--overlay", arguments.overlay,
               "Draw the estimate on the images: FILE.mp4; or FILE.png, of the last frame, which "
               "a report of the --json document in the same folder shows");
  estimate.AddJson(arguments.json);
  estimate.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::estimate
