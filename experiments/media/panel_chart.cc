#include "experiments/media/panel_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/base/check.h"

namespace turbidock::media {
namespace {

using report::Mark;
using report::Sample;

// The layout in pixels: beside the plot are the labels, above it the title; the owner may write
// values to its right.
constexpr int kLeft = 40, kRight = 18, kHeader = 20, kFooter = 15;
constexpr double kLabelSize = 10, kTitleSize = 12;
constexpr double kRoom = 0.25;  // beyond the axis, of its length: most of a trial needs no other

constexpr Rgb kGround{15, 20, 26}, kPlotGround{22, 29, 37};
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

PanelChart::PanelChart(double x_high_s, int width_px, int height_px)
    : x_high_s_(x_high_s),
      canvas_(width_px, height_px),
      plot_{kLeft, kHeader, width_px - kLeft - kRight, height_px - kHeader - kFooter} {
  TD_CHECK(x_high_s > 0, "a range");
}

double PanelChart::RowOf(double value) const {
  return plot_.y + (plot_.height - 1) * (high_ - value) / (high_ - low_);
}

double PanelChart::ColumnOf(double time_s) const {
  return plot_.x + (plot_.width - 1) * time_s / x_high_s_;
}

void PanelChart::Draw(const report::Panel& panel) {
  TD_CHECK(panel.y.low < panel.y.high, "a range of y");
  const double room = kRoom * (panel.y.high - panel.y.low);
  low_ = panel.y.low - room;
  high_ = panel.y.high + room;
  DrawEmpty(panel);
  for (const report::Series& series : panel.series) DrawSeries(series, 0);
}

bool PanelChart::Add(const report::Panel& more) {
  if (!(low_ <= more.y.low && more.y.high <= high_)) return false;
  for (const report::Series& series : more.series) DrawSeries(series, 1);
  return low_ < high_;
}

void PanelChart::DrawEmpty(const report::Panel& panel) {
  canvas_.FillRect(canvas_.area(), kGround);
  canvas_.FillRect(plot_, kPlotGround);
  canvas_.Text({static_cast<double>(plot_.x), kHeader - 6.0}, panel.title, kTitleSize, kTitle,
               Align::kLeft, /*bold=*/true);
  const double left = plot_.x - 0.5, right = plot_.right() - 0.5, bottom = plot_.bottom() - 0.5;
  const double time_step_s = TickStep(x_high_s_, plot_.width / 60);
  for (int i = 0; i * time_step_s <= x_high_s_ * (1 + 1e-9); ++i) {
    const double u = std::round(ColumnOf(i * time_step_s));
    canvas_.Line({u, plot_.y - 0.5}, {u, bottom}, 1, kGrid);
    canvas_.Text({u, plot_.bottom() + 11.0}, fmt::format("{:g} s", i * time_step_s), kLabelSize,
                 kLabel, Align::kCenter);
  }
  const auto across = [&](const std::string& name, double v, Rgb line, double alpha, Rgb words) {
    canvas_.Line({left, v}, {right, v}, 1, line, alpha);
    // the lowest label stays clear of those of time
    canvas_.Text({left - 5, std::min(v + 4, bottom)}, name, kLabelSize, words, Align::kRight);
  };
  // rules take the place of the ticks next to them
  const auto is_across = [](const report::Rule& rule) {
    return !rule.is_up && rule.mark != Mark::kNone;
  };
  const double step = TickStep(high_ - low_, std::max(2, plot_.height / 18));
  for (double tick = std::ceil(low_ / step - 1e-9); tick * step <= high_ + 1e-9 * step; ++tick) {
    const double v = std::round(RowOf(tick * step));
    if (std::ranges::none_of(panel.rules, [&](const report::Rule& rule) {
          return is_across(rule) && std::abs(RowOf(rule.at) - v) < kLabelSize + 1;
        }))
      across(fmt::format("{:.5g}", tick * step + 0.0), v, kGrid, 1, kLabel);
  }
  for (const report::Rule& rule : panel.rules)
    if (is_across(rule))
      across(rule.name, std::round(RowOf(rule.at)), rule.color, 0.65, rule.color);
}

void PanelChart::DrawSeries(const report::Series& series, size_t first) {
  canvas_.Clip(plot_);
  for (size_t i = first; i < series.points.size(); ++i)
    DrawStep(series, i == 0 ? nullptr : &series.points[i - 1], series.points[i]);
  canvas_.Unclip();
}

void PanelChart::DrawStep(const report::Series& series, const Sample* before, const Sample& now) {
  const double u = ColumnOf(now.x), u_before = before ? ColumnOf(before->x) : u;
  if (series.mark == Mark::kBand) {  // by whole columns: none is filled twice
    if (!std::isfinite(now.low)) return;
    const auto whole = [](double at) { return static_cast<int>(std::lround(at)); };
    const int column = whole(u_before), top = whole(RowOf(now.high));
    canvas_.FillRect({column, top, whole(u) - column, whole(RowOf(now.low)) - top}, series.color,
                     0.22);
    return;
  }
  if (!std::isfinite(now.y)) return;
  // a dot, and whatever has no value before it, is a line of no length
  const bool joined = series.mark != Mark::kDots && before && std::isfinite(before->y);
  const double width = series.mark == Mark::kDots ? series.dot_px : 0.8 * series.width_px;
  canvas_.Line({joined ? u_before : u, RowOf(joined ? before->y : now.y)}, {u, RowOf(now.y)}, width,
               series.color, series.opacity, /*round_ends=*/true);
}

}  // namespace turbidock::media
