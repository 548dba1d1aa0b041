#include "experiments/trial/trace_panels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <string>

#include "control/axes.h"
#include "experiments/report/table.h"
#include "sim/base/units.h"

namespace turbidock::trial {
namespace {

using report::kOpen;
using report::Mark;
using report::Panel;
using units::DegFromRad;
using units::MmFromM;

// A search that begins anywhere: where it is until then sets no scale.
constexpr double kSearch_s = 1;

// What a panel shows of the pose; the rest in the panel's unit.
struct Quantity {
  const char* title;
  const char* part;  // of the names of columns
  double unit;       // in one m or rad
  double least_span;
  // What a stage allows about the desired value; none allows anything.
  std::function<double(control::Stage)> allowed = [](control::Stage) { return kOpen; };
  double limit = kOpen;  // a line across
};

// The least and the most of what is held.
struct Range {
  double low = INFINITY, high = -INFINITY;

  void Hold(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  // A tenth more than needed, and no less than that.
  report::Axis AxisOf(double least_span) const {
    if (low > high) return {.low = -least_span / 2, .high = least_span / 2};
    const double half = std::max(0.55 * (high - low), least_span / 2);
    return {.low = (low + high) / 2 - half, .high = (low + high) / 2 + half};
  }
};

class Traces {
 public:
  Traces(const Series& series, const ViewCriteria& criteria, const TraceOptions& options)
      : series_(series),
        criteria_(criteria),
        colors_(options.colors),
        first_(options.first_row),
        time_s_(series.Numbers("time_s")),
        stages_(series.stages()) {}

  Panel Empty(const std::string& title) const {
    // a trial of one frame has a time axis, too
    Panel panel{.title = title,
                .x = {.low = 0, .high = time_s_.empty() ? 1 : std::max(time_s_.back(), 1.0)}};
    for (size_t i = 0; i < time_s_.size(); ++i) {
      if (i > 0) panel.blocks.back().to_x = time_s_[i];
      if (i > 0 && stages_[i] == stages_[i - 1]) continue;
      const Rgb color = colors_.Of(stages_[i]);
      panel.blocks.push_back({.name = report::Words(NameOf(stages_[i])),
                              .from_x = time_s_[i],
                              .to_x = time_s_[i],
                              .color = color,
                              .opacity = 0.1});
      if (i > 0) panel.rules.push_back({time_s_[i], "", color, Mark::kLine, 1, /*is_up=*/true});
    }
    return panel;
  }

  Panel Pose(const Quantity& quantity) const {
    const std::vector<double> truth = Of("true", quantity), seen = Of("est", quantity);
    const std::vector<double> desired = Of("desired", quantity);
    const std::vector<double>& fitness = series_.Numbers("fitness");
    const std::vector<double>& image_time_s = series_.Numbers("image_time_s");
    report::Series lost{"F too low", {}, colors_.estimate, Mark::kDots, 1, 2};
    lost.opacity = 0.3;
    report::Series allowed{"allowed", {}, colors_.limit, Mark::kBand};
    report::Series is{"truth", {}, colors_.truth, Mark::kLine, 3.5};
    report::Series wanted{"desired", {}, colors_.desired, Mark::kDashes, 1.8};
    report::Series estimate{"estimate", {}, colors_.estimate, Mark::kLine, 1.5};
    Range range;
    range.Hold(quantity.limit);
    for (size_t i = 0; i < time_s_.size(); ++i) {
      const bool detected = fitness[i] >= criteria_.detection_fitness;
      const double within = quantity.allowed(stages_[i]);
      range.Hold(truth[i]);
      range.Hold(desired[i] - within);
      range.Hold(desired[i] + within);
      if (detected && time_s_[i] >= kSearch_s) range.Hold(seen[i]);
      if (i < first_) continue;
      lost.points.push_back({image_time_s[i], detected ? kOpen : seen[i]});
      allowed.points.push_back({time_s_[i], desired[i], desired[i] - within, desired[i] + within});
      is.points.push_back({time_s_[i], truth[i]});
      wanted.points.push_back({time_s_[i], desired[i]});
      estimate.points.push_back({image_time_s[i], detected ? seen[i] : kOpen});
    }
    Panel panel = Empty(quantity.title);
    panel.y = range.AxisOf(quantity.least_span);
    // below the truth what nothing acts on; the truth is broad, to show beside a good estimate
    panel.series = {lost, allowed, is, wanted, estimate};
    if (std::isfinite(quantity.limit))
      panel.rules.push_back(
          {quantity.limit, fmt::format("{:.0f}", quantity.limit), colors_.limit, Mark::kLine});
    return panel;
  }

  Panel Fitness() const {
    constexpr double kLowest = -0.25, kHighest = 1.02;
    const double docking = criteria_.docking_fitness, detection = criteria_.detection_fitness;
    Panel panel = Empty("F");
    Range range{kLowest, kHighest};
    for (const double f : series_.Numbers("fitness")) range.Hold(f);
    panel.y = {.low = range.low, .high = kHighest};
    panel.series = {Curve("F", "fitness", 1, colors_.estimate)};
    for (const double limit : {docking, detection})
      panel.rules.push_back({limit, fmt::format("{:.2f}", limit), colors_.limit, Mark::kLine});
    for (const auto& [at, name] : {std::pair{(kHighest + docking) / 2, "Area I"},
                                   {(docking + detection) / 2, "Area II"},
                                   {(detection + kLowest) / 2, "Area III"}})
      panel.rules.push_back({at, name, report::kGrey, Mark::kNone});
    return panel;
  }

  // A line for each of these columns.
  Panel Several(const std::string& title, const std::vector<std::string>& columns,
                double least_span, double unit = 1) const {
    Panel panel = Empty(title);
    Range range;
    for (const std::string& column : columns)
      for (const double value : series_.Numbers(column)) range.Hold(unit * value);
    panel.y = range.AxisOf(least_span);
    for (size_t i = 0; i < columns.size(); ++i) {
      const std::string name = report::QuantityOf(columns[i]).label;
      panel.series.push_back(Curve(name, columns[i], unit, report::CurveColor(i)));
    }
    return panel;
  }

  Panel Contact() const {
    const std::vector<std::string> columns = {"dock_force_newton", "collision_force_newton"};
    Panel panel = Several("contact, N", columns, 1);
    double most = 1;
    for (const std::string& column : columns)
      for (const double force : series_.Numbers(column)) most = std::max(most, 1.07 * force);
    panel.y = {.low = 0, .high = most};
    return panel;
  }

 private:
  report::Series Curve(const std::string& name, const std::string& column, double unit,
                       const Rgb& color) const {
    const std::vector<double>& values = series_.Numbers(column);
    report::Series curve{.name = name, .color = color, .width_px = 1.5};
    for (size_t i = first_; i < time_s_.size(); ++i)
      curve.points.push_back({time_s_[i], unit * values[i]});
    return curve;
  }

  // One of "true", "est" and "desired" in the panel's unit; where nothing is followed, nothing is
  // desired.
  std::vector<double> Of(const std::string& which, const Quantity& quantity) const {
    const std::string name = which + "_" + quantity.part;
    const bool is_desired = which == "desired", is_yaw = quantity.part == std::string("yaw");
    std::vector<double> values;
    if (is_yaw && !is_desired) {
      const auto part = [&](const char* of) -> const std::vector<double>& {
        return series_.Numbers(which + of);
      };
      const auto &w = part("_qw"), &x = part("_qx"), &y = part("_qy"), &z = part("_qz");
      for (size_t i = 0; i < time_s_.size(); ++i)
        values.push_back(YawOf(Eigen::Quaterniond(w[i], x[i], y[i], z[i])));
    } else {
      values = series_.Numbers(name + (is_yaw ? "_rad" : "_m"));
    }
    for (double& value : values) value *= quantity.unit;
    if (is_desired)
      for (size_t i = 0; i < values.size(); ++i)
        if (series_.controlled()[i] == 0) values[i] = kOpen;
    return values;
  }

  const Series& series_;
  const ViewCriteria& criteria_;
  const ViewColors& colors_;
  size_t first_;
  const std::vector<double>& time_s_;
  const std::vector<control::Stage>& stages_;
};

}  // namespace

std::vector<Panel> TracePanels(const Series& series, const ViewCriteria& criteria,
                               const TraceOptions& options) {
  const Traces traces(series, criteria, options);
  const double mm = MmFromM(1);
  const auto allowed = [&](size_t axis) {
    return [=](control::Stage stage) { return MmFromM(criteria.Allowed_m(stage)[axis]); };
  };
  std::vector<Panel> panels = {
      traces.Pose({.title = "x, mm",
                   .part = "x",
                   .unit = mm,
                   .least_span = 100,
                   .limit = MmFromM(criteria.docked_x_m)}),
      traces.Pose({"y, mm", "y", mm, 3 * MmFromM(criteria.tolerance_y_m), allowed(0)}),
      traces.Pose({"z, mm", "z", mm, 3 * MmFromM(criteria.tolerance_z_m), allowed(1)}),
      traces.Pose({"yaw, °", "yaw", DegFromRad(1), 10}),
      traces.Fitness(),
      traces.Several("thrusters, V", series.voltages(), 1),
      traces.Several("speed, mm/s", {"surge_mps", "sway_mps", "heave_mps"}, 20, mm),
      traces.Contact()};
  // names of stages once; the time below all of them
  for (Panel& panel : std::span(panels).subspan(1))
    for (report::Block& block : panel.blocks) block.name.clear();
  panels.back().x.label = "time, s";
  return panels;
}

}  // namespace turbidock::trial
