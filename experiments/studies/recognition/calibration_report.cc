#include <fmt/format.h>
#include <fmt/ranges.h>

#include "experiments/studies/recognition/calibration.h"
#include "experiments/system/build_info.h"

namespace turbidock::recognition {
namespace {

using report::Fixed;
using report::Json;

report::Table ParameterTable(const CalibrationPlan& plan, const Evaluation& best) {
  report::Table table({"<parameter", "value", "range"});
  for (size_t i = 0; i < plan.parameters.size(); ++i) {
    const FreeParameter& p = plan.parameters[i];
    table.Row(
        {p.key, fmt::format("{:.5g}", best.values[i]), fmt::format("{:g} to {:g}", p.low, p.high)});
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

report::Report ReportOf(const CalibrationPlan& plan, const CalibrationResult& result) {
  const Evaluation& best = result.best;
  const std::string confirm = fmt::format(
      "turbidock recognize --marker passive --table assets/recognition_passive.csv --set '{}'",
      fmt::join(plan.Assignments(best.values), "' --set '"));
  report::Report report{
      .kind = "calibration",
      .title = "Calibration of water, lights and cameras",
      .build = system::VersionAndCommit(),
      .facts = {{"misfit", Fixed(best.misfit, 3), "1: as far off as is accepted"},
                {"evaluations", std::to_string(result.evaluations)}},
      .sections = {{.title = "Parameters", .table = ParameterTable(plan, best)},
                   {.title = "Constraints",
                    .note = "Of the searched cells, F near the true pose.",
                    .table = ConstraintTable(best.constraints),
                    .commands = {{"the whole experiment, whose search knows nothing", confirm}}}}};
  if (!result.is_complete) report.missing = {"It was stopped: the best so far."};
  return report;
}

Json ResultJson(const CalibrationPlan& plan, const CalibrationResult& result) {
  Json parameters = Json::array();
  for (size_t i = 0; i < plan.parameters.size(); ++i) {
    const FreeParameter& p = plan.parameters[i];
    parameters.push_back({{"key", p.key},
                          {"value", result.best.values[i]},
                          {"low", p.low},
                          {"high", p.high},
                          {"source", p.source}});
  }
  return {{"parameters", parameters},
          {"misfit", result.best.misfit},
          {"evaluations", result.evaluations},
          {"constraints", result.best.constraints}};
}

}  // namespace turbidock::recognition
