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

namespace turbidock::recognition {
namespace {

struct RecognizeArguments {
  command::PlanArguments plan;
  std::string active, passive;
  RecognitionOptions options;
  command::JobArguments jobs;
  std::string figure;
  bool json = false, quiet = false;
};

// FILE_images_MARKER.png beside FILE; nothing where there is no figure.
std::string SheetFile(const std::filesystem::path& figure, MarkerKind marker) {
  if (figure.empty()) return "";
  return figure.parent_path() /
         fmt::format("{}_images_{}.png", figure.stem().string(), NameOf(marker));
}

int Recognize(const RecognizeArguments& arguments) {
  RecognitionOptions options = arguments.options;
  const batch::Plan plan = arguments.plan.Load();
  // F of another estimator than the published one is another measure.
  bool compared = true;
  for (int64_t cell = 0; cell < plan.cells(); ++cell)
    compared &= plan.ScenarioOf(plan.FirstOf(cell)).estimator_name() == "rm_ga";
  compared |= !arguments.active.empty() || !arguments.passive.empty();
  const std::vector<TableRow> tables =
      compared ? ReadTables(arguments.active, arguments.passive) : std::vector<TableRow>();
  system::OutputPlan outputs;
  outputs.Reads(arguments.plan.plan)
      .Reads(plan.files())
      .Reads({arguments.active, arguments.passive})
      .Writes(options.file, system::kResultFile)
      .Writes(arguments.figure);
  for (const auto& [marker, name] : EnumNames<MarkerKind>::kNames)
    outputs.Writes(SheetFile(arguments.figure, marker));
  outputs.Require();

  command::Progress progress(arguments.quiet);
  progress.Say(
      fmt::format("{}: {} trials of {:g} s", plan.title(), plan.trials(), options.seconds));
  for (const std::string& remark : plan.remarks()) progress.Say("  " + remark);
  options.jobs =
      arguments.jobs.For(options.file, [&](const std::string& text) { progress.Say("  " + text); });
  options.on_progress = [&](int done, int of) { progress.ShowDone(done, of, "trials", 30); };
  if (!options.file.empty()) options.stop_requested = command::CatchStopSignals();
  const std::vector<CellResult> results = Recognize(plan, options);
  if (command::StopSignal() != 0) {  // main makes the signal's code of it
    progress.Say(fmt::format("stopped: the trials so far are in {}; the same command goes on",
                             options.file));
    return command::kExitDone;
  }

  const report::Report report = ReportOf(results, tables);
  command::PrintReport(report, ResultJson(results, tables), arguments.json);
  if (arguments.figure.empty()) return command::kExitDone;
  media::WriteFigure(arguments.figure, media::FigureOf(report));
  for (const auto& [marker, columns] : ColumnsOf(results, {}))
    WriteImageSheet(SheetFile(arguments.figure, marker), plan, marker, results);
  return command::kExitDone;
}

}  // namespace

void AddRecognize(command::CommandLine& line) {
  auto [recognize, arguments] = line.Add<RecognizeArguments>(
      "recognize", "Run the recognition experiment: a vehicle at rest where a trial begins",
      &Recognize);
  arguments.plan.AddTo(&recognize, line.plugins());
  arguments.plan.overrides.refused = RefusedKeys();
  recognize.Add(
      "--active FILE", arguments.active,
      "CSV (milk_ml_m3,distance_mm,fitness_mean,...) to compare the active marker with; the "
      "published one unless given");
  recognize.Add("--passive FILE", arguments.passive,
                "CSV to compare the passive marker with, likewise");
  recognize.Add("--seconds", arguments.options.seconds, "Time a trial is watched")
      .Between(0.02, 3600);
  arguments.jobs.AddTo(&recognize, "Processes; the results are the same");
  recognize.Add("--out FILE", arguments.options.file,
                "Keep every result: interrupted, the same command runs the rest");
  recognize.AddFigure(arguments.figure,
                      "Draw the plots into FILE, what the cameras see into FILE_images_MARKER.png");
  recognize.AddJson(arguments.json);
  recognize.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::recognition
