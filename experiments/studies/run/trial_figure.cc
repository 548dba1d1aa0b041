#include "experiments/studies/run/trial_figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "control/axes.h"
#include "experiments/media/figure.h"
#include "experiments/report/table.h"
#include "sim/base/check.h"
#include "sim/base/units.h"

namespace turbidock::run {
namespace {

using report::Mark;
using trial::FrameRecord;
using trial::kOnPaper;
using units::DegFromRad;
using units::MmFromM;

// What a panel shows of the pose; the rest in the panel's unit.
struct Quantity {
  const char* label;
  control::Axis axis;
  double unit;                   // in one m or rad
  double least_span;             // of the vertical axis
  double limit = report::kOpen;  // a line across
};

std::vector<report::Block> StageBlocks(const trial::TrialLog& log) {
  std::vector<report::Block> blocks;
  for (const FrameRecord& frame : log.frames) {
    const std::string name = report::Words(NameOf(frame.stage));
    if (!blocks.empty()) blocks.back().to_x = frame.time_s;
    if (blocks.empty() || blocks.back().name != name)
      blocks.push_back({.name = name,
                        .from_x = frame.time_s,
                        .to_x = frame.time_s,
                        .color = kOnPaper.Of(frame.stage)});
  }
  return blocks;
}

// The axes of time with the stages behind.
report::Panel EmptyPanel(const trial::TrialLog& log) {
  // a trial of one frame has a time axis, too
  report::Panel panel{.x = {"time, s", 0, std::max(log.frames.back().time_s, 1.0)},
                      .blocks = StageBlocks(log)};
  for (report::Block& block : panel.blocks) {
    if (block.from_x > panel.blocks.front().from_x)
      panel.rules.push_back({block.from_x, "", block.color, Mark::kLine, 1, true});
    block.opacity = 0.1;
  }
  return panel;
}

report::Panel FitnessPanel(const trial::TrialLog& log, const trial::ViewCriteria& criteria) {
  constexpr double kLowest = -0.25, kHighest = 1.02;
  constexpr Rgb kInk{70, 78, 86};
  const double docking = criteria.docking_fitness, detection = criteria.detection_fitness;
  const auto f = report::SamplesOf(log.frames, &FrameRecord::time_s, &FrameRecord::fitness);
  report::Panel panel = EmptyPanel(log);
  panel.y = {"F", kLowest, kHighest};
  panel.series = {{"", f, kOnPaper.estimate, Mark::kLine, 1.4}};
  for (const double limit : {docking, detection})
    panel.rules.push_back({limit, fmt::format("{:.2f}", limit), kOnPaper.limit, Mark::kLine});
  panel.rules.push_back({(kHighest + docking) / 2, "Area I", kInk, Mark::kNone});
  panel.rules.push_back({(docking + detection) / 2, "Area II", kInk, Mark::kNone});
  panel.rules.push_back({(detection + kLowest) / 2, "Area III", kInk, Mark::kNone});
  return panel;
}

report::Panel PosePanel(const trial::TrialLog& log, const trial::ViewCriteria& criteria,
                        const Quantity& quantity) {
  std::vector<report::Sample> desired, truth, weak, estimate;
  // of everything but the estimates of frames without detection
  double low = INFINITY, high = -INFINITY;
  const auto hold = [&](double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  };
  hold(quantity.limit);
  for (const FrameRecord& f : log.frames) {
    const bool detected = f.fitness >= criteria.detection_fitness;
    const auto shown = [&](const auto& pose) {
      return quantity.unit * control::ToAxes(pose)[quantity.axis];
    };
    const double seen = shown(f.est_X_HM), is = shown(f.true_X_HM);
    const double wanted = f.controlled ? shown(f.desired) : report::kOpen;
    const auto [y_m, z_m] = criteria.Allowed_m(f.stage);
    const double allowed = quantity.axis == control::kSway    ? MmFromM(y_m)
                           : quantity.axis == control::kHeave ? MmFromM(z_m)
                                                              : report::kOpen;
    desired.push_back({f.time_s, wanted, wanted - allowed, wanted + allowed});
    truth.push_back({f.time_s, is});
    weak.push_back({f.image_time_s, detected ? report::kOpen : seen});
    estimate.push_back({f.image_time_s, detected ? seen : report::kOpen});
    for (const double value : {is, estimate.back().y, desired.back().low, desired.back().high})
      hold(value);
  }
  if (low > high) low = high = 0;
  // a tenth more than needed
  const double half = std::max(0.55 * (high - low), 0.5 * quantity.least_span);

  report::Panel panel = EmptyPanel(log);
  panel.y = {quantity.label, (low + high) / 2 - half, (low + high) / 2 + half};
  // the truth is broad, so that it shows on both sides of a good estimate
  panel.series = {{"allowed", desired, kOnPaper.limit, Mark::kBand},
                  {"desired", desired, kOnPaper.desired, Mark::kDashes, 1.8},
                  {"truth", truth, kOnPaper.truth, Mark::kLine, 4},
                  {fmt::format("estimate, F < {:.2f}", criteria.detection_fitness), weak,
                   kOnPaper.estimate, Mark::kDots, 1, 3},
                  {"estimate", estimate, kOnPaper.estimate, Mark::kLine, 1.4}};
  if (std::isfinite(quantity.limit))
    panel.rules.push_back(
        {quantity.limit, fmt::format("{:.0f} mm", quantity.limit), kOnPaper.limit, Mark::kLine});
  return panel;
}

}  // namespace

void WriteTrialFigure(const std::string& path, const trial::TrialLog& log, const FigureInfo& info) {
  TD_CHECK(!log.frames.empty(), "a figure needs a frame");
  const double y_mm = MmFromM(info.criteria.tolerance_y_m);
  const double z_mm = MmFromM(info.criteria.tolerance_z_m);
  const double docked_mm = MmFromM(info.criteria.docked_x_m);
  const double mm = MmFromM(1), deg = DegFromRad(1);
  std::vector<report::Panel> panels;
  for (const Quantity& quantity : {Quantity{"x, mm", control::kSurge, mm, 100, docked_mm},
                                   Quantity{"y, mm", control::kSway, mm, 3 * y_mm},
                                   Quantity{"z, mm", control::kHeave, mm, 3 * z_mm},
                                   Quantity{"yaw, °", control::kYaw, deg, 10}})
    panels.push_back(PosePanel(log, info.criteria, quantity));
  // the first one's legend tells what the colours of all are
  panels[0].legend = true;
  panels.push_back(FitnessPanel(log, info.criteria));
  media::WriteFigure(path, {.title = info.title + "\n" + info.outcome,
                            .stacked = true,
                            .width_px = kFigureWidth,
                            .height_px = (kFigureHeight - 40) / 5,
                            .panels = panels});
}

}  // namespace turbidock::run
