#include "experiments/studies/run/shown_trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "experiments/app/commands.h"
#include "experiments/app/progress.h"
#include "experiments/media/canvas.h"
#include "experiments/media/figure.h"
#include "experiments/media/jpeg.h"
#include "experiments/media/mp4_writer.h"
#include "experiments/page/trial_page.h"
#include "experiments/studies/run/trial_figure.h"
#include "experiments/studies/run/trial_video.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/trial_files.h"
#include "sim/base/units.h"
#include "vision/overlay.h"

namespace turbidock::run {
namespace {

namespace fs = std::filesystem;

std::string Summary(const trial::TrialResult& result) {
  const AxesPose& t = result.final_error_true;
  return fmt::format(
      "{}: {}\n"
      "  true error at {:.1f} s: x {:+.0f} mm, y {:+.0f} mm, z {:+.0f} mm, yaw {:+.1f} deg\n"
      "  fitness {:.2f} on average, {} returns to servoing, {:.1f} x real time, digest {}",
      NameOf(result.outcome), result.reason, result.time_s, units::MmFromM(t.x_m),
      units::MmFromM(t.y_m), units::MmFromM(t.z_m), units::DegFromRad(t.yaw_rad),
      result.fitness_mean, result.returns_to_servoing, result.real_time_factor, result.digest);
}

// "night sea, active marker, seed 1".
std::string TitleOf(const trial::Scenario& scenario) {
  return fmt::format("{}, seed {}", scenario.description, scenario.seed);
}

// Pictures of what both cameras saw, evenly over the trial; where there are too many, every second
// one goes.
class KeyFrames {
 public:
  explicit KeyFrames(int frames_per_second) : step_(std::max(1, frames_per_second / 2)) {}

  int64_t step() const { return step_; }

  // Keeps the images of this frame if they are wanted. They must be whole.
  void Add(int64_t frame, const StereoImage& images) {
    constexpr size_t kMost = 80;
    if (frame % step_ != 0) return;
    pictures_.push_back({frame, images.Each([](const Image3u8& image) { return Jpeg(image); })});
    if (pictures_.size() < kMost) return;
    step_ *= 2;
    std::erase_if(pictures_, [this](const auto& pair) { return pair.frame % step_ != 0; });
  }

  const std::vector<page::CameraPictures>& pictures() const { return pictures_; }

  // Writes FRAME_left.jpg and FRAME_right.jpg in the place of an earlier trial's.
  void Write(const std::string& folder) const {
    std::vector<fs::path> old;
    for (const auto& entry : fs::directory_iterator(folder))
      if (entry.path().string().ends_with("_left.jpg") ||
          entry.path().string().ends_with("_right.jpg"))
        old.push_back(entry.path());
    for (const fs::path& path : old) fs::remove(path);
    for (const auto& [frame, jpeg] : pictures_) {
      const std::string number = fmt::format("{}/{:06}", folder, frame);
      system::WriteWhole(number + "_left.jpg", jpeg.left);
      system::WriteWhole(number + "_right.jpg", jpeg.right);
    }
  }

 private:
  static std::string Jpeg(const Image3u8& image) {
    constexpr int kLargestWidth_px = 320, kQuality = 70;
    const int width = std::min(image.width(), kLargestWidth_px);
    media::Canvas small(width, std::max(1, width * image.height() / image.width()));
    small.DrawImage(image, small.area());
    return media::EncodeJpeg(small.ToImage(), kQuality);
  }

  int64_t step_;
  std::vector<page::CameraPictures> pictures_;
};

// The film of a trial, frame by frame.
class Film {
 public:
  Film(const trial::Scenario& scenario, const std::string& path)
      : marker_(scenario.marker),
        rig_(scenario.rig.MakeRig()),
        composer_({.envelope_ratio = marker_.outer_ring_ratio,
                   .criteria = trial::CriteriaOf(scenario),
                   .title = TitleOf(scenario),
                   .duration_s = scenario.duration_s + scenario.docked_hold_s}),
        frames_per_second_(scenario.clock.frames_per_second),
        writer_(path, kVideoWidth, kVideoHeight, frames_per_second_) {}

  void Add(const trial::TrialFrame& frame) {
    const auto balls = rig_.Each([&](const MountedCamera& camera) {
      return vision::ProjectBalls(marker_, camera, frame.record.est_X_HM);
    });
    writer_.Add(composer_.Compose({.images = frame.seen,
                                   .balls = balls,
                                   .record = frame.record,
                                   .spectator = frame.spectator}));
  }
  // Shows for a while how the trial ended.
  void Finish(const trial::TrialRecord& record) {
    constexpr int kVerdict_s = 3;
    const media::Canvas& verdict =
        composer_.Conclude(trial::WordsOf(record.outcome), record.reason);
    for (int i = 0; i < kVerdict_s * frames_per_second_; ++i) writer_.Add(verdict);
    writer_.Finish();
  }

 private:
  vision::MarkerParams marker_;
  StereoRig rig_;
  VideoComposer composer_;
  int frames_per_second_;
  media::Mp4Writer writer_;
};

// Now, not after a minute of work.
void RequireOutputs(const ShownTrialOptions& shown) {
  system::OutputPlan outputs;
  outputs.Reads(shown.inputs);
  if (shown.out) {
    std::vector<std::string> files = trial::kRecordFiles;
    files.emplace_back("figure.png");
    if (shown.video) files.emplace_back("video.mp4");
    outputs.WritesInto(*shown.out, files);
    if (shown.report) outputs.Writes(*shown.out + "/report.html", page::kPageFile);
  }
  outputs.Writes(shown.figure).Require();
  if (shown.out) media::RequireFigures();
}

// What is drawn of a trial that has ended: its figure and its page.
void WritePictures(const trial::Scenario& scenario, const trial::TrialResult& result,
                   const std::vector<page::CameraPictures>& pictures,
                   const ShownTrialOptions& shown) {
  const FigureInfo figure{.title = TitleOf(scenario),
                          .outcome = fmt::format("{}: {}", NameOf(result.outcome), result.reason),
                          .criteria = trial::CriteriaOf(scenario)};
  if (!shown.figure.empty()) WriteTrialFigure(shown.figure, result.log, figure);
  if (!shown.out) return;
  WriteTrialFigure(*shown.out + "/figure.png", result.log, figure);
  if (!shown.report) return;
  page::TrialParts parts{.record = static_cast<const trial::TrialRecord&>(result),
                         .series = trial::Series::Of(result.log),
                         .pictures = pictures,
                         .commands = page::CommandsOf(*shown.out)};
  if (shown.video) parts.video = system::ReadWhole(*shown.out + "/video.mp4");
  page::WritePage(*shown.out + "/report.html", page::TrialPage(scenario, parts));
}

}  // namespace

trial::TrialResult RunShownTrial(const trial::Scenario& scenario, const ShownTrialOptions& shown) {
  RequireOutputs(shown);
  app::Progress progress(shown.quiet);
  progress.Say(TitleOf(scenario));
  std::optional<Film> film;
  if (shown.video) film.emplace(scenario, *shown.out + "/video.mp4");
  const bool keeps = shown.out && scenario.pose_source == trial::PoseSource::kCameras;
  const std::string folder = shown.out.value_or("") + "/cameras";
  KeyFrames pictures(scenario.clock.frames_per_second);
  if (keeps) system::MakeFolder(folder);

  trial::TrialOptions options;
  if (keeps) options.whole_images_every = static_cast<int>(pictures.step());
  options.spectator = options.whole_images = shown.video;
  options.observe = [&](const trial::TrialFrame& frame) {
    if (keeps && frame.evaluations > 0) pictures.Add(frame.record.frame, frame.seen);
    if (film) film->Add(frame);
    progress.Show(std::min(1.0, frame.record.time_s / scenario.duration_s),
                  fmt::format("{:5.1f} s  {:15}  F {:+.2f}", frame.record.time_s,
                              NameOf(frame.record.stage), frame.record.fitness));
  };
  options.on_transition = [&](const control::Transition& change) {
    progress.Say(fmt::format("  {:5.1f} s  {} -> {}: {}", scenario.clock.TimeOfFrame(change.frame),
                             NameOf(change.from), NameOf(change.to), change.reason));
  };
  options.on_remark = [&](const std::string& remark) { progress.Say(remark); };
  options.stop_requested = app::CatchStopSignals();
  trial::TrialResult result = trial::RunTrial(scenario, options);
  progress.Say(Summary(result));
  // The numbers first: what fails later does not take them along.
  if (shown.out) trial::WriteRecords(*shown.out, scenario, result);
  if (shown.json) std::fputs(trial::ResultJson(result).c_str(), stdout);
  if (keeps) pictures.Write(folder);
  if (film) film->Finish(result);
  WritePictures(scenario, result, pictures.pictures(), shown);
  if (shown.out)
    progress.Say(fmt::format("  result.json, resolved.yaml, trajectory.csv, figure.png{}{}{} in {}",
                             keeps ? ", cameras/" : "", film ? ", video.mp4" : "",
                             shown.report ? ", report.html" : "", *shown.out));
  return result;
}

}  // namespace turbidock::run
