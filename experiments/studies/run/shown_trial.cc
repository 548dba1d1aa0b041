#include "experiments/studies/run/shown_trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <utility>

#include "experiments/command/progress.h"
#include "experiments/media/canvas.h"
#include "experiments/media/figure.h"
#include "experiments/media/jpeg.h"
#include "experiments/media/mp4_writer.h"
#include "experiments/page/trial_page.h"
#include "experiments/report/json.h"
#include "experiments/report/table.h"
#include "experiments/studies/run/trial_video.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/motion.h"
#include "experiments/trial/trial_report.h"
#include "sim/base/units.h"
#include "vision/overlay.h"

namespace turbidock::run {
namespace {

namespace fs = std::filesystem;

std::string Summary(const trial::TrialResult& result) {
  const AxesPose& t = result.final_error_true;
  return fmt::format(
      "{}: {}\n"
      "  true error at {:.1f} s: x {:+.0f} mm, y {:+.0f} mm, z {:+.0f} mm, yaw {:+.1f}°\n"
      "  fitness {:.2f} on average, {} returns to servoing, {:.1f} x real time, digest {}",
      NameOf(result.outcome), report::Spoken(result.reason), result.time_s, units::MmFromM(t.x_m),
      units::MmFromM(t.y_m), units::MmFromM(t.z_m), units::DegFromRad(t.yaw_rad),
      result.fitness_mean, result.returns_to_servoing, result.real_time_factor, result.digest);
}

// Every how many frames a picture of what both cameras saw is kept: two a second, fewer in a long
// trial.
int KeyFrameStep(const trial::Scenario& scenario) {
  constexpr int kMost = 120;
  const auto frames = static_cast<int>(scenario.clock.FramesFor(scenario.duration_s));
  return std::max({1, scenario.clock.frames_per_second / 2, frames / kMost});
}

std::string SmallJpeg(const Image3u8& image) {
  constexpr int kLargestWidth_px = 320, kQuality = 70;
  const int width = std::min(image.width(), kLargestWidth_px);
  media::Canvas small(width, std::max(1, width * image.height() / image.width()));
  small.DrawImage(image, small.area());
  return media::EncodeJpeg(small.ToImage(), kQuality);
}

// What both cameras saw now and then, in the folder's cameras/.
class KeyFrames {
 public:
  // Makes the folder.
  KeyFrames(const trial::Scenario& scenario, std::string folder)
      : step_(KeyFrameStep(scenario)), folder_(std::move(folder)) {
    system::MakeFolder(folder_);
  }
  int step() const { return step_; }

  void Add(const trial::TrialFrame& frame) {
    if (frame.evaluations > 0 && frame.record.frame % step_ == 0)
      pictures_[frame.record.frame] = frame.seen.Each(SmallJpeg);
  }
  void Write() const {
    for (const auto& [frame, jpeg] : pictures_) {
      const std::string number = fmt::format("{}/{:06}", folder_, frame);
      system::WriteWhole(number + "_left.jpg", jpeg.left);
      system::WriteWhole(number + "_right.jpg", jpeg.right);
    }
  }

 private:
  int step_;
  std::string folder_;
  std::map<int64_t, Stereo<std::string>> pictures_;  // JPEG, by frame
};

// Those of an earlier trial: FRAME_left.jpg and FRAME_right.jpg.
void RemoveKeyFrames(const std::string& folder) {
  std::vector<fs::path> old;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    const size_t digits = std::min(name.find_first_not_of("0123456789"), name.size());
    const std::string rest = name.substr(digits);
    if (digits > 0 && (rest == "_left.jpg" || rest == "_right.jpg")) old.push_back(entry.path());
  }
  for (const fs::path& path : old) fs::remove(path);
}

// The film of a trial, frame by frame.
class Film {
 public:
  // `of` must live as long.
  Film(const trial::Scenario& of, const std::string& path)
      : scenario_(of),
        rig_(of.rig.MakeRig()),
        composer_(of),
        writer_(path, kVideoWidth, kVideoHeight, of.clock.frames_per_second) {}

  void Add(const trial::TrialFrame& frame) {
    const auto balls = rig_.Each([&](const MountedCamera& camera) {
      return vision::ProjectBalls(scenario_.marker, camera, frame.record.est_X_HM);
    });
    writer_.Add(composer_.Compose({frame.seen, balls, frame.record, frame.spectator}));
  }
  // Shows for a while how the trial ended.
  void Finish(const trial::TrialRecord& record) {
    constexpr int kVerdict_s = 3;
    const media::Canvas& verdict =
        composer_.Conclude(report::Words(NameOf(record.outcome)), report::Spoken(record.reason));
    for (int i = 0; i < kVerdict_s * scenario_.clock.frames_per_second; ++i) writer_.Add(verdict);
    writer_.Finish();
  }

 private:
  const trial::Scenario& scenario_;
  StereoRig rig_;
  VideoComposer composer_;
  media::Mp4Writer writer_;
};

// What is kept of a trial beside its records, while it runs.
class Kept {
 public:
  // Both must live as long.
  Kept(const trial::Scenario& scenario, const ShownTrialOptions& shown) : shown_(shown) {
    if (!shown.out) return;
    system::MakeFolder(*shown.out);
    if (scenario.pose_source == trial::PoseSource::kCameras)
      key_frames_.emplace(scenario, *shown.out + "/cameras");
    if (shown.video) film_.emplace(scenario, *shown.out + "/video.mp4");
    if (shown.motion) motion_.emplace(trial::ThrusterNamesOf(scenario));
  }

  // Asks for what it needs.
  void Require(trial::TrialOptions* options) {
    if (key_frames_) options->whole_images_every = key_frames_->step();
    options->spectator = options->whole_images = film_.has_value();
    if (motion_) options->on_tick = [this](const trial::MotionTick& tick) { motion_->Add(tick); };
  }
  void Add(const trial::TrialFrame& frame) {
    if (key_frames_) key_frames_->Add(frame);
    if (film_) film_->Add(frame);
  }
  // In the place of an earlier trial's files.
  void Write(const trial::TrialResult& result) {
    if (!shown_.out) return;
    const std::string& folder = *shown_.out;
    if (!motion_) fs::remove(folder + "/motion.csv");
    if (!film_) fs::remove(folder + "/video.mp4");
    if (!shown_.report) fs::remove(folder + "/report.html");
    RemoveKeyFrames(folder + "/cameras");
    if (motion_) system::WriteWhole(folder + "/motion.csv", motion_->table().Csv());
    if (key_frames_) key_frames_->Write();
    if (film_) film_->Finish(result);
  }

 private:
  const ShownTrialOptions& shown_;
  std::optional<KeyFrames> key_frames_;
  std::optional<Film> film_;
  std::optional<trial::MotionLog> motion_;
};

// Now, not after a minute of work.
void RequireOutputs(const ShownTrialOptions& shown) {
  system::OutputPlan outputs;
  outputs.Reads(shown.inputs);
  if (shown.out) {
    std::vector<std::string> files = trial::kRecordFiles;
    files.emplace_back("figure.png");
    if (shown.video) files.emplace_back("video.mp4");
    if (shown.motion) files.emplace_back("motion.csv");
    outputs.WritesInto(*shown.out, files);
    outputs.Writes(*shown.out + "/report.html", page::kPageFile);
  }
  outputs.Writes(shown.figure).Require();
  if (shown.out) media::RequireFigures();
}

// What is drawn of a trial that has ended: its figure and its page.
void WritePictures(const trial::Scenario& scenario, const trial::TrialResult& result,
                   const ShownTrialOptions& shown) {
  if (!shown.out && shown.figure.empty()) return;
  const report::Figure figure = media::FigureOf(
      trial::ReportOf(scenario, report::Json(result), trial::Series::Of(result.log)));
  if (!shown.figure.empty()) media::WriteFigure(shown.figure, figure);
  if (!shown.out) return;
  media::WriteFigure(*shown.out + "/figure.png", figure);
  if (!shown.report) return;
  page::WritePage(*shown.out + "/report.html", page::TrialPage(*shown.out, scenario.plugins));
}

// Says how the trial goes and has it kept; all of them must live as long.
trial::TrialOptions Followed(const trial::Scenario& scenario, command::Progress* progress,
                             Kept* kept) {
  trial::TrialOptions options;
  kept->Require(&options);
  options.observe = [&scenario, progress, kept](const trial::TrialFrame& frame) {
    kept->Add(frame);
    progress->Show(std::min(1.0, frame.record.time_s / scenario.duration_s),
                   fmt::format("{:5.1f} s  {:15}  F {:+.2f}", frame.record.time_s,
                               NameOf(frame.record.stage), frame.record.fitness));
  };
  options.on_transition = [&scenario, progress](const control::Transition& change) {
    progress->Say(fmt::format("  {:5.1f} s  {} -> {}: {}", scenario.clock.TimeOfFrame(change.frame),
                              NameOf(change.from), NameOf(change.to), change.reason));
  };
  options.on_remark = [progress](const std::string& remark) { progress->Say(remark); };
  options.stop_requested = command::CatchStopSignals();
  return options;
}

}  // namespace

trial::TrialResult RunShownTrial(const trial::Scenario& scenario, const ShownTrialOptions& shown) {
  RequireOutputs(shown);
  command::Progress progress(shown.quiet);
  progress.Say(trial::TitleOf(scenario));
  Kept kept(scenario, shown);
  trial::TrialResult result = trial::RunTrial(scenario, Followed(scenario, &progress, &kept));
  // The numbers first: what fails later does not take them along.
  if (shown.json)
    progress.Say(Summary(result));
  else
    progress.Print(Summary(result));
  if (shown.out) trial::WriteRecords(*shown.out, scenario, result);
  if (shown.json) std::fputs(report::JsonText(result).c_str(), stdout);
  kept.Write(result);
  WritePictures(scenario, result, shown);
  if (shown.out) progress.Say("  all of it in " + *shown.out);
  return result;
}

}  // namespace turbidock::run
