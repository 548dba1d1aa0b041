#include "experiments/studies/recognition/report.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "sim/base/fields.h"
#include "sim/base/units.h"

namespace turbidock::recognition {
namespace {

using Json = nlohmann::ordered_json;
using units::MmFromM;

Json OrNull(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

std::string OrDash(const std::optional<double>& value) {
  return value ? fmt::format("{:.1f}", *value) : "-";
}

std::string DistanceKey(double distance_m) { return fmt::format("{:g}", MmFromM(distance_m)); }

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
    text += fmt::format("{} marker: mean F ± deviation, Area{}\n  ml/m3", NameOf(marker),
                        table.empty() ? "" : " (F of the table)");
    for (const double d : distances_m[marker])
      text += fmt::format("  {:>{}}", fmt::format("{:g} mm", MmFromM(d)), table.empty() ? 17 : 26);
    text += '\n';
    for (const auto& [milk, by_distance] : by_milk) {
      text += fmt::format("{:7.1f}", milk);
      for (const double d : distances_m[marker]) {
        const auto found = by_distance.find(d);
        if (found == by_distance.end()) {
          text += fmt::format("  {:>{}}", "", table.empty() ? 17 : 26);
          continue;
        }
        const CellResult& r = results[found->second];
        text +=
            fmt::format("  {:6.3f} ± {:.3f} {:<3}", r.fitness_mean, r.fitness_std, NameOf(r.area));
        if (!table.empty()) text += fmt::format(" ({:6.3f})", table[found->second].fitness_mean);
      }
      text += '\n';
    }
  }
  if (comparison) {
    text +=
        fmt::format("against the table: RMSE of mean F {:.3f}, same Area in {:.0f} % of cells\n",
                    comparison->rmse, 100 * comparison->area_agreement);
    for (const auto& [distance_m, loss] : comparison->loss_by_distance_m)
      text += fmt::format("  {:g} mm: F falls to 0.22 at {} ml/m3, in the table at {}\n",
                          MmFromM(distance_m), OrDash(loss.simulated_ml_m3),
                          OrDash(loss.reference_ml_m3));
  }
  text.pop_back();
  return text;
}

std::string RecognitionJson(const std::vector<CellResult>& results,
                            const std::vector<TableRow>& table,
                            const std::optional<TableComparison>& comparison) {
  Json cells = Json::array();
  for (size_t i = 0; i < results.size(); ++i) {
    const CellResult& r = results[i];
    Json cell = {{"marker", NameOf(r.cell.marker)},
                 {"milk_ml_m3", r.cell.milk_ml_m3},
                 {"distance_mm", MmFromM(r.cell.distance_m)},
                 {"fitness_mean", r.fitness_mean},
                 {"fitness_std", r.fitness_std},
                 {"area", NameOf(r.area)},
                 {"position_error_mean_m", r.position_error_mean_m}};
    if (!table.empty()) {
      cell["reference_mean"] = table[i].fitness_mean;
      cell["reference_std"] = OrNull(table[i].fitness_std);
      cell["reference_area"] = NameOf(AreaOf(table[i].fitness_mean));
    }
    cells.push_back(std::move(cell));
  }
  Json json = {{"cells", std::move(cells)}};
  if (comparison) {
    json["rmse"] = comparison->rmse;
    json["area_agreement"] = comparison->area_agreement;
    Json ratios = Json::object(), simulated = Json::object(), reference = Json::object();
    for (const auto& [distance_m, loss] : comparison->loss_by_distance_m) {
      const std::string key = DistanceKey(distance_m);
      ratios[key] = OrNull(loss.ratio());
      simulated[key] = OrNull(loss.simulated_ml_m3);
      reference[key] = OrNull(loss.reference_ml_m3);
    }
    json["loss_milk_ratio"] = std::move(ratios);
    json["loss_milk_ml_m3"] = {{"simulated", std::move(simulated)},
                               {"reference", std::move(reference)}};
  }
  return json.dump(2) + "\n";
}

std::string RecognitionCsv(const std::vector<CellResult>& results,
                           const std::vector<TableRow>& table) {
  std::string csv = "marker,milk_ml_m3,distance_mm,fitness_mean,fitness_std,area,";
  csv += "position_error_mean_m";
  if (!table.empty()) csv += ",reference_mean,reference_std";
  csv += '\n';
  for (size_t i = 0; i < results.size(); ++i) {
    const CellResult& r = results[i];
    csv += fmt::format("{},{},{},{},{},{},{}", NameOf(r.cell.marker),
                       FormatNumber(r.cell.milk_ml_m3), FormatNumber(MmFromM(r.cell.distance_m)),
                       FormatNumber(r.fitness_mean), FormatNumber(r.fitness_std), NameOf(r.area),
                       FormatNumber(r.position_error_mean_m));
    if (!table.empty())
      csv += fmt::format(",{},{}", FormatNumber(table[i].fitness_mean),
                         table[i].fitness_std ? FormatNumber(*table[i].fitness_std) : "");
    csv += '\n';
  }
  return csv;
}

}  // namespace turbidock::recognition
