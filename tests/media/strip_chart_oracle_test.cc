#include "experiments/media/strip_chart.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace turbidock::media {
namespace {

constexpr Rgb kRed{255, 0, 0};
constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

StripChartSpec OneSeries(double low, double high) {
  return {.title = "q",
          .low = low,
          .high = high,
          .series = {{.color = kRed, .width_px = 1, .drives_range = true}}};
}

Image3u8 Picture(const StripChart& chart) {
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

TEST(StripChart, EndsOfTheRangesAreTheEndsOfThePlot) {
  StripChartSpec spec = OneSeries(-50, 150);
  spec.time_span_s = 8;
  const StripChart chart(spec, 300, 120);
  const PixelRect& plot = chart.plot();
  EXPECT_DOUBLE_EQ(chart.RowOf(150), plot.y);
  EXPECT_DOUBLE_EQ(chart.RowOf(-50), plot.bottom() - 1);
  EXPECT_DOUBLE_EQ(chart.RowOf(50), plot.y + (plot.height - 1) / 2.0);
  EXPECT_DOUBLE_EQ(chart.ColumnOf(0), plot.x);
  EXPECT_DOUBLE_EQ(chart.ColumnOf(8), plot.right() - 1);
  EXPECT_DOUBLE_EQ(chart.ColumnOf(2), plot.x + (plot.width - 1) / 4.0);
}

// A straight ramp from (0 s, low) to (span, high) is the plot's diagonal.
TEST(StripChart, RampIsTheDiagonal) {
  StripChartSpec spec = OneSeries(0, 10);
  spec.time_span_s = 20;
  StripChart chart(spec, 400, 160);
  for (int i = 0; i <= 200; ++i) chart.Add({0.1 * i, {0.05 * i}});
  const Image3u8 image = Picture(chart);
  const PixelRect& plot = chart.plot();
  int checked = 0;
  for (int u = plot.x + 3; u < plot.right() - 3; ++u, ++checked) {
    const double share = static_cast<double>(u - plot.x) / (plot.width - 1);
    ASSERT_NEAR(CurveRow(image, u), plot.bottom() - 1 - share * (plot.height - 1), 0.6) << u;
  }
  EXPECT_EQ(checked, plot.width - 6);
}

TEST(StripChart, CurveEndsAtTheLastTime) {
  StripChart chart(OneSeries(0, 10), 400, 160);
  for (int i = 0; i <= 50; ++i) chart.Add({0.1 * i, {4.0}});
  const Image3u8 image = Picture(chart);
  const int last = static_cast<int>(chart.ColumnOf(5));
  EXPECT_NEAR(CurveRow(image, last - 1), chart.RowOf(4), 0.6);
  EXPECT_TRUE(std::isnan(CurveRow(image, last + 3)));
}

TEST(StripChart, GapsAreNotBridged) {
  StripChart chart(OneSeries(0, 10), 400, 160);
  for (int i = 0; i <= 150; ++i) {
    const bool gap = i > 50 && i < 100;
    chart.Add({0.1 * i, {i == 75 ? 9.0 : gap ? kGap : 4.0}});
  }
  const Image3u8 image = Picture(chart);
  for (const double t_s : {6.0, 7.0, 8.0, 9.5})
    EXPECT_TRUE(std::isnan(CurveRow(image, static_cast<int>(chart.ColumnOf(t_s))))) << t_s;
  EXPECT_NEAR(CurveRow(image, static_cast<int>(chart.ColumnOf(12))), chart.RowOf(4), 0.6);
  // the lone value in the gap is a dot
  EXPECT_NEAR(CurveRow(image, static_cast<int>(std::lround(chart.ColumnOf(7.5)))), chart.RowOf(9),
              0.6);
}

TEST(StripChart, RangesDouble) {
  StripChart chart(OneSeries(-100, 100), 300, 120);
  const auto expect_ends = [&](double low, double high) {
    EXPECT_DOUBLE_EQ(chart.RowOf(low), chart.plot().bottom() - 1);
    EXPECT_DOUBLE_EQ(chart.RowOf(high), chart.plot().y);
  };
  chart.Add({1, {100.0}});
  expect_ends(-100, 100);
  chart.Add({2, {-100.5}});
  expect_ends(-200, 200);
  chart.Add({3, {kGap}});
  expect_ends(-200, 200);
  chart.Add({4, {900.0}});
  expect_ends(-1600, 1600);
}

TEST(StripChart, OnlyChosenSeriesWidenTheRange) {
  StripChartSpec spec = OneSeries(0, 10);
  spec.series[0].drives_range = false;
  StripChart chart(spec, 300, 120);
  chart.Add({0, {35.0}});
  EXPECT_DOUBLE_EQ(chart.RowOf(10), chart.plot().y);
}

// Two routes to one picture: growing on the way, and having had the final ranges from the
// beginning.
TEST(StripChart, GrownChartEqualsOneOfThatSize) {
  StripChartSpec spec = OneSeries(-10, 10);
  spec.series.push_back({.color = {0, 0, 255}});
  spec.time_span_s = 80;
  StripChart grown(spec, 300, 120);
  spec.low = -40;
  spec.high = 40;
  StripChart large(spec, 300, 120);
  for (int i = 0; i < 700; ++i) {
    const double value = i % 97 == 0 ? kGap : 0.02 * i;
    const StripValues row{0.1 * i, {30 * std::sin(0.01 * i), value}, value - 4, value + 4};
    grown.Add(row);
    large.Add(row);
    if (i == 20) {
      EXPECT_FALSE(Picture(grown) == Picture(large));
    }
  }
  EXPECT_TRUE(Picture(grown) == Picture(large));
}

TEST(StripChart, BandIsFilledBetweenItsEnds) {
  const StripChartSpec spec = OneSeries(-100, 100);
  StripChart with(spec, 300, 140), without(spec, 300, 140);
  for (int i = 0; i <= 100; ++i) {
    with.Add({0.1 * i, {10.0}, -30, 50});
    without.Add({0.1 * i, {10.0}});
  }
  const Image3u8 a = Picture(with), b = Picture(without);
  const int u = static_cast<int>(with.ColumnOf(4));
  int first = -1, last = -1, count = 0;
  for (int v = 0; v < a.height(); ++v) {
    if (a.at(u, v)[1] == b.at(u, v)[1]) continue;
    if (first < 0) first = v;
    last = v;
    ++count;
  }
  EXPECT_GE(count, last - first - 3);  // but for the curve
  EXPECT_NEAR(first, with.RowOf(50), 1);
  EXPECT_NEAR(last, with.RowOf(-30), 1);
}

TEST(StripChart, LimitIsALineAcrossThePlot) {
  StripChartSpec spec = OneSeries(0, 1);
  spec.limits = {0.6};
  const StripChart chart(spec, 300, 140);
  const Image3u8 image = Picture(chart);
  const int row = static_cast<int>(std::lround(chart.RowOf(0.6)));
  for (int u = chart.plot().x; u < chart.plot().right(); ++u)
    ASSERT_GT(image.at(u, row)[1], image.at(u, row)[0] + 60) << u;
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

TEST(StripChartDeath, TimesDoNotDecrease) {
  StripChart chart(OneSeries(0, 1), 300, 140);
  chart.Add({2, {0.5}});
  EXPECT_DEATH(chart.Add({1, {0.5}}), "times do not decrease");
}

}  // namespace
}  // namespace turbidock::media
