// How a comparison of estimators is told: table, CSV, JSON, figure.

#include <fmt/format.h>

#include <algorithm>

#include "experiments/media/figure.h"
#include "experiments/report/json.h"
#include "experiments/report/table.h"
#include "experiments/studies/estimators/compare_estimators.h"
#include "sim/base/units.h"

namespace turbidock::estimators {
namespace {

using report::Fixed;
using units::DegFromRad;
using units::MmFromM;

// In the order of their first appearance.
template <class Of>
auto Distinct(const std::vector<CompareRow>& rows, Of of) {
  std::vector<decltype(of(rows.front()))> seen;
  for (const CompareRow& row : rows)
    if (std::find(seen.begin(), seen.end(), of(row)) == seen.end()) seen.push_back(of(row));
  return seen;
}

std::string DistanceText(const CompareRow& row) {
  return row.cell.distance_m > 0 ? fmt::format("{:.0f}", MmFromM(row.cell.distance_m)) : "any";
}

// "0.5..0.7" of that unit.
std::string Span(const statistics::Interval& interval, double unit, int digits) {
  return Fixed(unit * interval.low, digits) + ".." + Fixed(unit * interval.high, digits);
}

// A median with its interval: "1.2 (1.0..1.5)".
std::string MedianText(double median, const statistics::Interval& interval, double unit,
                       int digits) {
  return fmt::format("{} ({})", Fixed(unit * median, digits), Span(interval, unit, digits));
}

// A cell's numbers in units for people, an interval as two.
report::Json ShownColumns(const CompareRow& row) {
  report::Json columns;
  const auto add = [&columns](std::string key, double value) {
    for (const auto& [si, shown, factor] : {std::tuple("_m", "_mm", MmFromM(1)),
                                            {"_rad", "_deg", units::kDegPerRad},
                                            {"_s", "_ms", 1000}})
      if (key.ends_with(si)) {
        key.replace(key.rfind(si), key.size(), shown);
        value *= factor;
      }
    columns[key] = value;
  };
  CompareRow::Fields(row, [&](const std::string& key, const auto& value) {
    using V = std::remove_cvref_t<decltype(value)>;
    const auto bound = [&](const char* end) {
      return std::string(key).replace(key.find("interval"), 8, end);
    };
    if constexpr (std::is_same_v<V, double>) {
      add(key, value);
    } else if constexpr (std::is_same_v<V, statistics::Interval>) {
      add(bound("low"), value.low);
      add(bound("high"), value.high);
    } else if constexpr (!IsVectorOfStructs<V>::value) {
      columns[key] = value;
    }
  });
  return columns;
}

// Calls see(marker, estimator) for all there are.
template <class See>
void ForEachMarkerAndEstimator(const std::vector<CompareRow>& rows, See see) {
  for (const recognition::MarkerKind marker :
       Distinct(rows, [](const CompareRow& r) { return r.cell.marker; }))
    for (const std::string& name : Distinct(rows, [](const CompareRow& r) { return r.estimator; }))
      see(marker, name);
}

// Where a row is drawn: as part of a line in a panel.
struct Place {
  std::string panel, line;
  bool operator==(const Place&) const = default;
};

Place PlaceOf(const CompareRow& row, bool one_estimator) {
  const std::string marker = fmt::format("{} marker", NameOf(row.cell.marker));
  const std::string distance = DistanceText(row) + (row.cell.distance_m > 0 ? " mm" : " distance");
  if (one_estimator) return {marker, distance};
  return {marker + ", " + distance, row.estimator};
}

}  // namespace

std::string CompareText(const std::vector<CompareRow>& rows) {
  const double mm = MmFromM(1), deg = units::kDegPerRad;
  const auto count = [](int found, int starts) { return fmt::format("{}/{}", found, starts); };
  report::Table cells({"<marker", "mm", "ml/m3", "<estimator", "found", "95 %", "median error mm",
                       "95 % mm", "worst", "median error deg", "detected", "F", "ms/frame", "evals",
                       "frames", "95 %"});
  for (const CompareRow& row : rows)
    cells.Row({NameOf(row.cell.marker), DistanceText(row), fmt::format("{:g}", row.cell.milk_ml_m3),
               row.estimator, count(row.found, row.starts), Span(row.found_interval, 1, 2),
               MedianText(row.error_median_m, row.error_median_interval_m, mm, 1),
               Fixed(mm * row.error_95_m, 1), Fixed(mm * row.error_worst_m, 1),
               MedianText(row.rotation_median_rad, row.rotation_median_interval_rad, deg, 2),
               Fixed(row.detected, 4), Fixed(row.fitness_mean, 2), Fixed(1000 * row.frame_s, 2),
               Fixed(row.evaluations_per_frame, 0), Fixed(row.frames_median, 0),
               Fixed(row.frames_95, 0)});
  report::Table correlations({"<marker", "<estimator", "rank correlation"}),
      bins({"<marker", "<estimator", "F", "found", "95 %", "error mm (95 %)", "deg (95 %)"});
  ForEachMarkerAndEstimator(rows, [&](recognition::MarkerKind marker, const std::string& name) {
    correlations.Row({NameOf(marker), name,
                      fmt::format("{:+.2f}", FitnessErrorCorrelation(rows, marker, name))});
    for (const FitnessBin& bin : FitnessBins(rows, marker, name))
      bins.Row({NameOf(marker), name, Span({bin.low, bin.high}, 1, 2), count(bin.found, bin.starts),
                Span(bin.found_interval, 1, 3),
                fmt::format("{:.2f} ({:6.2f})", mm * bin.error_median_m, mm * bin.error_95_m),
                fmt::format("{:.3f} ({:6.3f})", deg * bin.rotation_median_rad,
                            deg * bin.rotation_95_rad)});
  });
  std::string text = cells.Text() +
                     "\nrank correlation of F with the error (-1: F tells it perfectly)\n" +
                     correlations.Text() + "\nwhat F tells\n" + bins.Text();
  text.pop_back();
  return text;
}

std::string CompareCsv(const std::vector<CompareRow>& rows) {
  std::string csv;
  for (const CompareRow& row : rows) report::AddCsv(ShownColumns(row), &csv);
  return csv;
}

std::string CompareJson(const std::vector<CompareRow>& rows) {
  report::Json json = {{"cells", rows},
                       {"fitness_error_correlation", report::Json::array()},
                       {"fitness_bins", report::Json::array()}};
  ForEachMarkerAndEstimator(rows, [&](recognition::MarkerKind marker, const std::string& name) {
    const report::Json of = {{"marker", marker}, {"estimator", name}};
    json["fitness_error_correlation"].push_back(of);
    json["fitness_error_correlation"].back()["spearman"] =
        FitnessErrorCorrelation(rows, marker, name);
    for (const FitnessBin& bin : FitnessBins(rows, marker, name)) {
      json["fitness_bins"].push_back(of);
      json["fitness_bins"].back().update(bin);
    }
  });
  return report::JsonText(json);
}

void WriteCompareFigure(const std::string& path, const std::vector<CompareRow>& rows) {
  const auto estimators = Distinct(rows, [](const CompareRow& r) { return r.estimator; });
  const bool one = estimators.size() == 1;
  const auto panels = Distinct(rows, [&](const CompareRow& r) { return PlaceOf(r, one).panel; });
  const auto lines = Distinct(rows, [&](const CompareRow& r) { return PlaceOf(r, one).line; });
  const double most_ml_m3 = std::ranges::max(rows, {}, [](const CompareRow& r) {
                              return r.cell.milk_ml_m3;
                            }).cell.milk_ml_m3;
  const double margin_ml_m3 = most_ml_m3 > 0 ? 0.04 * most_ml_m3 : 1;
  report::Figure figure{.columns = 3, .width_px = 500, .height_px = 360};
  for (const std::string& title : panels) {
    report::Panel found{.title = title,
                        .x = {"milk [ml/m³]", -margin_ml_m3, most_ml_m3 + margin_ml_m3},
                        .y = {"found [%]", -3, 103}};
    report::Panel position = found, rotation = found;
    position.y = {"median error [mm]", 0.05, 2000, true};
    rotation.y = {"median error [deg]", 0.02, 100, true};
    rotation.legend = report::Legend::kBeside;
    for (size_t l = 0; l < lines.size(); ++l) {
      report::Series shares{lines[l], {}, report::CurveColor(l), report::Mark::kLineWithBars};
      report::Series errors = shares, turns = shares;
      for (const CompareRow& r : rows) {
        if (PlaceOf(r, one) != Place{title, lines[l]}) continue;
        const double milk = r.cell.milk_ml_m3, share = static_cast<double>(r.found) / r.starts;
        shares.points.push_back(report::SampleWithin(milk, share, r.found_interval, 100));
        errors.points.push_back(
            report::SampleWithin(milk, r.error_median_m, r.error_median_interval_m, MmFromM(1)));
        turns.points.push_back(report::SampleWithin(milk, r.rotation_median_rad,
                                                    r.rotation_median_interval_rad, DegFromRad(1)));
      }
      found.series.push_back(shares);
      position.series.push_back(errors);
      rotation.series.push_back(turns);
    }
    figure.panels.insert(figure.panels.end(), {found, position, rotation});
  }
  media::WriteFigure(path, figure);
}

}  // namespace turbidock::estimators
