#include "experiments/media/strip_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::media {
namespace {

// The layout in pixels.
constexpr int kGutterLeft = 40;  // tick labels
constexpr int kGutterRight = 18;
constexpr int kHeader = 20;  // title; the owner may write values to its right
constexpr int kFooter = 15;  // time labels
constexpr double kLabelSize = 10;
constexpr double kTitleSize = 12;

constexpr Rgb kGround{15, 20, 26};
constexpr Rgb kPlotGround{22, 29, 37};
constexpr Rgb kLimitColor{92, 214, 146};
constexpr Rgb kGrid{44, 54, 64};
constexpr Rgb kLabel{146, 158, 170};
constexpr Rgb kTitle{226, 232, 238};

}  // namespace

double TickStep(double range, int most) {
  double step = std::pow(10, std::floor(std::log10(range / most)));
  for (const double factor : {2.0, 2.5, 2.0, 2.0}) {
    if (range / step <= most) break;
    step *= factor;
  }
  return step;
}

StripChart::StripChart(StripChartSpec spec, int width_px, int height_px)
    : spec_(std::move(spec)),
      canvas_(width_px, height_px),
      plot_{kGutterLeft, kHeader, width_px - kGutterLeft - kGutterRight,
            height_px - kHeader - (spec_.time_labels ? kFooter : 5)} {
  TD_CHECK(plot_.width > 1 && plot_.height > 1, "room for a chart");
  TD_CHECK(spec_.low < spec_.high && spec_.time_span_s > 0, "ranges");
  DrawEmpty();
}

double StripChart::RowOf(double value) const {
  return plot_.y + (plot_.height - 1) * (spec_.high - value) / (spec_.high - spec_.low);
}

double StripChart::ColumnOf(double time_s) const {
  return plot_.x + (plot_.width - 1) * time_s / spec_.time_span_s;
}

void StripChart::Add(double time_s, std::span<const double> values) {
  TD_CHECK(values.size() == spec_.series.size(), "one value a series");
  TD_CHECK(time_s >= (times_s_.empty() ? 0 : times_s_.back()), "times do not decrease");
  times_s_.push_back(time_s);
  values_.insert(values_.end(), values.begin(), values.end());

  bool grows = false;
  for (size_t i = 0; i < values.size() && spec_.low <= 0 && spec_.high >= 0; ++i) {
    const double value = spec_.series[i].drives_range ? values[i] : 0;
    if (!std::isfinite(value) || (value < 0 ? spec_.low : spec_.high) == 0) continue;
    for (; value < spec_.low || value > spec_.high; grows = true) spec_.low *= 2, spec_.high *= 2;
  }
  if (!grows) return DrawStep(times_s_.size() - 1);
  DrawEmpty();
  for (size_t sample = 0; sample < times_s_.size(); ++sample) DrawStep(sample);
}

void StripChart::DrawEmpty() {
  canvas_.FillRect(canvas_.area(), kGround);
  canvas_.FillRect(plot_, kPlotGround);
  canvas_.Text({static_cast<double>(plot_.x), kHeader - 6.0}, spec_.title, kTitleSize, kTitle,
               Align::kLeft, /*bold=*/true);
  const double left = plot_.x - 0.5, right = plot_.right() - 0.5;
  const double top = plot_.y - 0.5, bottom = plot_.bottom() - 0.5;

  const double time_step_s = TickStep(spec_.time_span_s, plot_.width / 60);
  for (int i = 0; i * time_step_s <= spec_.time_span_s * (1 + 1e-9); ++i) {
    const double u = std::round(ColumnOf(i * time_step_s));
    canvas_.Line({u, top}, {u, bottom}, 1, kGrid);
    if (!spec_.time_labels) continue;
    canvas_.Text({u, plot_.bottom() + 11.0}, fmt::format("{:g} s", i * time_step_s), kLabelSize,
                 kLabel, Align::kCenter);
  }

  // limits take the place of the ticks next to them
  const double step = TickStep(spec_.high - spec_.low, std::max(2, plot_.height / 18));
  for (double tick = std::ceil(spec_.low / step - 1e-9); tick * step <= spec_.high + 1e-9 * step;
       ++tick) {
    const double v = std::round(RowOf(tick * step));
    canvas_.Line({left, v}, {right, v}, 1, kGrid);
    const bool hidden = std::any_of(
        spec_.limits.begin(), spec_.limits.end(),
        [&](const StripLimit& limit) { return std::abs(RowOf(limit.value) - v) < kLabelSize + 1; });
    if (hidden) continue;
    const std::string label = fmt::format("{:.{}f}", tick * step + 0.0, spec_.tick_decimals);
    // the lowest label stays clear of the time labels
    canvas_.Text({left - 5, std::min(v + 4, bottom)}, label, kLabelSize, kLabel, Align::kRight);
  }
  for (const StripLimit& limit : spec_.limits) {
    const double v = std::round(RowOf(limit.value));
    canvas_.Line({left, v}, {right, v}, 1, kLimitColor, 0.65);
    canvas_.Text({left - 5, v + 4}, limit.label, kLabelSize, kLimitColor, Align::kRight);
  }
}

void StripChart::DrawStep(size_t sample) {
  const size_t n = spec_.series.size();
  const double u = ColumnOf(times_s_[sample]);
  canvas_.Clip(plot_);
  for (size_t i = 0; i < n; ++i) {
    const StripSeries& series = spec_.series[i];
    const double now = values_[sample * n + i];
    if (!std::isfinite(now)) continue;
    // without a value before it, a line of no length: a dot
    const bool joined = sample > 0 && std::isfinite(values_[(sample - 1) * n + i]);
    const double before = joined ? values_[(sample - 1) * n + i] : now;
    const double u_before = joined ? ColumnOf(times_s_[sample - 1]) : u;
    if (const double half = series.band_half_width; half > 0)
      for (const double side : {-half, half})
        canvas_.Line({u_before, RowOf(before + side)}, {u, RowOf(now + side)}, 1, kLimitColor, 0.6);
    canvas_.Line({u_before, RowOf(before)}, {u, RowOf(now)}, series.width_px, series.color, 1,
                 /*round_ends=*/true);
  }
  canvas_.Unclip();
}

}  // namespace turbidock::media
