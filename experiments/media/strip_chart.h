#pragma once
// A chart that grows with a trial: values over the time so far.

#include <limits>
#include <string>
#include <vector>

#include "experiments/media/canvas.h"

namespace turbidock::media {

struct StripSeries {
  Rgb color{255, 255, 255};
  double width_px = 1.6;
  bool drives_range = false;  // a value outside the vertical range doubles it
};

struct StripChartSpec {
  std::string title;
  double low = 0, high = 1;  // vertical range to begin with; it doubles about 0
  double time_span_s = 20;
  int decimals = 0;                      // of ticks and limits
  std::vector<double> limits = {};       // lines across the whole chart
  std::vector<StripSeries> series = {};  // drawn in this order, later ones on top
};

// A row of the chart. Times must not decrease and start at or after 0. A value that is not finite
// leaves a gap; one between two gaps is a dot.
struct StripValues {
  double time_s = 0;
  std::vector<double> values = {};  // one a series
  double band_low = std::numeric_limits<double>::quiet_NaN(), band_high = band_low;
};

// Draws each new value once; only when the vertical range has to double are all drawn again.
class StripChart {
 public:
  StripChart(StripChartSpec spec, int width_px, int height_px);

  void Add(const StripValues& row);

  // Copies the chart to `target` with its top-left corner at (x, y).
  void DrawTo(Canvas* target, int x, int y) const { target->DrawCanvas(canvas_, x, y); }

  // Where the values are drawn, and where a value and a time are in it (from the chart's corner;
  // the first and last pixel centres are the ends of the ranges).
  const PixelRect& plot() const { return plot_; }
  double RowOf(double value) const;
  double ColumnOf(double time_s) const;

 private:
  void DrawEmpty();
  void DrawStep(const StripValues* before, const StripValues& now);  // none before the first

  StripChartSpec spec_;
  Canvas canvas_;
  PixelRect plot_;
  std::vector<StripValues> rows_;
};

// The distance between round ticks (1, 2 or 5 times a power of ten) that puts at most `most` of
// them in a range of this size.
double TickStep(double range, int most);

}  // namespace turbidock::media
