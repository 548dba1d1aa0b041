#include <fmt/format.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "experiments/command/command_line.h"
#include "experiments/command/job_arguments.h"
#include "experiments/command/progress.h"
#include "experiments/command/report_output.h"
#include "experiments/media/figure.h"
#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/table.h"
#include "experiments/system/output_path.h"
#include "sim/base/units.h"

namespace turbidock::recognition {
namespace {

struct RecognizeArguments {
  trial::Plugins plugins;
  std::string marker = "both";
  std::string table;
  std::vector<double> distances_mm = {400, 600, 800, 1000}, milk_ml_m3;
  std::vector<std::string> assignments;
  std::string seed;
  double seconds = 60;
  command::JobArguments jobs;
  std::string figure;
  bool json = false, quiet = false;
};

// Cells of the command line, by default at the milk of the published table.
std::vector<RecognitionCell> Grid(const RecognizeArguments& arguments, MarkerKind marker) {
  std::set<double> milk(arguments.milk_ml_m3.begin(), arguments.milk_ml_m3.end());
  if (milk.empty())
    for (const TableRow& row : PublishedTable(marker)) milk.insert(row.cell.milk_ml_m3);
  std::vector<RecognitionCell> cells;
  for (const double mm : arguments.distances_mm)
    for (const double ml_m3 : milk) cells.push_back({marker, ml_m3, units::MFromMm(mm)});
  return cells;
}

// FILE_images_MARKER.png beside FILE; nothing where there is no figure.
std::string SheetFile(const std::filesystem::path& figure, MarkerKind marker) {
  if (figure.empty()) return "";
  return figure.parent_path() /
         fmt::format("{}_images_{}.png", figure.stem().string(), NameOf(marker));
}

int Recognize(const RecognizeArguments& arguments) {
  if (!arguments.table.empty() && arguments.marker == "both")
    throw ConfigError("--table needs --marker active or --marker passive: a table is of one");
  std::vector<std::string> assignments = arguments.assignments;
  if (!arguments.seed.empty()) assignments.push_back("seed=" + arguments.seed);
  system::OutputPlan outputs;
  outputs.Reads(arguments.table).Writes(arguments.figure);
  Scenarios scenarios;
  std::vector<RecognitionCell> cells;
  std::vector<TableRow> table;
  for (const auto& [marker, name] : EnumNames<MarkerKind>::kNames) {
    if (arguments.marker != name && arguments.marker != "both") continue;
    scenarios.emplace(marker, RecognitionScenario(marker, assignments, arguments.plugins));
    outputs.Writes(SheetFile(arguments.figure, marker));
    if (!arguments.table.empty()) {
      table = ReadRecognitionTable(arguments.table, marker);
      for (const TableRow& row : table) cells.push_back(row.cell);
      continue;
    }
    for (const RecognitionCell& cell : Grid(arguments, marker)) cells.push_back(cell);
  }
  outputs.Require();

  command::Progress progress(arguments.quiet);
  progress.Say(fmt::format("{} cells of {:g} s", cells.size(), arguments.seconds));
  RecognitionOptions options{.seconds = arguments.seconds};
  options.jobs =
      arguments.jobs.For("", [&](const std::string& text) { progress.Say("  " + text); });
  options.on_progress = [&](int done, int of) { progress.ShowDone(done, of, "cells", 30); };
  // whose tasks are to be cancelled
  if (options.jobs.slurm) options.stop_requested = command::CatchStopSignals();
  const std::vector<CellResult> results = RunCells(scenarios, cells, options);
  if (command::StopSignal() != 0) return command::kExitDone;  // main makes the signal's code of it

  const report::Report report = ReportOf(results, table);
  command::PrintReport(report, ResultJson(results, table), arguments.json);
  if (arguments.figure.empty()) return command::kExitDone;
  media::WriteFigure(arguments.figure, media::FigureOf(report));
  for (const auto& [marker, scenario] : scenarios)
    WriteImageSheet(SheetFile(arguments.figure, marker), scenario, marker, results);
  return command::kExitDone;
}

}  // namespace

void AddRecognize(command::CommandLine& line) {
  auto [recognize, arguments] = line.Add(
      "recognize", "Run the recognition experiment: a vehicle at rest, milk added step by step",
      &Recognize);
  arguments.plugins = line.plugins();
  recognize.Add("--marker", arguments.marker, "active, passive or both")
      .OneOf({"active", "passive", "both"});
  const command::Option table = recognize.Add(
      "--table FILE", arguments.table,
      "CSV of one marker (milk_ml_m3,distance_mm,fitness_mean,...): run its cells and compare");
  recognize.Add("--distances MM,...", arguments.distances_mm, "Distances in mm")
      .Between(kNearest_mm, kFarthest_mm)
      .Excludes(table);
  recognize
      .Add("--milk ML_M3,...", arguments.milk_ml_m3,
           "Milk in ml/m3; the published steps unless given")
      .Between(0, light::kMaxMilk_ml_m3)
      .Excludes(table);
  recognize.Add("--seconds", arguments.seconds, "Time a cell is watched").Between(0.02, 3600);
  arguments.jobs.AddTo(&recognize, "Processes; the results are the same");
  recognize.AddSet(
      arguments.assignments,
      "Set one key of the scenarios pool_active and pool_passive, such as pose_estimator");
  recognize.AddSeed(arguments.seed);
  recognize.AddFigure(arguments.figure,
                      "Draw the plots into FILE, what the cameras see into FILE_images_MARKER.png");
  recognize.AddJson(arguments.json);
  recognize.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::recognition
