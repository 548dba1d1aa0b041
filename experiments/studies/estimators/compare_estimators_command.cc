#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/job_arguments.h"
#include "experiments/app/progress.h"
#include "experiments/app/report_output.h"
#include "experiments/studies/estimators/compare_estimators.h"
#include "sim/light/optics_params.h"

namespace turbidock::estimators {
namespace {

struct CompareArguments {
  CompareOptions options;
  std::string seed;
  app::JobArguments jobs;
  bool json = false, quiet = false;
};

int Compare(const CompareArguments& arguments) {
  CompareOptions options = arguments.options;
  if (!arguments.seed.empty()) options.assignments.push_back("seed=" + arguments.seed);
  app::Progress progress(arguments.quiet);
  options.on_progress = [&](int done, int of) { progress.ShowDone(done, of, "starts", 30); };
  options.jobs =
      arguments.jobs.For("", [&](const std::string& text) { progress.Say("  " + text); });
  // whose tasks are to be cancelled
  if (options.jobs.slurm) options.stop_requested = app::CatchStopSignals();
  const std::vector<CompareCell> cells = CompareEstimators(options);
  if (app::StopSignal() != 0) return app::kExitDone;  // main makes the signal's code of it
  app::PrintReport(ReportOf(cells), {{"cells", cells}}, arguments.json);
  return app::kExitDone;
}

}  // namespace

void AddCompareEstimators(app::CommandLine& line) {
  auto [compare, arguments] = line.Add<CompareArguments>(
      "compare-estimators",
      "Count how often estimators are right, and wrong and sure, from cold starts over distance "
      "and milk",
      &Compare);
  CompareOptions& options = arguments.options;
  options.plugins = line.plugins();
  compare.Add("scenario", options.scenarios, "YAML files or names of bundled scenarios");
  compare.Add("--estimators NAME,...", options.estimators,
              "Values of pose_estimator, plug-ins among them; the scenario's own unless given");
  compare.Add("--distances MM,...", options.distances_mm, "Distances in mm").Between(200, 3000);
  compare.Add("--milk ML_M3,...", options.milk_ml_m3, "Milk in ml/m3")
      .Between(0, light::kMaxMilk_ml_m3);
  compare.Add("--starts", options.starts, "Poses at each distance and milk, each a cold start")
      .Between(1, 10000);
  compare.Add("--frames", options.frames, "Frames that each estimator gets of a pose")
      .Between(1, 1000);
  compare.Add("--right-mm", options.right_mm, "Largest error of a right estimate").Positive();
  compare.Add("--right-deg", options.right_deg, "The same for rotation").Positive();
  arguments.jobs.AddTo(&compare, "Processes; the results are the same", 1);
  compare.AddSeed(arguments.seed);
  compare.AddSet(options.assignments, "Set one key of the scenarios, such as their faults");
  compare.AddJson(arguments.json);
  compare.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::estimators
