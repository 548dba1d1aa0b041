#include "experiments/media/panel_chart.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace turbidock::media {
namespace {

using report::Mark;
using report::Panel;

constexpr Rgb kRed{255, 0, 0};
constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

// A red line by `of` every 0.1 s, in a range of y.
Panel Line(double low, double high, int from, int to, const std::function<double(double)>& of) {
  Panel panel{
      .title = "q", .y = {.low = low, .high = high}, .series = {{.color = kRed, .width_px = 1.25}}};
  for (int i = from; i <= to; ++i) panel.series[0].points.push_back({0.1 * i, of(0.1 * i)});
  return panel;
}

Image3u8 Picture(const PanelChart& chart) {
  Canvas canvas(400, 160);  // as large as any of them
  chart.DrawTo(&canvas, 0, 0);
  return canvas.ToImage();
}

// The rows of a column that are red, weighted by how red they are; the mean of them is where the
// curve runs. NaN when there are none.
double CurveRow(const Image3u8& image, int column) {
  double weight = 0, moment = 0;
  for (int v = 0; v < image.height(); ++v) {
    const uint8_t* p = image.at(column, v);
    const double red = p[0] - std::max(p[1], p[2]);
    if (red < 20) continue;
    weight += red;
    moment += red * v;
  }
  return moment / weight;
}

// There is a quarter of the range below and above.
TEST(PanelChart, EndsOfTheRangesAreTheEndsOfThePlot) {
  PanelChart chart(8, 300, 120);
  chart.Draw(Line(0, 100, 0, 0, [](double) { return 0; }));
  const PixelRect& plot = chart.plot();
  EXPECT_DOUBLE_EQ(chart.RowOf(125), plot.y);
  EXPECT_DOUBLE_EQ(chart.RowOf(-25), plot.bottom() - 1);
  EXPECT_DOUBLE_EQ(chart.RowOf(50), plot.y + (plot.height - 1) / 2.0);
  EXPECT_DOUBLE_EQ(chart.ColumnOf(0), plot.x);
  EXPECT_DOUBLE_EQ(chart.ColumnOf(8), plot.right() - 1);
  EXPECT_DOUBLE_EQ(chart.ColumnOf(2), plot.x + (plot.width - 1) / 4.0);
}

// A straight ramp from (0 s, low) to (span, high) is the plot's diagonal.
TEST(PanelChart, RampIsTheDiagonal) {
  PanelChart chart(20, 400, 160);
  chart.Draw(Line(2.5, 7.5, 0, 200, [](double t_s) { return 1.25 + 0.375 * t_s; }));
  const Image3u8 image = Picture(chart);
  const PixelRect& plot = chart.plot();
  for (int u = plot.x + 3; u < plot.right() - 3; ++u) {
    const double share = static_cast<double>(u - plot.x) / (plot.width - 1);
    ASSERT_NEAR(CurveRow(image, u), plot.bottom() - 1 - share * (plot.height - 1), 0.6) << u;
  }
}

TEST(PanelChart, GapsAreNotBridgedAndTheLineEndsAtTheLastTime) {
  PanelChart chart(20, 400, 160);
  chart.Draw(Line(0, 10, 0, 150, [](double t_s) {
    return std::abs(t_s - 7.5) < 0.01 ? 9 : std::abs(t_s - 7.5) < 2.45 ? kGap : 4;
  }));
  const Image3u8 image = Picture(chart);
  for (const double t_s : {6.0, 7.0, 8.0, 9.5, 15.3})
    EXPECT_TRUE(std::isnan(CurveRow(image, static_cast<int>(chart.ColumnOf(t_s))))) << t_s;
  for (const double t_s : {1.0, 12.0, 14.9})
    EXPECT_NEAR(CurveRow(image, static_cast<int>(chart.ColumnOf(t_s))), chart.RowOf(4), 0.6);
  // the lone value in the gap is a dot
  EXPECT_NEAR(CurveRow(image, static_cast<int>(std::lround(chart.ColumnOf(7.5)))), chart.RowOf(9),
              0.6);
}

// Two routes to one picture: point by point, and all at once.
TEST(PanelChart, WhatGrewIsWhatIsDrawnAtOnce) {
  const auto wave = [](double t_s) { return std::fmod(t_s, 9.7) < 0.05 ? kGap : std::sin(t_s); };
  PanelChart grown(80, 300, 120), whole(80, 300, 120);
  EXPECT_FALSE(grown.Add(Line(-1, 1, 0, 0, wave))) << "nothing has been drawn";
  grown.Draw(Line(-1, 1, 0, 0, wave));
  for (int i = 1; i <= 700; ++i) ASSERT_TRUE(grown.Add(Line(-1, 1, i - 1, i, wave)));
  whole.Draw(Line(-1, 1, 0, 700, wave));
  EXPECT_TRUE(Picture(grown) == Picture(whole));
  // a range that is outgrown changes nothing
  EXPECT_FALSE(grown.Add(Line(-1, 1.6, 699, 701, wave)));
  EXPECT_TRUE(Picture(grown) == Picture(whole));
  EXPECT_TRUE(grown.Add(Line(-1, 1.4, 699, 700, wave)));
}

TEST(PanelChart, BandIsFilledBetweenItsEnds) {
  Panel panel = Line(-100, 100, 0, 100, [](double) { return 10; });
  PanelChart with(20, 300, 140), without(20, 300, 140);
  without.Draw(panel);
  panel.series[0].mark = Mark::kBand;
  for (report::Sample& sample : panel.series[0].points) sample = {sample.x, 10, -30, 50};
  panel.series.push_back({});
  with.Draw(panel);
  const Image3u8 a = Picture(with), b = Picture(without);
  const int u = static_cast<int>(with.ColumnOf(4));
  int first = -1, last = -1;
  for (int v = 0; v < a.height(); ++v) {
    if (a.at(u, v)[0] == b.at(u, v)[0]) continue;
    if (first < 0) first = v;
    last = v;
  }
  EXPECT_NEAR(first, with.RowOf(50), 1);
  EXPECT_NEAR(last + 1, with.RowOf(-30), 1);  // to its upper edge
}

TEST(PanelChart, ARuleIsALineAcrossThePlot) {
  Panel panel = Line(0, 1, 0, 0, [](double) { return kGap; });
  panel.rules = {{.at = 0.6, .name = "0.60", .color = {92, 214, 146}, .mark = Mark::kLine},
                 {.at = 0.2, .name = "Area", .color = {92, 214, 146}, .mark = Mark::kNone}};
  PanelChart chart(20, 300, 140);
  chart.Draw(panel);
  const Image3u8 image = Picture(chart);
  const auto is_green = [&](double value, int u) {
    const uint8_t* p = image.at(u, static_cast<int>(std::lround(chart.RowOf(value))));
    return p[1] > p[0] + 60;
  };
  for (int u = chart.plot().x; u < chart.plot().right(); ++u) {
    ASSERT_TRUE(is_green(0.6, u)) << u;
    ASSERT_FALSE(is_green(0.2, u)) << u;
  }
}

TEST(TickStep, IsRoundAndBigEnough) {
  EXPECT_DOUBLE_EQ(TickStep(1.2, 4), 0.5);
  EXPECT_DOUBLE_EQ(TickStep(400, 4), 100);
  EXPECT_DOUBLE_EQ(TickStep(20, 7), 5);
  EXPECT_DOUBLE_EQ(TickStep(40, 9), 5);
  EXPECT_DOUBLE_EQ(TickStep(0.003, 2), 0.002);
  for (double range = 0.01; range < 1e4; range *= 1.37)
    for (int most = 2; most < 12; ++most) {
      const double step = TickStep(range, most);
      EXPECT_LE(range / step, most * (1 + 1e-9));
      EXPECT_GT(range / step, most / 2.6) << range << " " << most;
    }
}

TEST(PanelChartDeath, NeedsARange) {
  PanelChart chart(20, 300, 140);
  EXPECT_DEATH(chart.Draw(Line(1, 1, 0, 1, [](double) { return 1; })), "a range of y");
}

}  // namespace
}  // namespace turbidock::media
