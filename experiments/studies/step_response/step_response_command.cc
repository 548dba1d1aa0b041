#include <string>
#include <vector>

#include "experiments/command/command_line.h"
#include "experiments/command/progress.h"
#include "experiments/command/report_output.h"
#include "experiments/studies/step_response/step_response.h"
#include "experiments/trial/scenario.h"

namespace turbidock::step_response {
namespace {

struct StepArguments {
  trial::Plugins plugins;
  std::string scenario = "sea_night_active";
  std::vector<std::string> assignments;
  std::string gains, axis = "all";
  command::ReportOutput output;
  bool quiet = false;
};

int Measure(const StepArguments& arguments) {
  std::vector<std::string> assignments = {"estimator.pose_source=true_pose"};
  assignments.insert(assignments.end(), arguments.assignments.begin(), arguments.assignments.end());
  const trial::Scenario scenario =
      trial::LoadScenario(arguments.scenario, assignments, arguments.gains, arguments.plugins);
  StepOptions options;
  for (const control::Axis axis : StepOptions().axes)
    if (arguments.axis == AxisName(axis)) options.axes = {axis};
  system::OutputPlan outputs;
  outputs.Reads(arguments.scenario).Reads(arguments.gains);
  arguments.output.Plan("step_response", &outputs);
  outputs.Require();
  command::Progress progress(arguments.quiet);
  options.on_progress = [&](double share) { progress.Show(share, "measuring"); };
  const std::vector<AxisResponse> responses = MeasureStepResponses(scenario, options);
  arguments.output.Write(ReportOf(scenario, responses), {{"controller", scenario.controller_name()},
                                                         {"estimator", scenario.pose_source},
                                                         {"axes", responses}});
  return command::kExitDone;
}

}  // namespace

void AddStepResponse(command::CommandLine& line) {
  auto [step, arguments] = line.Add(
      "step-response",
      "Measure how the closed loop answers steps, forces and sinusoids in still water", &Measure);
  arguments.plugins = line.plugins();
  step.Add("scenario", arguments.scenario,
           "YAML file or the name of a bundled scenario (see `turbidock list`)");
  step.AddSet(arguments.assignments,
              "Set one key, such as control.use=lqg; poses are true ones with noise and delay "
              "unless\nit is estimator.pose_source=cameras");
  step.AddGains(arguments.gains);
  step.Add("--axis", arguments.axis, "Which axis").OneOf({"all", "x", "y", "z", "yaw"});
  arguments.output.AddTo(&step, "Folder for the report: .json, .md, .html, step_response.png");
  step.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::step_response
