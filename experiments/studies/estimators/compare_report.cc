#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "experiments/studies/estimators/compare_estimators.h"
#include "experiments/system/build_info.h"

namespace turbidock::estimators {
namespace {

using report::Fixed;
using units::MmFromM;

report::Table TableOf(const std::vector<CompareCell>& cells) {
  const auto span = [](const std::optional<statistics::Interval>& interval, double unit,
                       int digits) {
    return interval ? fmt::format("{:.{}f}..{:.{}f}", unit * interval->low, digits,
                                  unit * interval->high, digits)
                    : "";
  };
  const auto scaled = [](const std::optional<double>& value, double unit, int digits) {
    return value ? Fixed(unit * *value, digits) : "-";
  };
  report::Table table({"<scenario", "mm", "ml/m³", "<estimator", "right", "95 %", "wrong and sure",
                       "not found", "median error, mm", "95 %", "median error, °", "ms/frame"});
  for (const CompareCell& cell : cells)
    table.Row({cell.scenario,
               FormatNumber(MmFromM(cell.distance_m)),
               FormatNumber(cell.milk_ml_m3),
               cell.estimator,
               fmt::format("{}/{}", cell.right, cell.starts),
               span(cell.right_interval, 1, 2),
               {std::to_string(cell.wrong_and_sure),
                cell.wrong_and_sure > 0 ? report::Tone::kBad : report::Tone::kNone},
               std::to_string(cell.not_found),
               scaled(cell.error_median_m, MmFromM(1), 1),
               span(cell.error_median_interval_m, MmFromM(1), 1),
               scaled(cell.rotation_median_rad, units::kDegPerRad, 2),
               scaled(cell.frame_s, 1000, 2)});
  return table;
}

// Shares and error over milk, a line for each estimator and distance. Lines stand a little apart
// along x, so that those that coincide are seen.
std::vector<report::Panel> PanelsOf(const std::vector<CompareCell>& cells,
                                    const std::string& scenario) {
  std::map<std::pair<std::string, double>, std::vector<const CompareCell*>> lines;
  double most = 1;
  for (const CompareCell& cell : cells) {
    if (cell.scenario != scenario) continue;
    lines[{cell.estimator, cell.distance_m}].push_back(&cell);
    most = std::max(most, cell.milk_ml_m3);
  }
  report::Panel right{.x = {"milk, ml/m³", -0.05 * most, 1.05 * most},
                      .y = {"right, %", -3, 103},
                      .legend = report::Legend::kAbove};
  report::Panel wrong = right, error = right;
  wrong.y.label = "wrong and sure, %";
  error.y = {.label = "median error, mm", .logarithmic = true};
  for (const auto& [key, line] : lines) {
    const auto& [estimator, distance_m] = key;
    const auto number = static_cast<double>(right.series.size());
    const double apart = 0.01 * most * (number - 0.5 * static_cast<double>(lines.size() - 1));
    const report::Series empty{fmt::format("{}, {:g} mm", estimator, MmFromM(distance_m)),
                               {},
                               report::CurveColor(right.series.size()),
                               report::Mark::kLineWithBars};
    for (report::Panel* panel : {&right, &wrong, &error}) panel->series.push_back(empty);
    for (const CompareCell* cell : line) {
      const double x = cell->milk_ml_m3 + apart;
      const double starts = cell->starts, median_m = cell->error_median_m.value_or(report::kOpen);
      right.series.back().points.push_back(
          report::SampleWithin(x, cell->right / starts, cell->right_interval, 100));
      wrong.series.back().points.push_back(report::SampleWithin(
          x, cell->wrong_and_sure / starts, cell->wrong_and_sure_interval, 100));
      error.series.back().points.push_back(report::SampleWithin(
          x, median_m,
          cell->error_median_interval_m.value_or(statistics::Interval{median_m, median_m}),
          MmFromM(1)));
    }
  }
  return {right, wrong, error};
}

}  // namespace

report::Report ReportOf(const std::vector<CompareCell>& cells) {
  report::Report report{.kind = "estimators",
                        .title = "Estimators from cold starts",
                        .build = system::VersionAndCommit()};
  std::map<std::string, CompareCell> sums;  // by estimator
  for (const CompareCell& cell : cells) {
    CompareCell& sum = sums[cell.estimator];
    for (auto count : {&CompareCell::starts, &CompareCell::right, &CompareCell::wrong_and_sure,
                       &CompareCell::not_found})
      sum.*count += cell.*count;
    if (report.sections.empty() || report.sections.back().title != cell.scenario)
      report.sections.push_back(
          {.title = cell.scenario,
           .note = fmt::format("n = {} starts a point; bars: 95 % intervals.", cell.starts),
           .panels = PanelsOf(cells, cell.scenario),
           .wide = true});
  }
  for (const auto& [name, sum] : sums)
    report.facts.push_back(
        {name, fmt::format("{} of {} right", sum.right, sum.starts),
         fmt::format("{} wrong and sure, {} not found", sum.wrong_and_sure, sum.not_found)});
  report.sections.push_back({.title = "Cells",
                             .note = "F: how well the pixels agree with the marker at the pose "
                                     "found, 1 at best. Sure: F at least procedure.lost_fitness. "
                                     "Errors are of the estimates that are sure; intervals 95 %.",
                             .table = TableOf(cells)});
  return report;
}

}  // namespace turbidock::estimators
