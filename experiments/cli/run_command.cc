#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <vector>

#include "experiments/cli/commands.h"
#include "experiments/cli/progress.h"
#include "experiments/result_files.h"
#include "experiments/scenario.h"
#include "experiments/trial.h"
#include "experiments/video.h"
#include "sim/base/units.h"
#include "vision/overlay.h"

namespace turbidock::experiments::cli {
namespace {

struct RunArguments {
  std::string scenario;
  std::vector<std::string> assignments;
  std::string seed;  // as written: the scenario's reader checks it
  std::optional<std::string> out;
  std::string expect;
  bool json = false, video = false, quiet = false;
};

// The film of the trial, made by watching it.
class Film {
 public:
  Film(const std::string& path, const Scenario& scenario)
      : marker_(scenario.marker),
        rig_(scenario.rig.MakeRig()),
        video_(path, {.frames_per_second = scenario.clock.frames_per_second,
                      .envelope_ratio = scenario.marker.outer_ring_ratio,
                      .criteria = CriteriaOf(scenario)}) {}

  void Add(const TrialFrame& frame) {
    const Pose& X_HM = frame.record.est_X_HM;
    video_.Add({.images = frame.seen,
                .left_balls = ProjectBalls(marker_, rig_, vision::StereoSide::kLeft, X_HM),
                .right_balls = ProjectBalls(marker_, rig_, vision::StereoSide::kRight, X_HM),
                .record = frame.record,
                .spectator = frame.spectator});
  }
  void Finish() { video_.Finish(); }

 private:
  vision::MarkerParams marker_;
  StereoRig rig_;
  TrialVideo video_;
};

std::string Summary(const TrialResult& result) {
  const PoseError& t = result.final_error_true;
  return fmt::format(
      "{}: {}\n"
      "  true error at {:.1f} s: x {:+.0f} mm, y {:+.0f} mm, z {:+.0f} mm, yaw {:+.1f} deg\n"
      "  fitness {:.2f} on average, {} returns to servoing, {:.1f} x real time, digest {}",
      NameOf(result.outcome), result.reason, result.time_s, units::MmFromM(t.x_m),
      units::MmFromM(t.y_m), units::MmFromM(t.z_m), units::DegFromRad(t.yaw_rad),
      result.fitness_mean, result.returns_to_servoing, result.real_time_factor, result.digest);
}

int Run(const RunArguments& arguments) {
  std::vector<std::string> assignments = arguments.assignments;
  if (!arguments.seed.empty()) assignments.push_back("seed=" + arguments.seed);
  const Scenario scenario = LoadScenario(arguments.scenario, assignments);
  if (arguments.out) {
    MakeOutputFolder(*arguments.out);
    RequireFigures();  // now, not after a minute of work
  }

  Progress progress(arguments.quiet);
  progress.Say(fmt::format("{}, seed {}", scenario.description, scenario.seed));
  std::optional<Film> film;
  if (arguments.video) film.emplace(*arguments.out + "/video.mp4", scenario);

  TrialOptions options;
  options.spectator = arguments.video;
  options.observe = [&](const TrialFrame& frame) {
    if (film) film->Add(frame);
    progress.Show(std::min(1.0, frame.record.time_s / scenario.duration_s),
                  fmt::format("{:5.1f} s  {:15}  F {:+.2f}", frame.record.time_s,
                              NameOf(frame.record.stage), frame.record.fitness));
  };
  options.on_transition = [&](const control::Transition& change) {
    progress.Say(fmt::format("  {:5.1f} s  {} -> {}: {}", scenario.clock.TimeOfFrame(change.frame),
                             NameOf(change.from), NameOf(change.to), change.reason));
  };
  options.stop_requested = [] { return StopSignal() != 0; };
  const TrialResult result = RunTrial(scenario, options);
  progress.Say(Summary(result));
  // The numbers first: what fails later does not take them along.
  if (arguments.out) WriteRecords(*arguments.out, scenario, result);
  if (arguments.json) std::fputs(ResultJson(result).c_str(), stdout);
  if (film) film->Finish();
  if (arguments.out) {
    WriteFigure(*arguments.out, scenario, result);
    progress.Say(fmt::format("  result.json, resolved.yaml, trajectory.csv, figure.png{} in {}",
                             film ? ", video.mp4" : "", *arguments.out));
  }
  const bool as_expected = arguments.expect.empty() || arguments.expect == NameOf(result.outcome);
  if (!as_expected)
    progress.Say(fmt::format("expected {}, but the outcome is {}", arguments.expect,
                             NameOf(result.outcome)));
  return as_expected ? kExitDone : kExitCheckFailed;
}

}  // namespace

void AddRun(CLI::App& app, Command* chosen) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App* run = app.add_subcommand("run", "Run one docking trial");
  run->add_option("scenario", arguments->scenario,
                  "YAML file or the name of a bundled scenario (see `turbidock scenarios`)")
      ->required();
  run->add_option("--set", arguments->assignments,
                  "Set one key, such as water.milk_ml_m3=20; may be repeated")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  run->add_option("--seed", arguments->seed, "Root of all randomness; as --set seed=N");
  CLI::Option* out =
      run->add_option("--out", arguments->out,
                      "Folder for result.json, resolved.yaml, trajectory.csv and figure.png")
          ->check(CLI::Validator(
              [](const std::string& path) { return path.empty() ? "the folder has no name" : ""; },
              "FOLDER"));
  run->add_flag("--video", arguments->video, "Also make video.mp4 in the folder")->needs(out);
  run->add_flag("--json", arguments->json, "Print the result as JSON on stdout");
  run->add_flag("--quiet", arguments->quiet, "Print nothing on stderr but errors");
  std::vector<std::string> outcomes;
  outcomes.reserve(EnumNames<Outcome>::kNames.size());
  for (const auto& [outcome, name] : EnumNames<Outcome>::kNames) outcomes.push_back(name);
  run->add_option("--expect", arguments->expect, "Exit with 1 when the trial ends otherwise")
      ->check(CLI::IsMember(outcomes));
  run->callback([arguments, chosen] { *chosen = [arguments] { return Run(*arguments); }; });
}

}  // namespace turbidock::experiments::cli
