#include "experiments/media/strip_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::media {
namespace {

// The layout in pixels: beside the plot are the labels, above it the title; the owner may write
// values to its right.
constexpr int kLeft = 40, kRight = 18, kHeader = 20, kFooter = 15;
constexpr double kLabelSize = 10, kTitleSize = 12;

constexpr Rgb kGround{15, 20, 26}, kPlotGround{22, 29, 37}, kLimitColor{92, 214, 146};
constexpr Rgb kGrid{44, 54, 64}, kLabel{146, 158, 170}, kTitle{226, 232, 238};

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
      plot_{kLeft, kHeader, width_px - kLeft - kRight, height_px - kHeader - kFooter} {
  TD_CHECK(spec_.low < spec_.high && spec_.time_span_s > 0, "ranges");
  DrawEmpty();
}

double StripChart::RowOf(double value) const {
  return plot_.y + (plot_.height - 1) * (spec_.high - value) / (spec_.high - spec_.low);
}

double StripChart::ColumnOf(double time_s) const {
  return plot_.x + (plot_.width - 1) * time_s / spec_.time_span_s;
}

void StripChart::Add(const StripValues& row) {
  TD_CHECK(row.values.size() == spec_.series.size(), "one value a series");
  TD_CHECK(row.time_s >= (rows_.empty() ? 0 : rows_.back().time_s), "times do not decrease");
  rows_.push_back(row);
  bool grows = false;
  for (size_t i = 0; i < row.values.size() && spec_.low <= 0 && spec_.high >= 0; ++i) {
    const double value = spec_.series[i].drives_range ? row.values[i] : 0;
    if (!std::isfinite(value) || (value < 0 ? spec_.low : spec_.high) == 0) continue;
    for (; value < spec_.low || value > spec_.high; grows = true) spec_.low *= 2, spec_.high *= 2;
  }
  if (grows) DrawEmpty();
  for (size_t i = grows ? 0 : rows_.size() - 1; i < rows_.size(); ++i)
    DrawStep(i == 0 ? nullptr : &rows_[i - 1], rows_[i]);
}

void StripChart::DrawEmpty() {
  canvas_.FillRect(canvas_.area(), kGround);
  canvas_.FillRect(plot_, kPlotGround);
  canvas_.Text({static_cast<double>(plot_.x), kHeader - 6.0}, spec_.title, kTitleSize, kTitle,
               Align::kLeft, /*bold=*/true);
  const double left = plot_.x - 0.5, right = plot_.right() - 0.5, bottom = plot_.bottom() - 0.5;
  const double time_step_s = TickStep(spec_.time_span_s, plot_.width / 60);
  for (int i = 0; i * time_step_s <= spec_.time_span_s * (1 + 1e-9); ++i) {
    const double u = std::round(ColumnOf(i * time_step_s));
    canvas_.Line({u, plot_.y - 0.5}, {u, bottom}, 1, kGrid);
    canvas_.Text({u, plot_.bottom() + 11.0}, fmt::format("{:g} s", i * time_step_s), kLabelSize,
                 kLabel, Align::kCenter);
  }
  const auto across = [&](double value, double v, Rgb line, double alpha, Rgb words) {
    canvas_.Line({left, v}, {right, v}, 1, line, alpha);
    // the lowest label stays clear of those of time
    canvas_.Text({left - 5, std::min(v + 4, bottom)},
                 fmt::format("{:.{}f}", value + 0.0, spec_.decimals), kLabelSize, words,
                 Align::kRight);
  };
  // limits take the place of the ticks next to them
  const double step = TickStep(spec_.high - spec_.low, std::max(2, plot_.height / 18));
  for (double tick = std::ceil(spec_.low / step - 1e-9); tick * step <= spec_.high + 1e-9 * step;
       ++tick) {
    const double v = std::round(RowOf(tick * step));
    if (std::ranges::none_of(spec_.limits, [&](double limit) {
          return std::abs(RowOf(limit) - v) < kLabelSize + 1;
        }))
      across(tick * step, v, kGrid, 1, kLabel);
  }
  for (const double limit : spec_.limits)
    across(limit, std::round(RowOf(limit)), kLimitColor, 0.65, kLimitColor);
}

void StripChart::DrawStep(const StripValues* before, const StripValues& now) {
  const double u = ColumnOf(now.time_s), u_before = before ? ColumnOf(before->time_s) : u;
  canvas_.Clip(plot_);
  if (std::isfinite(now.band_low)) {  // by whole columns: none is filled twice
    const auto whole = [](double at) { return static_cast<int>(std::lround(at)); };
    const int column = whole(u_before), top = whole(RowOf(now.band_high));
    canvas_.FillRect({column, top, whole(u) - column, whole(RowOf(now.band_low)) - top},
                     kLimitColor, 0.22);
  }
  for (size_t i = 0; i < spec_.series.size(); ++i) {
    if (!std::isfinite(now.values[i])) continue;
    // without a value before it, a line of no length: a dot
    const bool joined = before && std::isfinite(before->values[i]);
    canvas_.Line({joined ? u_before : u, RowOf(joined ? before->values[i] : now.values[i])},
                 {u, RowOf(now.values[i])}, spec_.series[i].width_px, spec_.series[i].color, 1,
                 /*round_ends=*/true);
  }
  canvas_.Unclip();
}

}  // namespace turbidock::media
