// How a comparison of estimators is told: table, CSV, JSON, figure.

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "experiments/estimators/compare_estimators.h"
#include "experiments/gnuplot.h"
#include "sim/base/units.h"

namespace turbidock::experiments {
namespace {

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

}  // namespace

std::string CompareText(const std::vector<CompareRow>& rows) {
  std::string text = fmt::format(
      "{:8} {:>5} {:>6}  {:10} {:>9} {:>13} {:>20} {:>7} {:>7} {:>18} {:>8} {:>6} {:>8} {:>6}\n",
      "marker", "mm", "ml/m3", "estimator", "found", "95 %", "median error mm", "95 % mm", "worst",
      "median error deg", "detected", "F", "ms/frame", "evals");
  for (const CompareRow& row : rows)
    text += fmt::format(
        "{:8} {:>5} {:6g}  {:10} {:4}/{:<4} {:5.2f}..{:<5.2f} {:7.1f} ({:5.1f}..{:5.1f}) {:7.1f} "
        "{:7.1f} {:5.2f} ({:4.2f}..{:5.2f}) {:8.4f} {:6.2f} {:8.2f} {:6.0f}\n",
        NameOf(row.cell.marker), DistanceText(row), row.cell.milk_ml_m3, row.estimator, row.found,
        row.starts, row.found_interval.low, row.found_interval.high, MmFromM(row.error_median_m),
        MmFromM(row.error_median_interval_m.low), MmFromM(row.error_median_interval_m.high),
        MmFromM(row.error_95_m), MmFromM(row.error_worst_m), DegFromRad(row.rotation_median_rad),
        DegFromRad(row.rotation_median_interval_rad.low),
        DegFromRad(row.rotation_median_interval_rad.high), row.detected, row.fitness_mean,
        1000 * row.frame_s, row.evaluations_per_frame);
  text += "\nrank correlation of F with the error (-1: F tells it perfectly)\n";
  for (const MarkerKind marker : Distinct(rows, [](const CompareRow& r) { return r.cell.marker; }))
    for (const std::string& name : Distinct(rows, [](const CompareRow& r) { return r.estimator; }))
      text += fmt::format("{:8} {:10} {:+.2f}\n", NameOf(marker), name,
                          FitnessErrorCorrelation(rows, marker, name));
  text.pop_back();
  return text;
}

std::string CompareCsv(const std::vector<CompareRow>& rows) {
  std::string text =
      "marker,distance_mm,milk_ml_m3,estimator,starts,found,found_low,found_high,error_median_mm,"
      "error_median_low_mm,error_median_high_mm,error_95_mm,error_worst_mm,rotation_median_deg,"
      "rotation_median_low_deg,rotation_median_high_deg,detected,fitness_mean,"
      "frame_ms,evaluations_per_frame\n";
  for (const CompareRow& row : rows)
    text += fmt::format(
        "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", NameOf(row.cell.marker),
        MmFromM(row.cell.distance_m), row.cell.milk_ml_m3, row.estimator, row.starts, row.found,
        row.found_interval.low, row.found_interval.high, MmFromM(row.error_median_m),
        MmFromM(row.error_median_interval_m.low), MmFromM(row.error_median_interval_m.high),
        MmFromM(row.error_95_m), MmFromM(row.error_worst_m), DegFromRad(row.rotation_median_rad),
        DegFromRad(row.rotation_median_interval_rad.low),
        DegFromRad(row.rotation_median_interval_rad.high), row.detected, row.fitness_mean,
        1000 * row.frame_s, row.evaluations_per_frame);
  return text;
}

std::string CompareJson(const std::vector<CompareRow>& rows) {
  nlohmann::ordered_json json = {{"cells", nlohmann::ordered_json::array()},
                                 {"fitness_error_correlation", nlohmann::ordered_json::array()}};
  for (const CompareRow& row : rows) {
    auto misses = nlohmann::ordered_json::array();
    for (const CompareMiss& miss : row.misses) {
      const Eigen::Vector3d& p = miss.true_X_HM.p;
      const Eigen::Quaterniond& q = miss.true_X_HM.q;
      misses.push_back({{"position_m", {p.x(), p.y(), p.z()}},
                        {"quaternion_wxyz", {q.w(), q.x(), q.y(), q.z()}},
                        {"error_m", miss.error_m},
                        {"rotation_rad", miss.rotation_rad},
                        {"fitness", miss.fitness}});
    }
    json["cells"].push_back(
        {{"marker", NameOf(row.cell.marker)},
         {"distance_mm", MmFromM(row.cell.distance_m)},
         {"milk_ml_m3", row.cell.milk_ml_m3},
         {"estimator", row.estimator},
         {"starts", row.starts},
         {"found", row.found},
         {"found_interval", {row.found_interval.low, row.found_interval.high}},
         {"error_median_m", row.error_median_m},
         {"error_median_interval_m",
          {row.error_median_interval_m.low, row.error_median_interval_m.high}},
         {"error_95_m", row.error_95_m},
         {"error_worst_m", row.error_worst_m},
         {"rotation_median_rad", row.rotation_median_rad},
         {"rotation_median_interval_rad",
          {row.rotation_median_interval_rad.low, row.rotation_median_interval_rad.high}},
         {"detected", row.detected},
         {"fitness_mean", row.fitness_mean},
         {"frame_s", row.frame_s},
         {"evaluations_per_frame", row.evaluations_per_frame},
         {"misses", misses}});
  }
  for (const MarkerKind marker : Distinct(rows, [](const CompareRow& r) { return r.cell.marker; }))
    for (const std::string& name : Distinct(rows, [](const CompareRow& r) { return r.estimator; }))
      json["fitness_error_correlation"].push_back(
          {{"marker", NameOf(marker)},
           {"estimator", name},
           {"spearman", FitnessErrorCorrelation(rows, marker, name)}});
  return json.dump(2) + "\n";
}

void WriteCompareFigure(const std::string& path, const std::vector<CompareRow>& rows) {
  const auto estimators = Distinct(rows, [](const CompareRow& r) { return r.estimator; });
  const auto places = Distinct(rows, [](const CompareRow& r) {
    return std::pair{r.cell.marker, r.cell.distance_m};
  });
  GnuplotScript script;
  script.Line("set encoding utf8").Line("set datafile missing 'NaN'");
  for (size_t p = 0; p < places.size(); ++p)
    for (size_t e = 0; e < estimators.size(); ++e) {
      script.BeginData(fmt::format("d{}_{}", p, e));
      for (const CompareRow& row : rows)
        if (std::pair{row.cell.marker, row.cell.distance_m} == places[p] &&
            row.estimator == estimators[e])
          script.Row({row.cell.milk_ml_m3, 100.0 * row.found / row.starts,
                      100 * row.found_interval.low, 100 * row.found_interval.high,
                      MmFromM(row.error_median_m), MmFromM(row.error_median_interval_m.low),
                      MmFromM(row.error_median_interval_m.high)});
      script.EndData();
    }
  script.Line(fmt::format("set multiplot layout {},2", places.size()));
  script.Line("set offsets graph 0.03, graph 0.03, 0, 0")
      .Line("set grid lc rgb '#dddddd'")
      .Line("set xlabel 'milk [ml/m^3]'");
  for (size_t p = 0; p < places.size(); ++p) {
    const std::string where =
        fmt::format("{} marker, {:.0f} mm", NameOf(places[p].first), MmFromM(places[p].second));
    for (const bool errors : {false, true}) {
      script.Line(fmt::format("set title '{}'", where));
      script.Line(errors ? "set ylabel 'median error [mm]'" : "set ylabel 'found [%]'");
      script.Line(errors ? "set logscale y" : "unset logscale y");
      script.Line(errors ? "set yrange [0.05:2000]" : "set yrange [-3:103]");
      script.Line(p == 0 && errors ? "set key outside right top samplen 1" : "unset key");
      std::string plot = "plot ";
      for (size_t e = 0; e < estimators.size(); ++e)
        plot += fmt::format(
            "{}$d{}_{} using 1:{} with linespoints lw 2 pt 7 ps 0.7 lc {} title {}, "
            "$d{}_{} using 1:{} with yerrorbars lw 1 pt 0 lc {} notitle",
            e == 0 ? "" : ", ", p, e, errors ? "5" : "2", e + 1, GnuplotQuoted(estimators[e]), p, e,
            errors ? "5:6:7" : "2:3:4", e + 1);
      script.Line(plot);
    }
  }
  script.Line("unset multiplot");
  script.WritePng(path, 1300, static_cast<int>(360 * places.size()));
}

}  // namespace turbidock::experiments
