#include "experiments/studies/estimators/compare_estimators_command.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "experiments/app/progress.h"
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
  bool json = false, quiet = false;
};

int Compare(const CompareArguments& arguments) {
  CompareOptions options = arguments.options;
  if (!arguments.seed.empty()) options.assignments.push_back("seed=" + arguments.seed);
  if (arguments.marker != "both") {
    options.markers.clear();
    for (const auto& [marker, name] : EnumNames<recognition::MarkerKind>::kNames)
      if (arguments.marker == name) options.markers.push_back(marker);
  }
  for (const auto& [task, name] : EnumNames<CompareTask>::kNames)
    if (arguments.task == name) options.task = task;
  if (!arguments.distances_mm.empty()) {
    options.distances_m.clear();
    for (const double mm : arguments.distances_mm) options.distances_m.push_back(mm / 1000);
  }
  options.found_m = arguments.found_mm / 1000;
  options.found_rad = units::RadFromDeg(arguments.found_deg);
  if (!arguments.csv.empty()) system::RequireWritable(arguments.csv);
  if (!arguments.figure.empty()) system::RequireWritable(arguments.figure);

  app::Progress progress(arguments.quiet);
  options.run.on_progress = [&](int done, int of) {
    progress.ShowDone(done, of, "parts done", 30);
  };
  options.run.stop_requested = [] { return app::StopSignal() != 0; };
  const std::vector<CompareRow> rows = CompareEstimators(options);
  if (rows.empty()) return app::kExitDone;  // stopped: the program ends with the signal's code
  progress.Say(CompareText(rows));
  if (!arguments.csv.empty()) system::WriteWhole(arguments.csv, CompareCsv(rows));
  if (arguments.json) std::fputs(CompareJson(rows).c_str(), stdout);
  if (!arguments.figure.empty()) WriteCompareFigure(arguments.figure, rows);
  return app::kExitDone;
}

}  // namespace

void AddCompareEstimators(app::CommandLine& line) {
  auto arguments = std::make_shared<CompareArguments>();
  CompareOptions& options = arguments->options;
  app::Subcommand compare =
      line.Add("compare-estimators",
               "Compare pose estimators on the same simulated frames, over distance and milk");
  compare
      .Add("--task", arguments->task,
           "The marker: still; anywhere in the search range (where F >= 0.6); moving at "
           "0.2 m/s and 20 deg/s (worst error from frame 30 on); absent")
      .OneOf({"still", "anywhere", "moving", "absent"})
      .ShowsDefault();
  compare.Add("--marker", arguments->marker, "active, passive or both")
      .OneOf({"active", "passive", "both"})
      .ShowsDefault();
  compare
      .Add("--distances", arguments->distances_mm,
           "Distances in mm, comma separated; 400,600,800,1000 unless given")
      .ListOf(',')
      .Between(200.0, 3000.0);
  compare.Add("--milk", options.milk_ml_m3, "Milk in ml/m3, comma separated")
      .ListOf(',')
      .Between(0.0, light::kMostMilk_ml_m3)
      .ShowsDefault();
  compare
      .Add("--estimators", options.estimators,
           "Which: default, search (without refinement), published, de, pso, cmaes, blobs; "
           "the first three also with keys of the search, as default/creep_share=0")
      .ListOf(',');
  compare.Add("--starts", options.starts, "Poses at each distance and milk, each a cold start")
      .Between(1, 10000)
      .ShowsDefault();
  compare.Add("--frames", options.frames, "Frames that each estimator gets of a pose")
      .Between(1, 1000)
      .ShowsDefault();
  compare.Add("--found-mm", arguments->found_mm, "Largest error of what counts as found")
      .Positive()
      .ShowsDefault();
  compare.Add("--found-deg", arguments->found_deg, "The same for rotation")
      .Positive()
      .ShowsDefault();
  compare.Add("--workers", options.run.workers, "Processes that share the work")
      .Between(1, 256)
      .ShowsDefault();
  compare.Add("--seed", arguments->seed, "Root of all randomness; as --set seed=N");
  compare.Add("--set", options.assignments, "Set one key of the scenarios; may be repeated")
      .Type("KEY=VALUE")
      .OneValueEach();
  compare.Add("--csv", arguments->csv, "Write a line for each cell and estimator");
  compare.Add("--figure", arguments->figure, "Draw share found and error over milk (PNG)");
  compare.Flag("--json", arguments->json, "Print the result as JSON on stdout");
  compare.Flag("--quiet", arguments->quiet, "Print nothing on stderr but errors");
  compare.Runs([arguments] { return Compare(*arguments); });
}

}  // namespace turbidock::estimators
