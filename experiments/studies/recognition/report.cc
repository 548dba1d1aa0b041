#include "experiments/studies/recognition/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include "experiments/system/build_info.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/units.h"

namespace turbidock::recognition {
namespace {

using report::Fixed;
using units::MmFromM;

constexpr trial::ViewCriteria kLimits;

constexpr std::array<Rgb, 3> kAreaColors{{{60, 168, 110}, {200, 150, 30}, {140, 148, 156}}};
const Rgb& ColorOf(Area area) { return kAreaColors[static_cast<size_t>(area)]; }

// One marker at one distance, by milk.
struct Curve {
  std::map<double, const CellResult*> simulated;
  std::map<double, double> reference;  // mean F
};
using CurvesByDistance = std::map<double, Curve>;

std::map<MarkerKind, CurvesByDistance> CurvesOf(const std::vector<CellResult>& results,
                                                const std::vector<TableRow>& reference) {
  std::map<MarkerKind, CurvesByDistance> curves;
  for (const CellResult& r : results)
    curves[r.cell.marker][r.cell.distance_m].simulated[r.cell.milk_ml_m3] = &r;
  for (const TableRow& row : reference) {
    CurvesByDistance& of_marker = curves[row.cell.marker];
    const auto curve = of_marker.find(row.cell.distance_m);
    if (curve != of_marker.end()) curve->second.reference[row.cell.milk_ml_m3] = row.fitness_mean;
  }
  std::erase_if(curves, [](const auto& entry) { return entry.second.empty(); });
  return curves;
}

std::vector<TableRow> PublishedTablesOf(const std::vector<CellResult>& results) {
  std::vector<TableRow> rows;
  for (const MarkerKind marker : {MarkerKind::kActive, MarkerKind::kPassive})
    if (std::ranges::any_of(results, [&](const CellResult& r) { return r.cell.marker == marker; }))
      for (const TableRow& row : PublishedTable(marker)) rows.push_back(row);
  return rows;
}

std::string MarkerTitle(MarkerKind marker) { return fmt::format("{} marker", NameOf(marker)); }

std::string Mm(double distance_m) { return fmt::format("{:g} mm", MmFromM(distance_m)); }

// An axis over all of a marker's milk.
report::Axis MilkAxis(const CurvesByDistance& curves) {
  double most = 1;
  for (const auto& [distance_m, curve] : curves)
    most = std::max(most, curve.simulated.rbegin()->first);
  return {"milk, ml/m³", 0, 1.03 * most};
}

report::Panel FitnessPanel(MarkerKind marker, const CurvesByDistance& curves,
                           const std::string& reference_name) {
  report::Panel panel{.title = MarkerTitle(marker),
                      .x = MilkAxis(curves),
                      .y = {"mean F", -0.25, 1},
                      .rules = {{kLimits.docking_fitness, "0.60", ColorOf(Area::kI)},
                                {kLimits.detection_fitness, "0.22", ColorOf(Area::kII)}},
                      .legend = report::Legend::kAbove};
  std::string name_once = reference_name;  // in the legend
  for (const auto& [distance_m, curve] : curves) {
    const Rgb& color = report::CurveColor(panel.series.size() / 2);
    report::Series simulated{Mm(distance_m), {}, color, report::Mark::kLineWithBand};
    report::Series reference{"", {}, color, report::Mark::kRings};
    for (const auto& [milk, r] : curve.simulated)
      simulated.points.push_back({milk, r->fitness_mean, r->fitness_mean - r->fitness_std,
                                  r->fitness_mean + r->fitness_std});
    for (const auto& [milk, fitness] : curve.reference) reference.points.push_back({milk, fitness});
    if (!reference.points.empty()) reference.name = std::exchange(name_once, "");
    panel.series.push_back(simulated);
    panel.series.push_back(reference);
  }
  return panel;
}

// Areas over milk as blocks between two heights, a block for neighbours in the same Area; each cell
// reaches half way to its neighbours.
void AddAreas(const std::map<double, Area>& row, double low, double high, bool named,
              report::Panel* panel) {
  for (auto here = row.begin(); here != row.end(); ++here) {
    const auto [milk, area] = *here;
    const auto next = std::next(here);
    const bool is_first = here == row.begin();
    const double from = is_first ? milk : (std::prev(here)->first + milk) / 2;
    const double to =
        next == row.end() ? milk + (is_first ? 1 : milk - from) : (next->first + milk) / 2;
    if (!is_first && std::prev(here)->second == area)
      panel->blocks.back().to_x = to;
    else
      panel->blocks.push_back({named ? NameOf(area) : "", from, to, low, high, ColorOf(area)});
  }
}

report::Panel AreaPanel(MarkerKind marker, const CurvesByDistance& curves) {
  report::Panel panel{.title = MarkerTitle(marker), .x = MilkAxis(curves), .y = {"distance, mm"}};
  report::Series measured{.color = {20, 30, 40}, .mark = report::Mark::kDots, .dot_px = 3};
  for (const auto& [distance_m, curve] : curves) {
    std::map<double, Area> simulated, reference;
    for (const auto& [milk, r] : curve.simulated) simulated[milk] = r->area;
    for (const auto& [milk, fitness] : curve.reference) reference[milk] = AreaOf(fitness);
    const auto row = static_cast<double>(panel.y.names.size());
    AddAreas(simulated, row - 0.1, row + 0.4, true, &panel);
    AddAreas(reference, row - 0.35, row - 0.15, false, &panel);
    for (const auto& [milk, r] : curve.simulated) measured.points.push_back({milk, row - 0.07});
    panel.y.names.push_back(fmt::format("{:g}", MmFromM(distance_m)));
  }
  panel.y.low = -0.5;
  panel.y.high = static_cast<double>(panel.y.names.size()) - 0.5;
  panel.series = {measured};
  return panel;
}

// F of the first cell of each Area that occurs.
report::Panel TimePanel(MarkerKind marker, const std::vector<CellResult>& results,
                        double frames_per_second) {
  report::Panel panel{.title = MarkerTitle(marker),
                      .x = {"time, s"},
                      .y = {"F", -0.25, 1},
                      .legend = report::Legend::kAbove};
  std::map<Area, const CellResult*> chosen;
  for (const CellResult& r : results)
    if (r.cell.marker == marker) chosen.try_emplace(r.area, &r);
  for (const auto& [area, r] : chosen) {
    report::Series series{fmt::format("Area {}: {}, {:g} ml/m³", NameOf(area),
                                      Mm(r->cell.distance_m), r->cell.milk_ml_m3)};
    series.color = report::CurveColor(panel.series.size());
    series.width_px = 1;
    for (const float f : r->fitness)
      series.points.push_back(
          {static_cast<double>(series.points.size()) / frames_per_second, static_cast<double>(f)});
    panel.series.push_back(series);
  }
  return panel;
}

report::Table FitnessTable(const CurvesByDistance& curves) {
  std::vector<std::string> heads = {"ml/m³"};
  std::map<double, std::vector<report::Cell>> rows;  // by milk
  for (const auto& [distance_m, curve] : curves) {
    heads.push_back(Mm(distance_m));
    for (const auto& [milk, r] : curve.simulated) {
      rows[milk].resize(heads.size());
      rows[milk][0] = Fixed(milk, 1);
      std::string text =
          fmt::format("{:.3f} ± {:.3f} {:<3}", r->fitness_mean, r->fitness_std, NameOf(r->area));
      if (const auto reference = curve.reference.find(milk); reference != curve.reference.end())
        text += fmt::format(" ({:.3f})", reference->second);
      else if (!curve.reference.empty())
        text += std::string(9, ' ');
      constexpr std::array kTones = {report::Tone::kGood, report::Tone::kNone, report::Tone::kBad};
      rows[milk].back() = {text, kTones[static_cast<size_t>(r->area)]};
    }
  }
  report::Table table(heads);
  for (auto& [milk, row] : rows) table.Row(std::move(row));
  return table;
}

// Where F falls to 0.22.
std::string LimitText(const std::vector<std::pair<double, double>>& fitness_over_milk) {
  if (const auto limit = MilkAtLoss(fitness_over_milk)) return fmt::format("{:.0f} ml/m³", *limit);
  const auto is_lost = [](const auto& cell) { return cell.second <= kLimits.detection_fitness; };
  const auto lost = std::ranges::find_if(fitness_over_milk, is_lost);
  if (lost == fitness_over_milk.begin()) return fmt::format("below {:g} ml/m³", lost->first);
  const double last = std::prev(lost)->first;
  if (lost == fitness_over_milk.end()) return fmt::format("beyond {:g} ml/m³", last);
  return fmt::format("{:g} to {:g} ml/m³", last, lost->first);  // too few cells for means of three
}

std::vector<report::Fact> LimitFacts(MarkerKind marker, const CurvesByDistance& curves,
                                     const std::string& reference_name) {
  std::vector<report::Fact> facts;
  for (const auto& [distance_m, curve] : curves) {
    std::vector<std::pair<double, double>> simulated;
    for (const auto& [milk, r] : curve.simulated) simulated.emplace_back(milk, r->fitness_mean);
    std::string note;
    if (!curve.reference.empty())
      note = reference_name + ": " + LimitText({curve.reference.begin(), curve.reference.end()});
    facts.push_back({fmt::format("turbidity limit, {} at {}", NameOf(marker), Mm(distance_m)),
                     LimitText(simulated), note});
  }
  return facts;
}

std::vector<report::Fact> ComparisonFacts(const TableComparison& c) {
  return {{"RMSE of mean F", Fixed(c.rmse, 3), "against the table"},
          {"same Area", fmt::format("{:.0f} %", 100 * c.area_agreement), "of the table's cells"},
          {"best F", Fixed(c.best_milk_ml_m3, 1) + " ml/m³",
           Fixed(c.rise, 3) + " above clear water, at the nearest distance"},
          {"F of a lost marker", Fixed(c.lost_fitness_error, 3), "above the table's"},
          {"deviation of F in a cell", Fixed(c.fitness_std, 3), "mean of cells not lost"}};
}

}  // namespace

std::vector<report::Panel> FitnessPanels(const std::vector<CellResult>& results,
                                         const std::vector<TableRow>& reference,
                                         const std::string& reference_name) {
  std::vector<report::Panel> panels;
  for (const auto& [marker, curves] : CurvesOf(results, reference))
    panels.push_back(FitnessPanel(marker, curves, reference_name));
  return panels;
}

report::Report ReportOf(const std::vector<CellResult>& results, const std::vector<TableRow>& table,
                        double frames_per_second) {
  const std::vector<TableRow> reference = table.empty() ? PublishedTablesOf(results) : table;
  const std::string name = table.empty() ? "published" : "the table";
  report::Report report{.kind = "recognition",
                        .title = "Recognition of the marker over milk and distance",
                        .build = system::VersionAndCommit()};
  if (!table.empty()) report.facts = ComparisonFacts(Compare(results, table));
  report::Section fitness{.title = "F over milk",
                          .note = "Mean and deviation of F in a cell; rings: " + name +
                                  ". Area I from 0.60, Area III below 0.22.",
                          .panels = FitnessPanels(results, reference, name),
                          .wide = true};
  report::Section areas{.title = "Areas",
                        .note =
                            "I (green): docking is possible; II (yellow): recognised; III "
                            "(grey): not. Thin: " +
                            name + ".",
                        .wide = true};
  report::Section time{
      .title = "F over time", .note = "Of the first cell of each Area.", .wide = true};
  std::vector<report::Section> tables;
  for (const auto& [marker, curves] : CurvesOf(results, reference)) {
    for (const report::Fact& fact : LimitFacts(marker, curves, name)) report.facts.push_back(fact);
    areas.panels.push_back(AreaPanel(marker, curves));
    time.panels.push_back(TimePanel(marker, results, frames_per_second));
    tables.push_back({.title = MarkerTitle(marker),
                      .note = "Mean F ± deviation, Area (F, " + name + ").",
                      .table = FitnessTable(curves)});
  }
  report.sections = {fitness, areas, time};
  report.sections.insert(report.sections.end(), tables.begin(), tables.end());
  return report;
}

report::Json ResultJson(const std::vector<CellResult>& results,
                        const std::vector<TableRow>& table) {
  report::Json json = {{"cells", results}};
  for (size_t i = 0; i < table.size(); ++i) {
    report::Json& cell = json["cells"][i];
    cell["reference_mean"] = table[i].fitness_mean;
    cell["reference_std"] = table[i].fitness_std;
    cell["reference_area"] = AreaOf(table[i].fitness_mean);
  }
  if (table.empty()) return json;
  const TableComparison c = Compare(results, table);
  report::Json ratios, simulated, reference;
  for (const auto& [distance_m, loss] : c.loss_by_distance_m) {
    const std::string key = fmt::format("{:g}", MmFromM(distance_m));
    ratios[key] = loss.ratio();
    simulated[key] = loss.simulated_ml_m3;
    reference[key] = loss.reference_ml_m3;
  }
  json.update({{"rmse", c.rmse},
               {"area_agreement", c.area_agreement},
               {"loss_milk_ratio", ratios},
               {"loss_milk_ml_m3", {{"simulated", simulated}, {"reference", reference}}},
               {"lost_fitness_error", c.lost_fitness_error},
               {"best_milk_ml_m3", c.best_milk_ml_m3},
               {"rise", c.rise},
               {"fitness_std", c.fitness_std}});
  return json;
}

std::string RecognitionCsv(const std::vector<CellResult>& results,
                           const std::vector<TableRow>& table) {
  std::string csv;
  const report::Json json = ResultJson(results, table);
  for (report::Json cell : json["cells"]) {
    cell.erase("reference_area");
    report::AddCsv(cell, &csv);
  }
  return csv;
}

}  // namespace turbidock::recognition
