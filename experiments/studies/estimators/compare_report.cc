#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "experiments/studies/estimators/compare_estimators.h"
#include "experiments/system/build_info.h"

namespace turbidock::estimators {
namespace {

using report::Fixed;
using units::MmFromM;

std::string Scaled(const std::optional<double>& value, double unit, int digits) {
  return value ? Fixed(unit * *value, digits) : "-";
}

std::string Span(const statistics::Interval& interval, double unit, int digits) {
  return Fixed(unit * interval.low, digits) + ".." + Fixed(unit * interval.high, digits);
}

report::Table TableOf(const std::vector<CompareCell>& cells) {
  report::Table table({"<scenario", "mm", "ml/m³", "<estimator", "right", "95 %", "wrong and sure",
                       "not found", "median error, mm", "95 %", "median error, °", "ms/frame"});
  for (const CompareCell& cell : cells) {
    const auto& error = cell.error_median_interval_m;
    table.Row({cell.scenario,
               FormatNumber(MmFromM(cell.distance_m)),
               FormatNumber(cell.milk_ml_m3),
               cell.estimator,
               fmt::format("{}/{}", cell.right, cell.starts),
               Span(cell.right_interval, 1, 2),
               {std::to_string(cell.wrong_and_sure),
                cell.wrong_and_sure > 0 ? report::Tone::kBad : report::Tone::kNone},
               std::to_string(cell.not_found),
               Scaled(cell.error_median_m, MmFromM(1), 1),
               error ? Span(*error, MmFromM(1), 1) : "",
               Scaled(cell.rotation_median_rad, units::kDegPerRad, 2),
               Scaled(cell.frame_s, 1000, 2)});
  }
  return table;
}

// Shares and error over milk, a line for each estimator and distance.
std::vector<report::Panel> PanelsOf(const std::vector<CompareCell>& cells,
                                    const std::string& scenario) {
  report::Panel right{
      .x = {"milk, ml/m³"}, .y = {"right, %", -3, 103}, .legend = report::Legend::kAbove};
  report::Panel wrong = right, error = right;
  wrong.y.label = "wrong and sure, %";
  error.y = {.label = "median error, mm", .logarithmic = true};
  for (const CompareCell& cell : cells) {
    if (cell.scenario != scenario) continue;
    const double milk = cell.milk_ml_m3, median_m = cell.error_median_m.value_or(report::kOpen);
    const std::string line =
        fmt::format("{}, {} mm", cell.estimator, FormatNumber(MmFromM(cell.distance_m)));
    const auto add = [&](report::Panel* panel, const report::Sample& sample) {
      auto& all = panel->series;
      auto series = std::ranges::find(all, line, &report::Series::name);
      if (series == all.end())
        series = all.insert(
            series, {line, {}, report::CurveColor(all.size()), report::Mark::kLineWithBars});
      series->points.push_back(sample);
    };
    const auto share = [&](int count, const statistics::Interval& interval) {
      return report::SampleWithin(milk, static_cast<double>(count) / cell.starts, interval, 100);
    };
    add(&right, share(cell.right, cell.right_interval));
    add(&wrong, share(cell.wrong_and_sure, cell.wrong_and_sure_interval));
    const statistics::Interval at_median{median_m, median_m};
    add(&error, report::SampleWithin(milk, median_m,
                                     cell.error_median_interval_m.value_or(at_median), MmFromM(1)));
  }
  return {right, wrong, error};
}

}  // namespace

report::Report ReportOf(const std::vector<CompareCell>& cells) {
  report::Report report{.kind = "estimators",
                        .title = "Estimators from cold starts",
                        .build = system::VersionAndCommit()};
  std::map<std::string, CompareCell> sums;  // by estimator
  std::string scenario;
  for (const CompareCell& cell : cells) {
    CompareCell& sum = sums[cell.estimator];
    for (auto count : {&CompareCell::starts, &CompareCell::right, &CompareCell::wrong_and_sure,
                       &CompareCell::not_found})
      sum.*count += cell.*count;
    if (cell.scenario == scenario) continue;
    scenario = cell.scenario;
    report.sections.push_back(
        {.title = scenario, .panels = PanelsOf(cells, scenario), .wide = true});
  }
  for (const auto& [name, sum] : sums)
    report.facts.push_back(
        {name, fmt::format("{} of {} right", sum.right, sum.starts),
         fmt::format("{} wrong and sure, {} not found", sum.wrong_and_sure, sum.not_found)});
  report.sections.push_back({.title = "Cells",
                             .note = "Sure: F at least procedure.lost_fitness. Errors are of the "
                                     "estimates that are sure; intervals 95 %.",
                             .table = TableOf(cells)});
  return report;
}

}  // namespace turbidock::estimators
