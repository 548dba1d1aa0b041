#include <fmt/format.h>

#include <vector>

#include "experiments/command/command_line.h"
#include "experiments/command/progress.h"
#include "experiments/studies/run/shown_trial.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"

namespace turbidock::run {
namespace {

struct RunArguments {
  trial::Plugins plugins;
  std::string scenario;
  std::vector<std::string> assignments;
  std::string gains;
  std::string seed, expect;
  ShownTrialOptions shown;
};

int Run(const RunArguments& arguments) {
  std::vector<std::string> assignments = arguments.assignments;
  command::SetSeed(arguments.seed, &assignments);
  const trial::Scenario scenario =
      trial::LoadScenario(arguments.scenario, assignments, arguments.gains, arguments.plugins);
  ShownTrialOptions shown = arguments.shown;
  shown.inputs = {arguments.scenario, arguments.gains};
  const trial::TrialResult result = RunShownTrial(scenario, shown);
  const bool as_expected = arguments.expect.empty() || arguments.expect == NameOf(result.outcome);
  if (!as_expected)
    command::Progress(shown.quiet)
        .Say(fmt::format("expected {}, but the outcome is {}", arguments.expect,
                         NameOf(result.outcome)));
  return as_expected ? command::kExitDone : command::kExitCheckFailed;
}

}  // namespace

void AddRun(command::CommandLine& line) {
  auto [run, arguments] = line.Add("run", "Run one docking trial", &Run);
  arguments.plugins = line.plugins();
  run.Add("scenario", arguments.scenario,
          "YAML file or the name of a bundled scenario (see `turbidock list`)")
      .Required();
  run.AddSet(arguments.assignments, "Set one key, such as water.milk_ml_m3=20");
  run.Add("--gains", arguments.gains,
          "Gains file, such as `turbidock tune` writes, read over the scenario");
  run.AddSeed(arguments.seed);
  ShownTrialOptions& shown = arguments.shown;
  const command::Option out =
      run.Add("--out FOLDER", shown.out,
              "Folder for result.json, resolved.yaml, trajectory.csv, figure.png and cameras/");
  run.Flag("--video", shown.video, "Also make video.mp4 in the folder").Needs(out);
  run.Flag("--report", shown.report, "Also make report.html, one page to look at, in the folder")
      .Needs(out);
  run.Flag("--motion", shown.motion,
           "Also make motion.csv in the folder: motion, thrust and water at every physics step")
      .Needs(out);
  run.AddFigure(shown.figure, "Draw the trial");
  run.AddJson(shown.json);
  run.AddQuiet(shown.quiet);
  std::vector<std::string> outcomes;
  outcomes.reserve(EnumNames<trial::Outcome>::kNames.size());
  for (const auto& [outcome, name] : EnumNames<trial::Outcome>::kNames)
    if (trial::HasEnd(outcome)) outcomes.push_back(name);
  run.Add("--expect", arguments.expect, "Exit with 1 when the trial ends otherwise")
      .OneOf(outcomes);
}

}  // namespace turbidock::run
