#include <fmt/format.h>

#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/farm_arguments.h"
#include "experiments/app/progress.h"
#include "experiments/config/data_files.h"
#include "experiments/report/json.h"
#include "experiments/report/table.h"
#include "experiments/studies/recognition/calibration.h"
#include "experiments/studies/recognition/table.h"
#include "experiments/system/output_path.h"
#include "sim/base/fields.h"
#include "sim/base/units.h"

namespace turbidock::recognition {
namespace {

using report::Json;

// Between two lines of progress off a terminal.
constexpr double kLogEvery_s = 60;

struct CalibrateArguments {
  std::string plan, active, passive, out;
  int generations = 30;
  app::FarmArguments farm;
  uint32_t seed = 1;
  double seconds = 5;
  bool json = false, quiet = false;
};

// The full experiment on the tables' cells, under the values found.
std::map<MarkerKind, TableComparison> Confirm(const TableByMarker& tables,
                                              const std::vector<std::string>& assignments,
                                              double seconds, const farm::FarmOptions& farm) {
  std::map<MarkerKind, TableComparison> confirmed;
  for (const auto& [marker, table] : tables) {
    if (app::StopSignal() != 0) break;
    const Recognition recognition({{marker, RecognitionScenario(marker, assignments)}},
                                  CellsOf(table));
    const std::vector<CellResult> results = recognition.Run(
        {.seconds = seconds,
         .run = {.workers = farm.workers, .stop_requested = app::CatchStopSignals()},
         .slurm = farm.slurm});
    if (!results.empty()) confirmed[marker] = Compare(results, table);
  }
  return confirmed;
}

Json ToJson(const CalibrationPlan& plan, const CalibrationResult& result,
            const std::vector<TableRow>& rows,
            const std::map<MarkerKind, TableComparison>& confirmed) {
  Json parameters = Json::array(), residuals = Json::array(), full = Json::object(),
       front = Json::array();
  for (size_t i = 0; i < plan.parameters.size(); ++i) {
    const FreeParameter& p = plan.parameters[i];
    parameters.push_back({{"key", p.key},
                          {"value", result.best.values[i]},
                          {"low", p.low},
                          {"high", p.high},
                          {"misfit_lower", result.misfit_beside[i].first},
                          {"misfit_higher", result.misfit_beside[i].second},
                          {"source", p.source}});
  }
  for (size_t i = 0; i < rows.size(); ++i)
    residuals.push_back({{"marker", rows[i].cell.marker},
                         {"milk_ml_m3", rows[i].cell.milk_ml_m3},
                         {"distance_mm", units::MmFromM(rows[i].cell.distance_m)},
                         {"fitness", result.best.fitness[i]},
                         {"reference_mean", rows[i].fitness_mean}});
  for (const auto& [marker, comparison] : confirmed)
    full[NameOf(marker)] = TableConstraints(marker, comparison, plan.accepted);
  for (const Evaluation& evaluation : result.front) {
    Json misfits = Json::array();
    for (const Constraint& c : evaluation.constraints) misfits.push_back(c.misfit);
    front.push_back({{"values", evaluation.values}, {"misfits", misfits}});
  }
  return {{"parameters", parameters},
          {"misfit", result.misfit},
          {"evaluations", result.evaluations},
          {"constraints", result.best.constraints},
          {"pulls", PullsOf(result)},
          {"front", front},
          {"residuals", residuals},
          {"confirmed", full}};
}

std::string Text(const CalibrationPlan& plan, const CalibrationResult& result,
                 const std::map<MarkerKind, TableComparison>& confirmed) {
  std::string text = fmt::format("misfit {:.3f} of the searched cells, evaluations: {}\n",
                                 result.misfit, result.evaluations);
  report::Table parameters({"<parameter", "value", "range", "misfit 5 % of it lower", "higher"});
  for (size_t i = 0; i < plan.parameters.size(); ++i) {
    const FreeParameter& p = plan.parameters[i];
    std::vector<report::Cell> row = {p.key, fmt::format("{:.5g}", result.best.values[i]),
                                    fmt::format("{:g} to {:g}", p.low, p.high), "", ""};
    if (i < result.misfit_beside.size()) {
      row[3] = report::Fixed(result.misfit_beside[i].first, 3);
      row[4] = report::Fixed(result.misfit_beside[i].second, 3);
    }
    parameters.Row(std::move(row));
  }
  report::Table constraints(
      {"<constraint", "value", "misfit", "least on the front", "<there worse by most", "to"});
  const std::vector<Pull> pulls = PullsOf(result);
  for (size_t i = 0; i < pulls.size(); ++i)
    constraints.Row({pulls[i].constraint, report::Fixed(result.best.constraints[i].value, 3),
                     report::Fixed(pulls[i].misfit, 2), report::Fixed(pulls[i].least_misfit, 2),
                     pulls[i].against,
                     pulls[i].against.empty() ? "" : report::Fixed(pulls[i].against_misfit, 2)});
  text += parameters.Text() + constraints.Text();
  for (const auto& [marker, comparison] : confirmed) {
    report::Table full({"<full experiment", "value", "misfit"});
    for (const Constraint& c : TableConstraints(marker, comparison, plan.accepted))
      full.Row({c.name, report::Fixed(c.value, 3), report::Fixed(c.misfit, 2)});
    text += full.Text();
  }
  text.pop_back();
  return text;
}

int Calibrate(const CalibrateArguments& arguments) {
  const std::string plan_file =
      arguments.plan.empty() ? config::AssetPath("calibration.yaml") : arguments.plan;
  const CalibrationPlan plan = LoadCalibrationPlan(plan_file);
  const auto table = [](const std::string& path, MarkerKind marker) {
    return path.empty() ? PublishedTable(marker) : ReadRecognitionTable(path, marker);
  };
  const TableByMarker tables = {
      {MarkerKind::kActive, table(arguments.active, MarkerKind::kActive)},
      {MarkerKind::kPassive, table(arguments.passive, MarkerKind::kPassive)}};
  system::OutputPlan()
      .Reads(plan_file)
      .Reads(arguments.active)
      .Reads(arguments.passive)
      .Writes(arguments.out)
      .Require();
  const auto experiment = [&] {
    try {
      return std::make_shared<CalibrationExperiment>(plan, tables);
    } catch (const ConfigError& error) {  // of a key that the plan names
      throw ConfigError(plan_file + ": " + error.what());
    }
  }();
  app::Progress progress(arguments.quiet);
  progress.Say(fmt::format("{} parameters, {} cells of two tables", plan.parameters.size(),
                           experiment->rows().size()));
  const farm::FarmOptions farm = arguments.farm.For(
      arguments.out, [&](const std::string& text) { progress.Say("  " + text); });
  const CalibrationResult result = Calibrate(
      {.generations = arguments.generations,
       .seed = arguments.seed,
       .farm = farm,
       .on_progress =
           [&](int done, int of, double misfit) {
             progress.ShowDone(done, of, fmt::format("evaluations, misfit {:.3f}", misfit),
                               kLogEvery_s);
           },
       .stop_requested = app::CatchStopSignals()},
      experiment);
  if (result.evaluations == 0) return app::kExitDone;  // stopped before there was anything to keep
  if (!arguments.out.empty())
    system::WriteWhole(
        arguments.out,
        fmt::format("# Result of `turbidock calibrate`: misfit {:.3f} of the searched cells, "
                    "evaluations: {}.\n",
                    result.misfit, result.evaluations) +
            CalibratedYaml(plan, result.best.values));
  if (app::StopSignal() != 0) {  // the best so far
    progress.Say(Text(plan, result, {}));
    return app::kExitDone;
  }

  const std::vector<std::string> assignments = plan.Assignments(result.best.values);
  std::map<MarkerKind, TableComparison> confirmed;
  if (arguments.seconds > 0) confirmed = Confirm(tables, assignments, arguments.seconds, farm);
  progress.Say(Text(plan, result, confirmed));
  if (arguments.json)
    std::fputs(report::JsonText(ToJson(plan, result, experiment->rows(), confirmed)).c_str(),
               stdout);
  return app::kExitDone;
}

}  // namespace

void AddCalibrate(app::CommandLine& line) {
  auto [calibrate, arguments] = line.Add<CalibrateArguments>(
      "calibrate", "Fit uncertain optical and camera parameters to tables of the experiment",
      &Calibrate);
  calibrate.Add("--plan FILE", arguments.plan,
                "YAML of what is searched and within which ranges; the bundled one unless given");
  calibrate.Add("--active FILE", arguments.active,
                "Table of the active marker; the published one unless given");
  calibrate.Add("--passive FILE", arguments.passive, "The same of the passive marker");
  calibrate
      .Add("--generations", arguments.generations,
           "Generations of CMA-ES, each evaluated side by side; 0: only what the start and "
           "its\nsides are worth")
      .Between(0, 10000);
  calibrate.Add("--seed", arguments.seed, "Of the search");
  arguments.farm.AddTo(&calibrate, "Processes; the result is the same", 1);
  calibrate
      .Add("--seconds", arguments.seconds,
           "Time a cell of the full experiment that confirms the result; 0: none")
      .Between(0, 3600);
  calibrate.Add("--out FILE", arguments.out, "Write the values found as a scenario's keys");
  calibrate.AddJson(arguments.json);
  calibrate.AddQuiet(arguments.quiet);
}

}  // namespace turbidock::recognition
