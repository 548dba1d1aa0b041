// How a comparison of estimators is told: table, CSV, JSON, figure.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "experiments/media/plot.h"
#include "experiments/studies/estimators/compare_estimators.h"
#include "sim/base/units.h"

namespace turbidock::estimators {
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

std::string FramesText(const std::optional<int>& frames) {
  return frames ? fmt::format("{}", *frames) : "-";
}

nlohmann::ordered_json JsonOf(const std::optional<int>& frames) {
  return frames ? nlohmann::ordered_json(*frames) : nlohmann::ordered_json(nullptr);
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
  size_t name_width = 10;
  for (const CompareRow& row : rows) name_width = std::max(name_width, row.estimator.size());
  std::string text = fmt::format(
      "{:8} {:>5} {:>6}  {:{}} {:>9} {:>13} {:>20} {:>7} {:>7} {:>18} {:>8} {:>6} {:>8} {:>6} "
      "{:>6} {:>4}\n",
      "marker", "mm", "ml/m3", "estimator", name_width, "found", "95 %", "median error mm",
      "95 % mm", "worst", "median error deg", "detected", "F", "ms/frame", "evals", "frames",
      "95 %");
  for (const CompareRow& row : rows)
    text += fmt::format(
        "{:8} {:>5} {:6g}  {:{}} {:4}/{:<4} {:5.2f}..{:<5.2f} {:7.1f} ({:5.1f}..{:5.1f}) {:7.1f} "
        "{:7.1f} {:5.2f} ({:4.2f}..{:5.2f}) {:8.4f} {:6.2f} {:8.2f} {:6.0f} {:>6} {:>4}\n",
        NameOf(row.cell.marker), DistanceText(row), row.cell.milk_ml_m3, row.estimator, name_width,
        row.found, row.starts, row.found_interval.low, row.found_interval.high,
        MmFromM(row.error_median_m), MmFromM(row.error_median_interval_m.low),
        MmFromM(row.error_median_interval_m.high), MmFromM(row.error_95_m),
        MmFromM(row.error_worst_m), DegFromRad(row.rotation_median_rad),
        DegFromRad(row.rotation_median_interval_rad.low),
        DegFromRad(row.rotation_median_interval_rad.high), row.detected, row.fitness_mean,
        1000 * row.frame_s, row.evaluations_per_frame, FramesText(row.frames_median),
        FramesText(row.frames_95));
  text += "\nrank correlation of F with the error (-1: F tells it perfectly)\n";
  ForEachMarkerAndEstimator(rows, [&](recognition::MarkerKind marker, const std::string& name) {
    text += fmt::format("{:8} {:{}} {:+.2f}\n", NameOf(marker), name, name_width,
                        FitnessErrorCorrelation(rows, marker, name));
  });
  text +=
      fmt::format("\nwhat F tells\n{:8} {:{}} {:>11} {:>9} {:>13} {:>16} {:>16}\n", "marker",
                  "estimator", name_width, "F", "found", "95 %", "error mm (95 %)", "deg (95 %)");
  ForEachMarkerAndEstimator(rows, [&](recognition::MarkerKind marker, const std::string& name) {
    for (const FitnessBin& bin : FitnessBins(rows, marker, name))
      text += fmt::format(
          "{:8} {:{}} {:5.2f}..{:<4.2f} {:4}/{:<4} {:5.3f}..{:<5.3f} {:7.2f} ({:6.2f}) {:7.3f} "
          "({:6.3f})\n",
          NameOf(marker), name, name_width, bin.low, bin.high, bin.found, bin.starts,
          bin.found_interval.low, bin.found_interval.high, MmFromM(bin.error_median_m),
          MmFromM(bin.error_95_m), DegFromRad(bin.rotation_median_rad),
          DegFromRad(bin.rotation_95_rad));
  });
  text.pop_back();
  return text;
}

std::string CompareCsv(const std::vector<CompareRow>& rows) {
  std::string text =
      "marker,distance_mm,milk_ml_m3,estimator,starts,found,found_low,found_high,error_median_mm,"
      "error_median_low_mm,error_median_high_mm,error_95_mm,error_worst_mm,rotation_median_deg,"
      "rotation_median_low_deg,rotation_median_high_deg,rotation_95_deg,detected,fitness_mean,"
      "frame_ms,evaluations_per_frame,frames_median,frames_95\n";
  const auto frames = [](const std::optional<int>& n) { return n ? FramesText(n) : ""; };
  for (const CompareRow& row : rows)
    text += fmt::format(
        "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n",
        NameOf(row.cell.marker), MmFromM(row.cell.distance_m), row.cell.milk_ml_m3, row.estimator,
        row.starts, row.found, row.found_interval.low, row.found_interval.high,
        MmFromM(row.error_median_m), MmFromM(row.error_median_interval_m.low),
        MmFromM(row.error_median_interval_m.high), MmFromM(row.error_95_m),
        MmFromM(row.error_worst_m), DegFromRad(row.rotation_median_rad),
        DegFromRad(row.rotation_median_interval_rad.low),
        DegFromRad(row.rotation_median_interval_rad.high), DegFromRad(row.rotation_95_rad),
        row.detected, row.fitness_mean, 1000 * row.frame_s, row.evaluations_per_frame,
        frames(row.frames_median), frames(row.frames_95));
  return text;
}

std::string CompareJson(const std::vector<CompareRow>& rows) {
  nlohmann::ordered_json json = {{"cells", nlohmann::ordered_json::array()},
                                 {"fitness_error_correlation", nlohmann::ordered_json::array()},
                                 {"fitness_bins", nlohmann::ordered_json::array()}};
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
         {"rotation_95_rad", row.rotation_95_rad},
         {"detected", row.detected},
         {"fitness_mean", row.fitness_mean},
         {"frame_s", row.frame_s},
         {"evaluations_per_frame", row.evaluations_per_frame},
         {"frames_median", JsonOf(row.frames_median)},
         {"frames_95", JsonOf(row.frames_95)},
         {"misses", misses}});
  }
  ForEachMarkerAndEstimator(rows, [&](recognition::MarkerKind marker, const std::string& name) {
    json["fitness_error_correlation"].push_back(
        {{"marker", NameOf(marker)},
         {"estimator", name},
         {"spearman", FitnessErrorCorrelation(rows, marker, name)}});
    for (const FitnessBin& bin : FitnessBins(rows, marker, name))
      json["fitness_bins"].push_back(
          {{"marker", NameOf(marker)},
           {"estimator", name},
           {"fitness", {bin.low, bin.high}},
           {"starts", bin.starts},
           {"found", bin.found},
           {"found_interval", {bin.found_interval.low, bin.found_interval.high}},
           {"error_median_m", bin.error_median_m},
           {"error_95_m", bin.error_95_m},
           {"rotation_median_rad", bin.rotation_median_rad},
           {"rotation_95_rad", bin.rotation_95_rad}});
  });
  return json.dump(2) + "\n";
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
  media::Figure figure{.columns = 3, .width_px = 500, .height_px = 360};
  for (const std::string& title : panels) {
    media::Panel found{.title = title,
                       .x = {"milk [ml/m³]", -margin_ml_m3, most_ml_m3 + margin_ml_m3},
                       .y = {"found [%]", -3, 103}};
    media::Panel position = found, rotation = found;
    position.y = {"median error [mm]", 0.05, 2000, true};
    rotation.y = {"median error [deg]", 0.02, 100, true};
    rotation.legend = media::Legend::kBeside;
    for (size_t l = 0; l < lines.size(); ++l) {
      media::Series shares{lines[l], {}, media::CurveColor(l), media::Mark::kLineWithBars};
      media::Series errors = shares, turns = shares;
      for (const CompareRow& r : rows) {
        if (PlaceOf(r, one) != Place{title, lines[l]}) continue;
        const double milk = r.cell.milk_ml_m3, share = static_cast<double>(r.found) / r.starts;
        shares.points.push_back(media::SampleWithin(milk, share, r.found_interval, 100));
        errors.points.push_back(
            media::SampleWithin(milk, r.error_median_m, r.error_median_interval_m, MmFromM(1)));
        turns.points.push_back(media::SampleWithin(milk, r.rotation_median_rad,
                                                   r.rotation_median_interval_rad, DegFromRad(1)));
      }
      found.series.push_back(shares);
      position.series.push_back(errors);
      rotation.series.push_back(turns);
    }
    figure.panels.insert(figure.panels.end(), {found, position, rotation});
  }
  media::WritePng(path, figure);
}

}  // namespace turbidock::estimators
