#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/progress.h"
#include "experiments/media/figure.h"
#include "experiments/studies/step_response/step_response.h"
#include "experiments/studies/step_response/step_response_report.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/scenario.h"

namespace turbidock::step_response {
namespace {

struct StepArguments {
  trial::Plugins plugins;
  std::string scenario = "sea_night_active";
  std::vector<std::string> assignments;
  std::string gains, axis = "all", figure;
  std::optional<std::string> out;
  StepOptions options;
  bool cameras = false, true_pose = false, sea = false, no_noise = false;
  bool json = false, quiet = false;
};

int Measure(const StepArguments& arguments) {
  std::vector<std::string> assignments = arguments.assignments;
  assignments.emplace_back(arguments.cameras ? "pose_source=cameras" : "pose_source=true_pose");
  const trial::Scenario scenario =
      trial::LoadScenario(arguments.scenario, assignments, arguments.gains, arguments.plugins);
  StepOptions options = arguments.options;
  options.still_water = !arguments.sea;
  options.noise = !arguments.no_noise;
  if (arguments.axis != "all") {
    for (const control::Axis axis : StepOptions().axes)
      if (arguments.axis == AxisName(axis)) options.axes = {axis};
  }
  if (!arguments.figure.empty()) media::RequireFigurePath(arguments.figure);
  system::OutputPlan outputs;
  outputs.Reads(arguments.scenario).Reads(arguments.gains).Writes(arguments.figure);
  if (arguments.out)
    outputs.WritesInto(*arguments.out,
                       {"step_response.json", "step_response.csv", "step_response.png"});
  outputs.Require();
  if (arguments.out || !arguments.figure.empty()) media::RequireFigures();
  app::Progress progress(arguments.quiet);
  progress.Say(fmt::format("{}: {}, {}, {}", scenario.description, scenario.controller_name(),
                           arguments.cameras ? "through the cameras" : "on the true pose",
                           arguments.sea ? "in its sea" : "in still water"));
  options.on_progress = [&](double share) { progress.Show(share, "measuring"); };
  options.stop_requested = app::CatchStopSignals();
  const std::vector<AxisResponse> responses = MeasureStepResponses(scenario, options);
  if (responses.empty()) return app::kExitDone;  // stopped: main makes the signal's code of it
  const std::string json = StepJson(scenario, responses);
  if (arguments.json)
    std::fputs(json.c_str(), stdout);
  else
    std::fputs(StepTable(responses).c_str(), stdout);
  const std::string title = fmt::format("{}: {}", scenario.description, scenario.controller_name());
  if (!arguments.figure.empty()) WriteStepFigure(arguments.figure, title, responses);
  if (arguments.out) {
    system::WriteWhole(*arguments.out + "/step_response.json", json);
    system::WriteWhole(*arguments.out + "/step_response.csv", StepCsv(responses));
    WriteStepFigure(*arguments.out + "/step_response.png", title, responses);
    progress.Say(fmt::format("  step_response.json, .csv, .png in {}", *arguments.out));
  }
  return app::kExitDone;
}

}  // namespace

void AddStepResponse(app::CommandLine& line) {
  auto [step, arguments] = line.Add(
      "step-response", "Measure how the closed loop answers steps, forces and sinusoids", &Measure);
  arguments.plugins = line.plugins();
  step.Add("scenario", arguments.scenario,
           "YAML file or the name of a bundled scenario (see `turbidock list`)");
  step.AddSet(arguments.assignments, "Set one key, such as controller=lqg");
  step.Add("--gains", arguments.gains, "Gains file, read over the scenario");
  step.Add("--axis", arguments.axis, "Which axis").OneOf({"all", "x", "y", "z", "yaw"});
  const app::Option cameras =
      step.Flag("--cameras", arguments.cameras, "See through the cameras: much slower");
  step.Flag("--true-pose", arguments.true_pose,
            "See the true pose with noise and delay (the default)")
      .Excludes(cameras);
  step.Flag("--sea", arguments.sea, "In the scenario's current and waves, not in still water");
  step.Flag("--no-noise", arguments.no_noise, "Without noise on the true pose");
  StepOptions& options = arguments.options;
  step.Add("--step", options.step_m, "Step of x, y and z in m").Between(0.001, 0.5);
  step.Add("--turn", options.step_rad, "Step of yaw in rad").Between(0.001, 0.5);
  step.Add("--force", options.force_newton, "Push on x, y and z in N").Between(0.001, 100.0);
  step.Add("--amplitude", options.share,
           "Of the sinusoids that measure the loop, as share of what the vehicle can give")
      .Between(0.004, 1.0);
  step.Add("--out", arguments.out, "Folder for step_response.json, .csv and .png");
  step.Add("--figure FILE", arguments.figure, "Draw it: .png, .svg or .pdf");
  step.AddJson(arguments.json);
  step.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::step_response
