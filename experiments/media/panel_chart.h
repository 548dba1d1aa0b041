#pragma once
// A panel of a report (report/plot.h) on a canvas, for films: dark, small, and it may grow.

#include "experiments/media/canvas.h"
#include "experiments/report/plot.h"

namespace turbidock::media {

// Draws lines, dots, bands and the rules across, whose names stand in the place of ticks. Dashes
// are thin lines.
class PanelChart {
 public:
  // Its x axis is in seconds, from 0.
  PanelChart(double x_high_s, int width_px, int height_px);

  // All of the panel, anew. Its y axis must be told; there is some room beyond it.
  void Draw(const report::Panel& panel);
  // More of the panel that was drawn last: each series goes on from the first of these points, the
  // last one so far. False, and nothing is drawn, where its y axis has outgrown the chart's.
  bool Add(const report::Panel& more);

  // Copies the chart to `target` with its top-left corner at (x, y).
  void DrawTo(Canvas* target, int x, int y) const { target->DrawCanvas(canvas_, x, y); }

  // Where the values are drawn, and where a value and a time are in it (from the chart's corner;
  // the first and last pixel centres are the ends of the ranges).
  const PixelRect& plot() const { return plot_; }
  double RowOf(double value) const;
  double ColumnOf(double time_s) const;

 private:
  void DrawEmpty(const report::Panel& panel);
  void DrawSeries(const report::Series& series, size_t first);  // from that point on
  void DrawStep(const report::Series& series, const report::Sample* before,
                const report::Sample& now);  // none before the first

  double x_high_s_;
  Canvas canvas_;
  PixelRect plot_;
  double low_ = 0, high_ = 0;  // of y
};

// The distance between round ticks (1, 2 or 5 times a power of ten) that puts at most `most` of
// them in a range of this size.
double TickStep(double range, int most);

}  // namespace turbidock::media
