#include "experiments/studies/recognition/figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "experiments/media/canvas.h"
#include "experiments/media/gnuplot.h"
#include "experiments/media/png.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/units.h"
#include "vision/overlay.h"

namespace turbidock::recognition {
namespace {

using units::MmFromM;

constexpr trial::ViewCriteria kLimits;

// Near to far, from light to dark water.
constexpr std::array<const char*, 6> kCurveColors = {"#1868b2", "#2e9b6b", "#d89818",
                                                     "#c82860", "#7a4fb0", "#5a6672"};
constexpr std::array<const char*, 3> kAreaColors = {"#3ca86e", "#e8b83c", "#c0c6cc"};

const char* ColorOfCurve(size_t i) { return kCurveColors[i % kCurveColors.size()]; }
const char* ColorOfArea(Area area) { return kAreaColors[static_cast<size_t>(area)]; }

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

double MostMilk(const Columns& columns) {
  double most = 1;
  for (const auto& [distance_m, column] : columns) most = std::max(most, column.rbegin()->first);
  return most;
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

// What all panels have in common.
void BeginPanels(size_t panels, media::GnuplotScript* script) {
  script->Line("set border 3 linecolor rgb '#465058'")
      .Line("set tics nomirror out textcolor rgb '#465058'")
      .Line("set grid linecolor rgb '#e4e8ec' linetype 1")
      .Line(fmt::format("set multiplot layout {},1", panels));
}

}  // namespace

void WriteFitnessFigure(const std::string& path, const std::vector<CellResult>& results,
                        const std::vector<TableRow>& published) {
  media::GnuplotScript script;
  const std::vector<MarkerKind> markers = MarkersIn(results);
  BeginPanels(markers.size(), &script);
  script.Line("set yrange [-0.25:1]")
      .Line("set ylabel 'mean F'")
      .Line("set xlabel 'milk, ml/m³'")
      .Line("set key outside right top Left reverse samplen 1.5");
  for (const MarkerKind marker : markers) {
    const Columns columns = ColumnsOf(results, marker);
    script.Line("set title " + media::GnuplotQuoted(fmt::format("{} marker", NameOf(marker))))
        .Line(fmt::format("set xrange [0:{}]", FormatNumber(1.03 * MostMilk(columns))));
    std::string plot = fmt::format(
        "plot {} title 'Area I above' with lines dashtype 2 linecolor rgb '#3ca86e', {} title "
        "'Area III below' with lines dashtype 2 linecolor rgb '#8a949c'",
        kLimits.docking_fitness, kLimits.detection_fitness);
    size_t i = 0;
    for (const auto& [distance_m, column] : columns) {
      const std::string name = fmt::format("{}{}", NameOf(marker), i);
      script.BeginData(name);
      for (const auto& [milk, r] : column)
        script.Row({milk, r->fitness_mean, r->fitness_mean - r->fitness_std,
                    r->fitness_mean + r->fitness_std});
      script.EndData().BeginData("p" + name);
      bool any = false;
      for (const TableRow& row : published)
        if (IsPublished(row, marker, distance_m)) {
          script.Row({row.cell.milk_ml_m3, row.fitness_mean});
          any = true;
        }
      script.EndData();
      const std::string color = media::GnuplotQuoted(ColorOfCurve(i));
      plot += fmt::format(
          ", ${0} using 1:3:4 notitle with filledcurves fillstyle transparent solid 0.15 "
          "noborder linecolor rgb {1}, ${0} using 1:2 title '{2:g} mm' with lines linewidth 2 "
          "linecolor rgb {1}",
          name, color, MmFromM(distance_m));
      if (any)
        plot += fmt::format(
            ", $p{} using 1:2 title 'published' with points pointtype 6 pointsize 0.9 linecolor "
            "rgb {}",
            name, color);
      ++i;
    }
    script.Line(plot);
  }
  script.Line("unset multiplot");
  script.WritePng(path, 1200, 80 + 480 * static_cast<int>(markers.size()));
}

void WriteAreaFigure(const std::string& path, const std::vector<CellResult>& results,
                     const std::vector<TableRow>& published) {
  media::GnuplotScript script;
  const std::vector<MarkerKind> markers = MarkersIn(results);
  BeginPanels(markers.size(), &script);
  script.Line("unset key").Line("set xlabel 'milk, ml/m³'").Line("set ylabel 'distance, mm'");
  int object = 0;
  // A row of areas; each reaches half way to its neighbours.
  const auto draw_row = [&](const std::map<double, Area>& row, double low, double high) {
    for (auto here = row.begin(); here != row.end(); ++here) {
      const double from =
          here == row.begin() ? here->first : (std::prev(here)->first + here->first) / 2;
      const double to = std::next(here) == row.end()
                            ? here->first + (here == row.begin() ? 1 : here->first - from)
                            : (std::next(here)->first + here->first) / 2;
      script.Line(fmt::format(
          "set object {} rectangle from {},{} to {},{} fillstyle solid noborder fillcolor rgb '{}'",
          ++object, FormatNumber(from), FormatNumber(low), FormatNumber(to), FormatNumber(high),
          ColorOfArea(here->second)));
    }
  };
  for (const MarkerKind marker : markers) {
    const Columns columns = ColumnsOf(results, marker);
    std::string ticks;
    int row = 0;
    for (const auto& [distance_m, column] : columns) {
      std::map<double, Area> ours, theirs;
      for (const auto& [milk, r] : column) ours[milk] = r->area;
      for (const TableRow& entry : published)
        if (IsPublished(entry, marker, distance_m))
          theirs[entry.cell.milk_ml_m3] = AreaOf(entry.fitness_mean);
      draw_row(ours, row - 0.1, row + 0.4);
      draw_row(theirs, row - 0.35, row - 0.15);
      ticks += fmt::format("{}'{:g}' {}", ticks.empty() ? "" : ", ", MmFromM(distance_m), row);
      ++row;
    }
    script
        .Line("set title " +
              media::GnuplotQuoted(fmt::format(
                  "{} marker: Area I green, II yellow, III grey; thin: published", NameOf(marker))))
        .Line("set ytics (" + ticks + ")")
        .Line(fmt::format("set yrange [-0.6:{}]", row - 0.4))
        .Line(fmt::format("set xrange [0:{}]", FormatNumber(1.03 * MostMilk(columns))))
        .Line("plot NaN")
        .Line("unset object");
    object = 0;
  }
  script.Line("unset multiplot");
  script.WritePng(path, 1200, 80 + 340 * static_cast<int>(markers.size()));
}

void WriteTimeFigure(const std::string& path, const std::vector<CellResult>& results,
                     double frames_per_second) {
  std::map<std::tuple<MarkerKind, double, Area>, const CellResult*> chosen;
  for (const CellResult& r : results)
    chosen.try_emplace({r.cell.marker, r.cell.distance_m, r.area}, &r);
  media::GnuplotScript script;
  script.Line("set border 3 linecolor rgb '#465058'")
      .Line("set tics nomirror out")
      .Line("set grid linecolor rgb '#e4e8ec' linetype 1")
      .Line("unset key")
      .Line("set yrange [-0.25:1]")
      .Line("set ylabel 'F'");
  const int rows = (static_cast<int>(chosen.size()) + 1) / 2;
  script.Line(fmt::format("set multiplot layout {},2", rows));
  int i = 0;
  for (const auto& [key, r] : chosen) {
    const std::string name = fmt::format("t{}", i++);
    script.BeginData(name);
    double time_s = 0;
    for (const float f : r->fitness) {
      script.Row({time_s, static_cast<double>(f)});
      time_s += 1 / frames_per_second;
    }
    script.EndData()
        .Line("set title " +
              media::GnuplotQuoted(fmt::format(
                  "{}, {:g} mm, {:g} ml/m³: mean {:.3f} ± {:.3f}, Area {}", NameOf(r->cell.marker),
                  MmFromM(r->cell.distance_m), r->cell.milk_ml_m3, r->fitness_mean, r->fitness_std,
                  NameOf(r->area))))
        .Line("set xlabel 'time, s'")
        .Line(fmt::format("plot ${0} using 1:2 with lines linecolor rgb '#1868b2', {1} with lines "
                          "linewidth 2 linecolor rgb '#c82860'",
                          name, FormatNumber(r->fitness_mean)));
  }
  script.Line("unset multiplot");
  script.WritePng(path, 1300, 60 + 240 * rows);
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
