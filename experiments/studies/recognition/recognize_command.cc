#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/farm_arguments.h"
#include "experiments/app/progress.h"
#include "experiments/media/figure.h"
#include "experiments/studies/recognition/figure.h"
#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/report.h"
#include "experiments/studies/recognition/table.h"
#include "experiments/system/output_path.h"
#include "sim/base/units.h"

namespace turbidock::recognition {
namespace {

// Steps of milk in a contact sheet.
constexpr int kContactSheetColumns = 5;
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

// "FILE.png" with words before the dot; without an extension of its own it is .png.
std::string Beside(const std::string& figure, const std::string& words,
                   const std::string& ending = "") {
  const std::filesystem::path path(figure);
  const std::string own = path.has_extension() ? path.extension().string() : ".png";
  return (path.parent_path() / (path.stem().string() + words + (ending.empty() ? own : ending)))
      .string();
}

// F over milk, areas, F over time, and a contact sheet of each marker.
std::vector<std::string> FigureFiles(const std::string& figure,
                                     const std::vector<MarkerKind>& markers) {
  std::vector<std::string> files = {Beside(figure, ""), Beside(figure, "_areas"),
                                    Beside(figure, "_time")};
  for (const MarkerKind marker : markers)
    files.push_back(Beside(figure, fmt::format("_images_{}", NameOf(marker)), ".png"));
  return files;
}

std::vector<std::string> WriteFigures(const std::string& figure, const Recognition& recognition,
                                      const std::vector<CellResult>& results) {
  std::map<MarkerKind, std::vector<CellResult>> by_marker;
  for (const CellResult& r : results) by_marker[r.cell.marker].push_back(r);
  std::vector<TableRow> published;
  for (const auto& [marker, of_marker] : by_marker)
    for (const TableRow& row : PublishedTable(marker)) published.push_back(row);

  std::vector<MarkerKind> markers;
  for (const auto& [marker, of_marker] : by_marker) markers.push_back(marker);
  const std::vector<std::string> files = FigureFiles(figure, markers);
  WriteFitnessFigure(files[0], results, published);
  WriteAreaFigure(files[1], results, published);
  WriteTimeFigure(files[2], results,
                  recognition.scenario(results.front().cell.marker).clock.frames_per_second);
  size_t sheet = files.size() - markers.size();
  for (const auto& [marker, of_marker] : by_marker)
    WriteContactSheet(files[sheet++], recognition, of_marker, kContactSheetColumns);
  return files;
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
    const std::vector<std::string> files = FigureFiles(arguments.figure, markers);
    media::RequireFigurePath(files.front());
    for (const std::string& file : files) outputs.Writes(file);
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
       .run = {.workers = farm.workers,
               .on_progress = [&](int done,
                                  int of) { progress.ShowDone(done, of, "cells", kCellsEvery_s); },
               // whose tasks are to be cancelled
               .stop_requested = farm.slurm ? app::CatchStopSignals() : nullptr},
       .slurm = farm.slurm});
  if (app::StopSignal() != 0) return app::kExitDone;  // main makes the signal's code of it

  std::optional<TableComparison> comparison;
  if (!table.empty()) comparison = Compare(results, table);
  progress.Say(RecognitionText(results, table, comparison));
  if (!arguments.csv.empty()) system::WriteWhole(arguments.csv, RecognitionCsv(results, table));
  if (arguments.json) std::fputs(RecognitionJson(results, table, comparison).c_str(), stdout);
  if (!arguments.figure.empty())
    for (const std::string& file : WriteFigures(arguments.figure, recognition, results))
      progress.Say("  " + file);
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
  recognize.Add("--figure FILE", arguments.figure,
                "Draw FILE (F over milk; .png, .svg or .pdf), FILE_areas, FILE_time and\n"
                "FILE_images_MARKER.png");
  recognize.AddJson(arguments.json);
  recognize.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::recognition
