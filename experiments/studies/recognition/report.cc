#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>

#include "experiments/studies/recognition/table.h"
#include "experiments/system/build_info.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/units.h"

namespace turbidock::recognition {
namespace {

using report::Fixed;
using units::MmFromM;

constexpr trial::ViewCriteria kLimits;

constexpr Rgb kDocking{60, 168, 110}, kRecognised{200, 150, 30};

std::string MarkerTitle(MarkerKind marker) { return fmt::format("{} marker", NameOf(marker)); }

report::Panel FitnessPanel(MarkerKind marker, const Columns& columns) {
  report::Panel panel{.title = MarkerTitle(marker),
                      .x = {"milk, ml/m³", 0},
                      .y = {"mean F", -0.25, 1},
                      .rules = {{kLimits.docking_fitness, "0.60", kDocking},
                                {kLimits.detection_fitness, "0.22", kRecognised}},
                      .legend = true};
  std::string name_once = "the table";  // in the legend
  for (const Column& column : columns) {
    const Rgb& color = report::CurveColor(panel.series.size() / 2);
    report::Series simulated{column.name, {}, color, report::Mark::kLineWithBars};
    report::Series reference{"", {}, color, report::Mark::kRings};
    for (const auto& [milk, r] : column.cells)
      simulated.points.push_back(
          {milk, r.fitness_mean, r.fitness_mean - r.fitness_std, r.fitness_mean + r.fitness_std});
    for (const auto& [milk, fitness] : column.reference)
      reference.points.push_back({milk, fitness});
    if (!reference.points.empty()) reference.name = std::exchange(name_once, "");
    panel.series.push_back(simulated);
    panel.series.push_back(reference);
  }
  return panel;
}

// What a cell's table says of it: its run, and F of the reference.
using CellText = std::string (*)(const CellResult&, const std::optional<double>& reference);

// A row for each milk, a column for each cell of the plan.
report::Section TableSection(const std::string& title, const char* note, const Columns& columns,
                             CellText text_of) {
  std::vector<std::string> heads = {"ml/m³"};
  std::map<double, std::vector<report::Cell>> rows;  // by milk
  for (const Column& column : columns) {
    heads.push_back(column.name);
    for (const auto& [milk, r] : column.cells) {
      rows[milk].resize(heads.size());
      rows[milk][0] = Fixed(milk, 1);
      const auto found = column.reference.find(milk);
      constexpr std::array kTones = {report::Tone::kGood, report::Tone::kNone, report::Tone::kBad};
      rows[milk].back() = {
          text_of(r, found == column.reference.end() ? std::nullopt : std::optional(found->second)),
          kTones[static_cast<size_t>(r.area)]};
    }
  }
  report::Table table(heads);
  for (auto& [milk, row] : rows) table.Row(std::move(row));
  return {.title = title, .note = note, .table = table};
}

std::string FitnessText(const CellResult& r, const std::optional<double>& reference) {
  const std::string table = reference ? fmt::format(" (table {:.2f})", *reference) : "";
  return fmt::format("{:.2f} {}{}", r.fitness_mean, NameOf(r.area), table);
}

std::string FramesText(const CellResult& r, const std::optional<double>& /*reference*/) {
  return fmt::format("{:.0f} / {:.0f}", 100 * r.right, 100 * r.wrong_and_sure);
}

// Where F falls to 0.22.
std::string LimitText(const Curve& fitness_over_milk) {
  if (const auto limit = MilkAtLoss(fitness_over_milk)) return fmt::format("{:.0f} ml/m³", *limit);
  const auto lost = std::ranges::find_if(
      fitness_over_milk, [](const auto& cell) { return AreaOf(cell.second) == Area::kIII; });
  if (lost == fitness_over_milk.begin())
    return fmt::format("lost at {:g} ml/m³, the least tried", lost->first);
  const double last = std::prev(lost)->first;
  if (lost == fitness_over_milk.end()) return fmt::format("beyond {:g} ml/m³", last);
  return fmt::format("{:g} to {:g} ml/m³", last, lost->first);  // too few cells for means of three
}

std::vector<CellResult> Of(MarkerKind marker, std::vector<CellResult> results) {
  std::erase_if(results, [marker](const CellResult& r) { return r.cell.marker != marker; });
  return results;
}

void AddComparison(const TableComparison& c, const std::string& what,
                   std::vector<report::Fact>* facts) {
  facts->insert(
      facts->end(),
      {{"RMSE of mean F" + what, Fixed(c.rmse, 3), "against the table"},
       {"same Area" + what, fmt::format("{:.0f} %", 100 * c.area_agreement),
        "of the table's cells"},
       {"F of a lost marker" + what, Fixed(c.lost_fitness_error, 3), "above the table's"},
       {"deviation of F in a cell" + what, Fixed(c.fitness_std, 3), "mean of cells not lost"}});
}

}  // namespace

report::Report ReportOf(const std::vector<CellResult>& results,
                        const std::vector<TableRow>& tables) {
  report::Report report{.kind = "recognition",
                        .title = "Recognition of the marker over milk and distance",
                        .build = system::VersionAndCommit()};
  report.sections = {{.title = "F over milk",
                      .note =
                          "F: how well the pixels agree with the marker at the pose found, 1 at "
                          "best; dots: its mean in a cell, bars: its deviation, rings: the table. "
                          "Area I, from 0.60: docking is possible; II: the marker is "
                          "recognised; III, below 0.22: it is not.",
                      .wide = true}};
  const std::map<MarkerKind, Columns> columns = ColumnsOf(results, tables);
  for (const auto& [marker, of_marker] : columns) {
    const auto compared = Compare(Of(marker, results), tables);
    if (compared)
      AddComparison(*compared, columns.size() > 1 ? fmt::format(", {}", NameOf(marker)) : "",
                    &report.facts);
    for (const Column& column : of_marker)
      report.facts.push_back(
          {fmt::format("turbidity limit, {} at {}", NameOf(marker), column.name),
           LimitText(column.simulated),
           column.reference.empty() ? "" : "the table: " + LimitText(column.reference)});
    report.sections.front().panels.push_back(FitnessPanel(marker, of_marker));
    report.sections.push_back(TableSection(MarkerTitle(marker) + ": mean F and its Area",
                                           compared ? "In brackets the table's mean F." : "",
                                           of_marker, FitnessText));
    report.sections.push_back(
        TableSection(MarkerTitle(marker) + ": right / wrong frames, %",
                     "Both count as detected. Right: within 20 mm and 5°; wrong: farther off.",
                     of_marker, FramesText));
  }
  return report;
}

report::Json ResultJson(const std::vector<CellResult>& results,
                        const std::vector<TableRow>& tables) {
  std::map<RecognitionCell, double> references;
  for (const auto& [cell, fitness_mean] : tables) references[cell] = fitness_mean;
  report::Json json = {{"cells", results}};
  for (size_t i = 0; i < results.size(); ++i)
    if (const auto row = references.find(results[i].cell); row != references.end())
      json["cells"][i]["reference_mean"] = row->second;
  for (const auto& [marker, name] : EnumNames<MarkerKind>::kNames) {
    const auto c = Compare(Of(marker, results), tables);
    if (!c) continue;
    report::Json ratios, simulated, reference;
    for (const auto& [distance_m, loss] : c->loss_by_distance_m) {
      const std::string key = fmt::format("{:g}", MmFromM(distance_m));
      ratios[key] = loss.ratio();
      simulated[key] = loss.simulated_ml_m3;
      reference[key] = loss.reference_ml_m3;
    }
    json["tables"][name] = {
        {"rmse", c->rmse},
        {"area_agreement", c->area_agreement},
        {"loss_milk_ratio", ratios},
        {"loss_milk_ml_m3", {{"simulated", simulated}, {"reference", reference}}},
        {"lost_fitness_error", c->lost_fitness_error},
        {"fitness_std", c->fitness_std}};
  }
  return json;
}

}  // namespace turbidock::recognition
