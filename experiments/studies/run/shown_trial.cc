#include "experiments/studies/run/shown_trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "experiments/app/commands.h"
#include "experiments/app/progress.h"
#include "experiments/media/figure.h"
#include "experiments/media/mp4_writer.h"
#include "experiments/page/trial_page.h"
#include "experiments/studies/run/key_frames.h"
#include "experiments/studies/run/trial_figure.h"
#include "experiments/studies/run/trial_video.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/trial_files.h"
#include "sim/base/units.h"
#include "vision/overlay.h"

namespace turbidock::run {
namespace {

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

// What its page shows: all from memory, but for the film, which is a file only.
page::TrialParts PartsOf(const trial::TrialResult& result, const std::optional<KeyFrames>& pictures,
                         const std::string& out, bool filmed) {
  page::TrialParts parts{.record = static_cast<const trial::TrialRecord&>(result),
                         .series = trial::Series::Of(result.log),
                         .commands = page::CommandsOf(out)};
  if (pictures)
    for (const KeyFrames::Pictures& p : pictures->pictures())
      parts.pictures.push_back({p.frame, p.jpeg});
  if (filmed) parts.video = system::ReadWhole(out + "/video.mp4");
  return parts;
}

}  // namespace

trial::TrialResult RunShownTrial(const trial::Scenario& scenario, const ShownTrialOptions& shown) {
  // now, not after a minute of work
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

  app::Progress progress(shown.quiet);
  progress.Say(fmt::format("{}, seed {}", scenario.description, scenario.seed));
  const StereoRig rig = scenario.rig.MakeRig();
  std::optional<VideoComposer> composer;
  std::optional<media::Mp4Writer> film;
  if (shown.video) {
    composer.emplace(VideoOptions{.envelope_ratio = scenario.marker.outer_ring_ratio,
                                  .criteria = trial::CriteriaOf(scenario)});
    film.emplace(*shown.out + "/video.mp4", kVideoWidth, kVideoHeight,
                 scenario.clock.frames_per_second);
  }

  std::optional<KeyFrames> pictures;
  if (shown.out && scenario.pose_source == trial::PoseSource::kCameras)
    pictures.emplace(*shown.out + "/cameras", scenario.clock.frames_per_second);

  trial::TrialOptions options;
  if (pictures) options.whole_images_every = pictures->first_step();
  options.spectator = shown.video;
  options.whole_images = shown.video;
  options.observe = [&](const trial::TrialFrame& frame) {
    if (pictures && frame.evaluations > 0) pictures->Add(frame.record.frame, frame.seen);
    if (film)
      film->Add(composer->Compose({.images = frame.seen,
                                   .balls = rig.Each([&](const MountedCamera& camera) {
                                     return ProjectBalls(scenario.marker, camera,
                                                         frame.record.est_X_HM);
                                   }),
                                   .record = frame.record,
                                   .spectator = frame.spectator}));
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
  if (pictures) pictures->Write();
  if (film) film->Finish();
  const FigureInfo figure{.title = fmt::format("{}, seed {}", scenario.description, scenario.seed),
                          .outcome = fmt::format("{}: {}", NameOf(result.outcome), result.reason),
                          .criteria = trial::CriteriaOf(scenario)};
  if (!shown.figure.empty()) WriteTrialFigure(shown.figure, result.log, figure);
  if (shown.out) {
    WriteTrialFigure(*shown.out + "/figure.png", result.log, figure);
    if (shown.report)
      page::WritePage(
          *shown.out + "/report.html",
          page::TrialPage(scenario, PartsOf(result, pictures, *shown.out, shown.video)));
    progress.Say(fmt::format("  result.json, resolved.yaml, trajectory.csv, figure.png{}{}{} in {}",
                             pictures ? ", cameras/" : "", film ? ", video.mp4" : "",
                             shown.report ? ", report.html" : "", *shown.out));
  }
  return result;
}

}  // namespace turbidock::run
