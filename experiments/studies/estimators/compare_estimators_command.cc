
#include <cstdio>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/farm_arguments.h"
#include "experiments/app/progress.h"
#include "experiments/media/figure.h"
#include "experiments/studies/estimators/compare_estimators.h"
#include "experiments/system/output_path.h"
#include "sim/base/units.h"

namespace turbidock::estimators {
namespace {

struct CompareArguments {
  CompareOptions options;
  std::string marker = "both", task = "still", seed;
  std::vector<double> distances_mm;
  double found_mm = 20, found_deg = 5;
  std::string csv, figure;
  app::FarmArguments farm;
  bool json = false, quiet = false;
};

int Compare(const CompareArguments& arguments) {
  CompareOptions options = arguments.options;
  if (!arguments.seed.empty()) options.assignments.push_back("seed=" + arguments.seed);
  options.markers = recognition::MarkersOf(arguments.marker);
  for (const auto& [task, name] : EnumNames<CompareTask>::kNames)
    if (arguments.task == name) options.task = task;
  if (!arguments.distances_mm.empty()) {
    options.distances_m.clear();
    for (const double mm : arguments.distances_mm) options.distances_m.push_back(mm / 1000);
  }
  options.found_m = arguments.found_mm / 1000;
  options.found_rad = units::RadFromDeg(arguments.found_deg);
  if (!arguments.figure.empty()) media::RequireFigurePath(arguments.figure);
  system::OutputPlan().Writes(arguments.csv).Writes(arguments.figure).Require();

  app::Progress progress(arguments.quiet);
  options.run.on_progress = [&](int done, int of) {
    progress.ShowDone(done, of, "parts done", 30);
  };
  const farm::FarmOptions farm = arguments.farm.For(
      arguments.csv, [&](const std::string& text) { progress.Say("  " + text); });
  options.run.workers = farm.workers;
  options.slurm = farm.slurm;
  // whose tasks are to be cancelled
  if (farm.slurm) options.run.stop_requested = app::CatchStopSignals();
  const std::vector<CompareRow> rows = CompareEstimators(options);
  if (app::StopSignal() != 0) return app::kExitDone;  // main makes the signal's code of it
  progress.Say(CompareText(rows));
  if (!arguments.csv.empty()) system::WriteWhole(arguments.csv, CompareCsv(rows));
  if (arguments.json) std::fputs(CompareJson(rows).c_str(), stdout);
  if (!arguments.figure.empty()) WriteCompareFigure(arguments.figure, rows);
  return app::kExitDone;
}

}  // namespace

void AddCompareEstimators(app::CommandLine& line) {
  auto [compare, arguments] = line.Add<CompareArguments>(
      "compare-estimators",
      "Compare pose estimators on the same simulated frames, over distance and milk", &Compare);
  arguments.options.plugins = line.plugins();
  CompareOptions& options = arguments.options;
  compare
      .Add("--task", arguments.task,
           "The marker: still; anywhere in the search range (where F >= 0.6); moving at "
           "0.2 m/s and 20 deg/s (worst error from frame 30 on); absent")
      .OneOf({"still", "anywhere", "moving", "absent"});
  compare
      .Add("--marker", arguments.marker,
           "active, passive, both of these, fiducial (tags beside the painted balls) or all")
      .OneOf({"active", "passive", "both", "fiducial", "all"});
  compare
      .Add("--distances MM,...", arguments.distances_mm,
           "Distances in mm; 400,600,800,1000 unless given")
      .Between(200, 3000);
  compare.Add("--milk ML_M3,...", options.milk_ml_m3, "Milk in ml/m3")
      .Between(0, light::kMaxMilk_ml_m3);
  compare.Add("--estimators NAME,...", options.estimators,
              "Which: default, search (without refinement), published, de, pso, cmaes, blobs, "
              "fiducial (where there are tags), and this program's own; "
              "the first three also with keys of the search, as default/creep_share=0");
  compare.Add("--starts", options.starts, "Poses at each distance and milk, each a cold start")
      .Between(1, 10000);
  compare.Add("--frames", options.frames, "Frames that each estimator gets of a pose")
      .Between(1, 1000);
  compare.Add("--found-mm", arguments.found_mm, "Largest error of what counts as found").Positive();
  compare.Add("--found-deg", arguments.found_deg, "The same for rotation").Positive();
  arguments.farm.AddTo(&compare, "Processes that share the work", 1);
  compare.AddSeed(arguments.seed);
  compare.AddSet(options.assignments, "Set one key of the scenarios");
  compare.Add("--csv", arguments.csv, "Write a line for each cell and estimator");
  compare.Add("--figure FILE", arguments.figure,
              "Draw share found and error over milk: .png, .svg or .pdf");
  compare.AddJson(arguments.json);
  compare.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::estimators
