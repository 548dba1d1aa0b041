#include <fmt/format.h>

#include "experiments/studies/recognition/calibration.h"
#include "experiments/studies/recognition/report.h"
#include "experiments/system/build_info.h"
#include "sim/base/units.h"

namespace turbidock::recognition {
namespace {

using report::Fixed;
using report::Json;

report::Table ParameterTable(const CalibrationPlan& plan, const CalibrationResult& result) {
  report::Table table({"<parameter", "value", "range", "misfit 5 % of it lower", "higher"});
  for (size_t i = 0; i < plan.parameters.size(); ++i) {
    const FreeParameter& p = plan.parameters[i];
    std::vector<report::Cell> row = {p.key, fmt::format("{:.5g}", result.best.values[i]),
                                     fmt::format("{:g} to {:g}", p.low, p.high)};
    if (i < result.misfit_beside.size()) {
      row.emplace_back(Fixed(result.misfit_beside[i].first, 3));
      row.emplace_back(Fixed(result.misfit_beside[i].second, 3));
    }
    table.Row(std::move(row));
  }
  return table;
}

report::Table ConstraintTable(const std::vector<Constraint>& constraints) {
  report::Table table({"<constraint", "value", "misfit"});
  for (const Constraint& c : constraints)
    table.Row({c.name,
               Fixed(c.value, 3),
               {Fixed(c.misfit, 2), c.misfit > 1 ? report::Tone::kBad : report::Tone::kNone}});
  return table;
}

}  // namespace

report::Report ReportOf(const CalibrationExperiment& experiment, const CalibrationResult& result,
                        const Confirmation& confirmed) {
  const CalibrationPlan& plan = experiment.plan();
  report::Report report{
      .kind = "calibration",
      .title = "Calibration of water, lights and cameras",
      .build = system::VersionAndCommit(),
      .facts = {{"misfit", Fixed(result.misfit, 3), "1: as far off as is accepted"},
                {"evaluations", std::to_string(result.evaluations)}},
      .sections = {{.title = "Parameters", .table = ParameterTable(plan, result)},
                   {.title = "Constraints",
                    .note = "Of the searched cells, F near the true pose.",
                    .table = ConstraintTable(result.best.constraints)}}};
  if (result.misfit_beside.empty()) report.missing = {"It was stopped: the best so far."};
  std::vector<CellResult> searched;
  for (size_t i = 0; i < experiment.rows().size(); ++i)
    searched.push_back({.cell = experiment.rows()[i].cell, .fitness_mean = result.best.fitness[i]});
  report.sections.push_back({.title = "F over milk",
                             .note = "Of the searched cells, near the true pose; rings: the table.",
                             .panels = FitnessPanels(searched, experiment.rows(), "the table"),
                             .wide = true});
  for (const auto& [marker, comparison] : confirmed)
    report.sections.push_back(
        {.title = fmt::format("The whole experiment, {} marker", NameOf(marker)),
         .table = ConstraintTable(TableConstraints(marker, comparison, plan.accepted))});
  return report;
}

Json ResultJson(const CalibrationExperiment& experiment, const CalibrationResult& result,
                const Confirmation& confirmed) {
  const CalibrationPlan& plan = experiment.plan();
  Json parameters = Json::array(), residuals = Json::array(), full = Json::object();
  for (size_t i = 0; i < plan.parameters.size(); ++i) {
    const FreeParameter& p = plan.parameters[i];
    parameters.push_back({{"key", p.key},
                          {"value", result.best.values[i]},
                          {"low", p.low},
                          {"high", p.high},
                          {"source", p.source}});
    if (i >= result.misfit_beside.size()) continue;  // stopped
    parameters.back()["misfit_lower"] = result.misfit_beside[i].first;
    parameters.back()["misfit_higher"] = result.misfit_beside[i].second;
  }
  for (size_t i = 0; i < experiment.rows().size(); ++i) {
    const TableRow& row = experiment.rows()[i];
    residuals.push_back({{"marker", row.cell.marker},
                         {"milk_ml_m3", row.cell.milk_ml_m3},
                         {"distance_mm", units::MmFromM(row.cell.distance_m)},
                         {"fitness", result.best.fitness[i]},
                         {"reference_mean", row.fitness_mean}});
  }
  for (const auto& [marker, comparison] : confirmed)
    full[NameOf(marker)] = TableConstraints(marker, comparison, plan.accepted);
  return {{"parameters", parameters},
          {"misfit", result.misfit},
          {"evaluations", result.evaluations},
          {"constraints", result.best.constraints},
          {"residuals", residuals},
          {"confirmed", full}};
}

}  // namespace turbidock::recognition
