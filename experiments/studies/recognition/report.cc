#include "experiments/studies/recognition/report.h"

#include <fmt/format.h>

#include <map>
#include <set>

#include "experiments/report/json.h"
#include "experiments/report/table.h"
#include "sim/base/units.h"

namespace turbidock::recognition {
namespace {

using report::Json;
using units::MmFromM;

// The results with what the table says of the same cells.
Json Cells(const std::vector<CellResult>& results, const std::vector<TableRow>& table) {
  Json cells = results;
  for (size_t i = 0; i < table.size(); ++i) {
    cells[i]["reference_mean"] = table[i].fitness_mean;
    cells[i]["reference_std"] = table[i].fitness_std;
    cells[i]["reference_area"] = AreaOf(table[i].fitness_mean);
  }
  return cells;
}

}  // namespace

std::string RecognitionText(const std::vector<CellResult>& results,
                            const std::vector<TableRow>& table,
                            const std::optional<TableComparison>& comparison) {
  std::map<MarkerKind, std::map<double, std::map<double, size_t>>> by_marker;  // milk, distance
  std::map<MarkerKind, std::set<double>> distances_m;
  for (size_t i = 0; i < results.size(); ++i) {
    const RecognitionCell& cell = results[i].cell;
    by_marker[cell.marker][cell.milk_ml_m3][cell.distance_m] = i;
    distances_m[cell.marker].insert(cell.distance_m);
  }
  std::string text;
  for (const auto& [marker, by_milk] : by_marker) {
    std::vector<std::string> heads = {"ml/m3"};
    for (const double d : distances_m[marker]) heads.push_back(fmt::format("{:g} mm", MmFromM(d)));
    report::Table rows(heads);
    for (const auto& [milk, by_distance] : by_milk) {
      std::vector<report::Cell> row = {report::Fixed(milk, 1)};
      for (const double d : distances_m[marker]) {
        row.emplace_back();
        const auto found = by_distance.find(d);
        if (found == by_distance.end()) continue;
        const CellResult& r = results[found->second];
        row.back().text =
            fmt::format("{:.3f} ± {:.3f} {:<3}", r.fitness_mean, r.fitness_std, NameOf(r.area));
        if (!table.empty())
          row.back().text += fmt::format(" ({:6.3f})", table[found->second].fitness_mean);
      }
      rows.Row(std::move(row));
    }
    text += fmt::format("{} marker: mean F ± deviation, Area{}\n{}", NameOf(marker),
                        table.empty() ? "" : " (F of the table)", rows.Text());
  }
  if (comparison) {
    text +=
        fmt::format("against the table: RMSE of mean F {:.3f}, same Area in {:.0f} % of cells\n",
                    comparison->rmse, 100 * comparison->area_agreement);
    for (const auto& [distance_m, loss] : comparison->loss_by_distance_m)
      text += fmt::format("  {:g} mm: F falls to 0.22 at {} ml/m3, in the table at {}\n",
                          MmFromM(distance_m), report::Fixed(loss.simulated_ml_m3, 1),
                          report::Fixed(loss.reference_ml_m3, 1));
    text += fmt::format(
        "  nearest: F is best at {} ml/m3, {} above clear water; lost: F {} above the table's; "
        "deviation in a cell {}\n",
        report::Fixed(comparison->best_milk_ml_m3, 1), report::Fixed(comparison->rise, 3),
        report::Fixed(comparison->lost_fitness_error, 3),
        report::Fixed(comparison->fitness_std, 3));
  }
  text.pop_back();
  return text;
}

std::string RecognitionJson(const std::vector<CellResult>& results,
                            const std::vector<TableRow>& table,
                            const std::optional<TableComparison>& comparison) {
  Json json = {{"cells", Cells(results, table)}};
  if (comparison) {
    json["rmse"] = comparison->rmse;
    json["area_agreement"] = comparison->area_agreement;
    Json ratios = Json::object(), simulated = Json::object(), reference = Json::object();
    for (const auto& [distance_m, loss] : comparison->loss_by_distance_m) {
      const std::string key = fmt::format("{:g}", MmFromM(distance_m));
      ratios[key] = loss.ratio();
      simulated[key] = loss.simulated_ml_m3;
      reference[key] = loss.reference_ml_m3;
    }
    json["loss_milk_ratio"] = ratios;
    json["loss_milk_ml_m3"] = {{"simulated", simulated}, {"reference", reference}};
    json["lost_fitness_error"] = comparison->lost_fitness_error;
    json["best_milk_ml_m3"] = comparison->best_milk_ml_m3;
    json["rise"] = comparison->rise;
    json["fitness_std"] = comparison->fitness_std;
  }
  return report::JsonText(json);
}

std::string RecognitionCsv(const std::vector<CellResult>& results,
                           const std::vector<TableRow>& table) {
  Json cells = Cells(results, table);
  std::string csv;
  for (Json& cell : cells) {
    cell.erase("reference_area");
    report::AddCsv(cell, &csv);
  }
  return csv;
}

}  // namespace turbidock::recognition
