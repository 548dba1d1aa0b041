#include <fmt/format.h>

#include <string>
#include <vector>

#include "experiments/command/command_line.h"
#include "experiments/command/job_arguments.h"
#include "experiments/command/progress.h"
#include "experiments/command/report_output.h"
#include "experiments/config/data_files.h"
#include "experiments/studies/recognition/calibration.h"
#include "experiments/studies/recognition/table.h"
#include "experiments/system/output_path.h"
#include "sim/base/units.h"

namespace turbidock::recognition {
namespace {

// Between two lines of progress off a terminal.
constexpr double kLogEvery_s = 60;

struct CalibrateArguments {
  std::string plan, active, passive, out;
  std::vector<double> leave_out_mm;
  int generations = 30;
  command::JobArguments jobs;
  uint32_t seed = 1;
  bool json = false, quiet = false;
};

int Calibrate(const CalibrateArguments& arguments) {
  const std::string plan_file =
      arguments.plan.empty() ? config::AssetPath("calibration.yaml") : arguments.plan;
  const CalibrationPlan plan = LoadCalibrationPlan(plan_file);
  const std::vector<TableRow> tables = ReadTables(arguments.active, arguments.passive);
  std::vector<double> left_out_m;
  for (const double mm : arguments.leave_out_mm) left_out_m.push_back(units::MFromMm(mm));
  const std::string file = arguments.out.empty() ? "" : arguments.out + ".evaluations.sqlite";
  system::OutputPlan()
      .Reads({plan_file, arguments.active, arguments.passive})
      .Writes(arguments.out)
      .Writes(file, system::kResultFile)
      .Require();
  const CalibrationExperiment experiment = [&] {
    try {
      return ExperimentOf(plan, Without(left_out_m, tables));
    } catch (const ConfigError& error) {  // of a key that the plan names
      throw ConfigError(plan_file + ": " + error.what());
    }
  }();
  command::Progress progress(arguments.quiet);
  progress.Say(fmt::format("{} parameters, two tables", plan.parameters.size()));
  const auto show = [&](int done, int of, double misfit) {
    progress.ShowDone(done, of, fmt::format("evaluations, misfit {:.3f}", misfit), kLogEvery_s);
  };
  CalibrationResult result =
      Calibrate({.generations = arguments.generations,
                 .seed = arguments.seed,
                 .file = file,
                 .jobs = arguments.jobs.For(
                     arguments.out, [&](const std::string& text) { progress.Say("  " + text); }),
                 .on_progress = show,
                 .stop_requested = command::CatchStopSignals()},
                experiment);
  if (result.evaluations == 0)
    return command::kExitDone;  // stopped before there was anything to keep
  if (result.is_complete)
    result.columns = ErrorsByColumn(plan, result.best.values, tables, left_out_m);
  if (!arguments.out.empty())
    system::WriteWhole(
        arguments.out,
        fmt::format("# Result of `turbidock calibrate`: misfit {:.3f} of the searched cells, "
                    "evaluations: {}.\n",
                    result.best.misfit, result.evaluations) +
            CalibratedYaml(plan, result.best.values));
  command::PrintReport(ReportOf(plan, result), ResultJson(plan, result), arguments.json);
  return command::kExitDone;
}

}  // namespace

void AddCalibrate(command::CommandLine& line) {
  auto [calibrate, arguments] = line.Add<CalibrateArguments>(
      "calibrate", "Fit uncertain optical and camera parameters to tables of the experiment",
      &Calibrate);
  calibrate.Add("--plan FILE", arguments.plan,
                "YAML of what is searched and within which ranges; the bundled one unless given");
  calibrate.Add("--active FILE", arguments.active,
                "Table of the active marker; the published one unless given");
  calibrate.Add("--passive FILE", arguments.passive, "Table of the passive marker, likewise");
  calibrate.Add("--leave-out MM", arguments.leave_out_mm,
                "Distances that take no part in the search; the error there is reported beside it");
  calibrate
      .Add("--generations", arguments.generations,
           "Generations of CMA-ES, each evaluated side by side; 0: only the start")
      .Between(0, 10000);
  calibrate.Add("--seed", arguments.seed, "Seed of the search");
  arguments.jobs.AddTo(&calibrate, "Processes; the result is the same");
  calibrate.Add("--out FILE", arguments.out,
                "Write the values found as a scenario's keys; FILE.evaluations.sqlite keeps every "
                "evaluation, and the same command goes on with it");
  calibrate.AddJson(arguments.json);
  calibrate.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::recognition
