#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/farm_arguments.h"
#include "experiments/app/print_report.h"
#include "experiments/app/progress.h"
#include "experiments/media/figure.h"
#include "experiments/studies/recognition/image_sheet.h"
#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/report.h"
#include "experiments/studies/recognition/table.h"
#include "experiments/system/output_path.h"
#include "sim/base/units.h"

namespace turbidock::recognition {
namespace {

constexpr int kSheetColumns = 5;      // steps of milk in a sheet of images
constexpr double kCellsEvery_s = 30;  // between two lines of progress off a terminal

struct RecognizeArguments {
  std::string marker = "both";
  std::string table;
  std::vector<double> distances_mm, milk_ml_m3;
  std::vector<std::string> assignments;
  std::string seed;
  double seconds = 60;
  app::FarmArguments farm;
  std::string csv, figure;
  bool json = false, quiet = false;
};

// Cells of the experiment as published, or of the command line.
std::vector<RecognitionCell> Grid(const RecognizeArguments& arguments,
                                  const std::vector<MarkerKind>& markers) {
  std::vector<double> distances_m = PublishedDistances();
  if (!arguments.distances_mm.empty()) {
    distances_m.clear();
    for (const double mm : arguments.distances_mm) distances_m.push_back(units::MFromMm(mm));
  }
  std::vector<RecognitionCell> cells;
  for (const MarkerKind marker : markers)
    for (const double distance_m : distances_m)
      for (const double milk :
           arguments.milk_ml_m3.empty() ? PublishedMilk(marker) : arguments.milk_ml_m3)
        cells.push_back({marker, milk, distance_m});
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
  const std::vector<MarkerKind> markers = MarkersOf(arguments.marker);
  std::vector<TableRow> table;
  std::vector<RecognitionCell> cells;
  if (arguments.table.empty()) {
    cells = Grid(arguments, markers);
  } else {
    table = ReadRecognitionTable(arguments.table, markers.front());
    cells = CellsOf(table);
  }
  system::OutputPlan outputs;
  outputs.Reads(arguments.table).Writes(arguments.csv);
  if (!arguments.figure.empty()) {
    outputs.Writes(arguments.figure);
    for (const MarkerKind marker : markers) outputs.Writes(SheetFile(arguments.figure, marker));
  }
  outputs.Require();

  std::map<MarkerKind, trial::Scenario> scenarios;
  for (const MarkerKind marker : markers)
    scenarios.emplace(marker, RecognitionScenario(marker, assignments));
  const Recognition recognition(std::move(scenarios), cells);
  app::Progress progress(arguments.quiet);
  progress.Say(fmt::format("{} cells of {:g} s", cells.size(), arguments.seconds));
  const farm::FarmOptions farm = arguments.farm.For(
      arguments.csv, [&](const std::string& text) { progress.Say("  " + text); });
  const std::vector<CellResult> results = recognition.Run(
      {.seconds = arguments.seconds,
       .farm = farm,
       .on_progress = [&](int done,
                          int of) { progress.ShowDone(done, of, "cells", kCellsEvery_s); },
       // whose tasks are to be cancelled
       .stop_requested = farm.slurm ? app::CatchStopSignals() : nullptr});
  if (app::StopSignal() != 0) return app::kExitDone;  // main makes the signal's code of it

  const report::Report report =
      ReportOf(results, table, recognition.scenario(markers.front()).clock.frames_per_second);
  app::PrintReport(report, ResultJson(results, table), arguments.json);
  if (!arguments.csv.empty()) system::WriteWhole(arguments.csv, RecognitionCsv(results, table));
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
  recognize
      .Add("--distances MM,...", arguments.distances_mm,
           "Distances in mm; 400,600,800,1000 unless given")
      .Excludes(table);
  recognize
      .Add("--milk ML_M3,...", arguments.milk_ml_m3,
           "Milk in ml/m3; the published steps unless given")
      .Excludes(table);
  recognize.Add("--seconds", arguments.seconds, "Time a cell is watched").Between(0.02, 3600);
  arguments.farm.AddTo(&recognize, "Processes; the results are the same", 1);
  recognize.AddSet(arguments.assignments,
                   "Set one key of the scenarios pool_active and pool_passive");
  recognize.AddSeed(arguments.seed);
  recognize.Add("--csv FILE", arguments.csv, "Write the cells to this file");
  recognize.AddFigure(arguments.figure,
                      "Draw the plots into FILE, what the cameras see into FILE_images_MARKER.png");
  recognize.AddJson(arguments.json);
  recognize.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::recognition
