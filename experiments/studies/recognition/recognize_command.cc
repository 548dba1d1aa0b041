#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/job_arguments.h"
#include "experiments/app/print_report.h"
#include "experiments/app/progress.h"
#include "experiments/media/figure.h"
#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/report.h"
#include "experiments/studies/recognition/table.h"
#include "experiments/system/output_path.h"
#include "sim/base/units.h"

namespace turbidock::recognition {
namespace {

constexpr int kSheetColumns = 5;      // steps of milk in a sheet of images, at most
constexpr double kCellsEvery_s = 30;  // between two lines of progress off a terminal

struct RecognizeArguments {
  std::string marker = "both";
  std::string table;
  std::vector<double> distances_mm = {400, 600, 800, 1000}, milk_ml_m3;
  std::vector<std::string> assignments;
  std::string seed;
  double seconds = 60;
  app::JobArguments jobs;
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

// FILE_images_MARKER.png beside FILE.
std::string SheetFile(const std::string& figure, MarkerKind marker) {
  const std::filesystem::path path(figure);
  return path.parent_path() / fmt::format("{}_images_{}.png", path.stem().string(), NameOf(marker));
}

// All plots, and a sheet of images of each marker.
void WriteFigures(const std::string& figure, const report::Report& report,
                  const Recognition& recognition, const std::vector<CellResult>& results) {
  media::WriteFigure(figure, media::FigureOf(report));
  std::map<MarkerKind, std::vector<CellResult>> by_marker;
  for (const CellResult& r : results) by_marker[r.cell.marker].push_back(r);
  for (const auto& [marker, of_marker] : by_marker)
    WriteImageSheet(SheetFile(figure, marker), recognition, of_marker, kSheetColumns);
}

int Recognize(const RecognizeArguments& arguments) {
  if (!arguments.table.empty() && arguments.marker == "both")
    throw ConfigError("--table needs --marker active or --marker passive: a table is of one");
  std::vector<std::string> assignments = arguments.assignments;
  if (!arguments.seed.empty()) assignments.push_back("seed=" + arguments.seed);
  system::OutputPlan outputs;
  outputs.Reads(arguments.table).Writes(arguments.figure);
  std::map<MarkerKind, trial::Scenario> scenarios;
  std::vector<RecognitionCell> cells;
  std::vector<TableRow> table;
  for (const auto& [marker, name] : EnumNames<MarkerKind>::kNames) {
    if (arguments.marker != name && arguments.marker != "both") continue;
    scenarios.emplace(marker, RecognitionScenario(marker, assignments));
    if (!arguments.table.empty()) table = ReadRecognitionTable(arguments.table, marker);
    for (const RecognitionCell& cell : table.empty() ? Grid(arguments, marker) : CellsOf(table))
      cells.push_back(cell);
    if (!arguments.figure.empty()) outputs.Writes(SheetFile(arguments.figure, marker));
  }
  outputs.Require();

  const Recognition recognition(std::move(scenarios), cells);
  app::Progress progress(arguments.quiet);
  progress.Say(fmt::format("{} cells of {:g} s", cells.size(), arguments.seconds));
  const batch::JobOptions jobs =
      arguments.jobs.For("", [&](const std::string& text) { progress.Say("  " + text); });
  const std::vector<CellResult> results = recognition.Run(
      {.seconds = arguments.seconds,
       .jobs = jobs,
       .on_progress = [&](int done,
                          int of) { progress.ShowDone(done, of, "cells", kCellsEvery_s); },
       // whose tasks are to be cancelled
       .stop_requested = jobs.slurm ? app::CatchStopSignals() : nullptr});
  if (app::StopSignal() != 0) return app::kExitDone;  // main makes the signal's code of it

  const report::Report report = ReportOf(results, table);
  app::PrintReport(report, ResultJson(results, table), arguments.json);
  if (!arguments.figure.empty()) WriteFigures(arguments.figure, report, recognition, results);
  return app::kExitDone;
}

}  // namespace

void AddRecognize(app::CommandLine& line) {
  auto [recognize, arguments] = line.Add(
      "recognize", "Run the recognition experiment: a vehicle at rest, milk added step by step",
      &Recognize);
  recognize.Add("--marker", arguments.marker, "active, passive or both")
      .OneOf({"active", "passive", "both"});
  const app::Option table = recognize.Add(
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
  arguments.jobs.AddTo(&recognize, "Processes; the results are the same", 1);
  recognize.AddSet(arguments.assignments,
                   "Set one key of the scenarios pool_active and pool_passive");
  recognize.AddSeed(arguments.seed);
  recognize.AddFigure(arguments.figure,
                      "Draw the plots into FILE, what the cameras see into FILE_images_MARKER.png");
  recognize.AddJson(arguments.json);
  recognize.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::recognition
