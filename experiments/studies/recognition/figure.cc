#include "experiments/studies/recognition/figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "experiments/media/canvas.h"
#include "experiments/media/figure.h"
#include "experiments/media/png.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/units.h"
#include "vision/overlay.h"

namespace turbidock::recognition {
namespace {

using units::MmFromM;

constexpr trial::ViewCriteria kLimits;

constexpr std::array<Rgb, 3> kAreaColors{{{60, 168, 110}, {232, 184, 60}, {192, 198, 204}}};

const Rgb& ColorOf(Area area) { return kAreaColors[static_cast<size_t>(area)]; }

std::vector<MarkerKind> MarkersIn(const std::vector<CellResult>& results) {
  std::set<MarkerKind> markers;
  for (const CellResult& r : results) markers.insert(r.cell.marker);
  return {markers.begin(), markers.end()};
}

// Of one marker, by distance and then milk.
using Columns = std::map<double, std::map<double, const CellResult*>>;
Columns ColumnsOf(const std::vector<CellResult>& results, MarkerKind marker) {
  Columns columns;
  for (const CellResult& r : results)
    if (r.cell.marker == marker) columns[r.cell.distance_m][r.cell.milk_ml_m3] = &r;
  return columns;
}

// A panel over all of its milk.
report::Panel MilkPanel(const std::string& title, const Columns& columns) {
  double most = 1;
  for (const auto& [distance_m, column] : columns) most = std::max(most, column.rbegin()->first);
  return {.title = title, .x = {"milk, ml/m³", 0, 1.03 * most}};
}

bool IsPublished(const TableRow& row, MarkerKind marker, double distance_m) {
  return row.cell.marker == marker && row.cell.distance_m == distance_m;
}

// From dark to bright over the whole scale, both images alike: at night they show little otherwise.
void StretchContrast(StereoImage* images) {
  std::array<int, 256> histogram{};
  int values = 0;
  for (const Image3u8* image : {&images->left, &images->right}) {
    const int count = 3 * image->width() * image->height();
    for (int i = 0; i < count; ++i) ++histogram[image->data()[i]];
    values += count;
  }
  const auto quantile = [&](double share) {
    int dn = 0;
    for (int below = histogram[0]; dn < 255 && below < share * values;)
      below += histogram[static_cast<size_t>(++dn)];
    return dn;
  };
  const int dark = quantile(0.01), bright = std::max(quantile(0.9995), dark + 1);
  for (Image3u8* image : {&images->left, &images->right})
    for (int i = 0; i < 3 * image->width() * image->height(); ++i) {
      uint8_t& dn = image->data()[i];
      dn = static_cast<uint8_t>(std::clamp(255 * (dn - dark) / (bright - dark), 0, 255));
    }
}

// A row of areas over milk; each reaches half way to its neighbours.
void AddAreas(const std::map<double, Area>& row, double low, double high, report::Panel* panel) {
  for (auto here = row.begin(); here != row.end(); ++here) {
    const double milk = here->first;
    const double from = here == row.begin() ? milk : (std::prev(here)->first + milk) / 2;
    const double to = std::next(here) == row.end() ? milk + (here == row.begin() ? 1 : milk - from)
                                                   : (std::next(here)->first + milk) / 2;
    panel->blocks.push_back({"", from, to, low, high, ColorOf(here->second)});
  }
}

}  // namespace

void WriteFitnessFigure(const std::string& path, const std::vector<CellResult>& results,
                        const std::vector<TableRow>& published) {
  report::Figure figure{.width_px = 1200, .height_px = 520};
  for (const MarkerKind marker : MarkersIn(results)) {
    const Columns columns = ColumnsOf(results, marker);
    report::Panel panel = MilkPanel(fmt::format("{} marker", NameOf(marker)), columns);
    panel.y = {"mean F", -0.25, 1};
    panel.rules = {{kLimits.docking_fitness, "Area I above", ColorOf(Area::kI)},
                   {kLimits.detection_fitness, "Area III below"}};
    panel.legend = report::Legend::kBeside;
    size_t i = 0;
    for (const auto& [distance_m, column] : columns) {
      const Rgb& color = report::CurveColor(i++);
      report::Series ours{
          fmt::format("{:g} mm", MmFromM(distance_m)), {}, color, report::Mark::kLineWithBand};
      report::Series theirs{"published", {}, color, report::Mark::kRings};
      for (const auto& [milk, r] : column)
        ours.points.push_back({milk, r->fitness_mean, r->fitness_mean - r->fitness_std,
                               r->fitness_mean + r->fitness_std});
      for (const TableRow& row : published)
        if (IsPublished(row, marker, distance_m))
          theirs.points.push_back({row.cell.milk_ml_m3, row.fitness_mean});
      panel.series.push_back(ours);
      if (!theirs.points.empty()) panel.series.push_back(theirs);
    }
    figure.panels.push_back(panel);
  }
  media::WriteFigure(path, figure);
}

void WriteAreaFigure(const std::string& path, const std::vector<CellResult>& results,
                     const std::vector<TableRow>& published) {
  report::Figure figure{.width_px = 1200, .height_px = 380};
  for (const MarkerKind marker : MarkersIn(results)) {
    const Columns columns = ColumnsOf(results, marker);
    report::Panel panel =
        MilkPanel(fmt::format("{} marker: Area I green, II yellow, III grey; thin: published",
                              NameOf(marker)),
                  columns);
    panel.y.label = "distance, mm";
    for (const auto& [distance_m, column] : columns) {
      std::map<double, Area> ours, theirs;
      for (const auto& [milk, r] : column) ours[milk] = r->area;
      for (const TableRow& entry : published)
        if (IsPublished(entry, marker, distance_m))
          theirs[entry.cell.milk_ml_m3] = AreaOf(entry.fitness_mean);
      const auto row = static_cast<double>(panel.y.names.size());
      AddAreas(ours, row - 0.1, row + 0.4, &panel);
      AddAreas(theirs, row - 0.35, row - 0.15, &panel);
      panel.y.names.push_back(fmt::format("{:g}", MmFromM(distance_m)));
    }
    figure.panels.push_back(panel);
  }
  media::WriteFigure(path, figure);
}

void WriteTimeFigure(const std::string& path, const std::vector<CellResult>& results,
                     double frames_per_second) {
  std::map<std::tuple<MarkerKind, double, Area>, const CellResult*> chosen;
  for (const CellResult& r : results)
    chosen.try_emplace({r.cell.marker, r.cell.distance_m, r.area}, &r);
  report::Figure figure{.columns = 2, .width_px = 650, .height_px = 250};
  for (const auto& [key, r] : chosen) {
    report::Series series{.width_px = 1};
    for (const float f : r->fitness)
      series.points.push_back(
          {static_cast<double>(series.points.size()) / frames_per_second, static_cast<double>(f)});
    figure.panels.push_back(
        {.title = fmt::format("{}, {:g} mm, {:g} ml/m³: mean {:.3f} ± {:.3f}, Area {}",
                              NameOf(r->cell.marker), MmFromM(r->cell.distance_m),
                              r->cell.milk_ml_m3, r->fitness_mean, r->fitness_std, NameOf(r->area)),
         .x = {"time, s"},
         .y = {"F", -0.25, 1},
         .series = {series},
         .rules = {{r->fitness_mean, "", report::CurveColor(1), report::Mark::kLine}}});
  }
  media::WriteFigure(path, figure);
}

void WriteContactSheet(const std::string& path, const Recognition& recognition,
                       const std::vector<CellResult>& results, int columns) {
  constexpr int kImageWidth = 240, kImageHeight = 180, kGap = 8, kHead = 26, kSide = 90;
  const MarkerKind marker = results.front().cell.marker;
  const Columns by_distance = ColumnsOf(results, marker);
  std::set<double> steps;
  for (const auto& [distance_m, column] : by_distance)
    for (const auto& [milk, r] : column) steps.insert(milk);
  std::vector<double> milk(steps.begin(), steps.end());
  if (std::ssize(milk) > columns) {
    std::vector<double> some;
    some.reserve(static_cast<size_t>(columns));
    for (int i = 0; i < columns; ++i)
      some.push_back(milk[static_cast<size_t>(i) * (milk.size() - 1) /
                          static_cast<size_t>(std::max(1, columns - 1))]);
    milk = std::move(some);
  }
  const int cell_width = 2 * kImageWidth + 2 * kGap, cell_height = kImageHeight + kHead;
  media::Canvas sheet(kSide + cell_width * static_cast<int>(milk.size()),
                      kHead + cell_height * static_cast<int>(by_distance.size()));
  const trial::Scenario& scenario = recognition.scenario(marker);
  const StereoRig rig = scenario.rig.MakeRig();
  constexpr Rgb kText{220, 226, 232};
  int row = 0;
  for (const auto& [distance_m, column] : by_distance) {
    const int y = kHead + cell_height * row++;
    sheet.Text({8, y + kImageHeight / 2.0}, fmt::format("{:g} mm", MmFromM(distance_m)), 16, kText);
    if (row == 1) sheet.Text({8, 18}, "stretched", 12, kText);
    for (size_t i = 0; i < milk.size(); ++i) {
      const int x = kSide + cell_width * static_cast<int>(i);
      if (row == 1)
        sheet.Text({x + cell_width / 2.0, 18}, fmt::format("{:g} ml/m³", milk[i]), 16, kText,
                   media::Align::kCenter, true);
      const auto found = column.find(milk[i]);
      if (found == column.end()) continue;
      const CellResult& r = *found->second;
      StereoImage seen = recognition.Image(r.cell, std::ssize(r.fitness) - 1);
      StretchContrast(&seen);
      for (const Side side : kSides) {
        const Image3u8& image = seen[side];
        const int left = side == Side::kLeft ? x : x + kImageWidth + kGap / 2;
        const media::PixelRect into = sheet.DrawImage(image, {left, y, kImageWidth, kImageHeight});
        sheet.Clip(into);
        const double scale = static_cast<double>(into.width) / image.width();
        for (const vision::ProjectedBall& ball :
             vision::ProjectBalls(scenario.marker, rig[side], r.last_X_HM)) {
          const Eigen::Vector2d center(into.x + scale * (ball.center_px.x() + 0.5) - 0.5,
                                       into.y + scale * (ball.center_px.y() + 0.5) - 0.5);
          sheet.DottedCircle(center, scale * ball.radius_px, 16, 2, {255, 255, 255});
          sheet.DottedCircle(center, scale * ball.radius_px * scenario.marker.outer_ring_ratio, 24,
                             1.5, ball.rgb);
        }
        sheet.Unclip();
      }
      sheet.Text(
          {x + kImageWidth + kGap / 4.0, y + kImageHeight + 17.0},
          fmt::format("F {:.2f} ± {:.2f}, Area {}", r.fitness_mean, r.fitness_std, NameOf(r.area)),
          14, kText, media::Align::kCenter);
    }
  }
  media::WritePng(path, sheet.ToImage());
}

}  // namespace turbidock::recognition
