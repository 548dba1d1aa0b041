#include "experiments/studies/gate/gate_figure.h"

#include <fmt/format.h>

#include <algorithm>

namespace turbidock::gate {
namespace {

using report::Mark;
using report::Sample;

report::Panel PathPanel(const ConditionReport& condition) {
  const MeasureReport& rate = condition.measures.front();
  const auto run =
      static_cast<size_t>(std::count_if(condition.path.begin(), condition.path.end(),
                                        [](const Look& look) { return look.worse.has_value(); }));
  // Some more than were run, to see where the borders lead.
  const size_t shown = std::min(condition.path.size(), std::max(run + 12, run * 8 / 5));
  const std::vector<Look> looks(condition.path.begin(),
                                condition.path.begin() + static_cast<int64_t>(shown));
  const auto over_trials = [&](std::optional<int> Look::*count) {
    return report::SamplesOf(looks, [&](const Look& look) {
      const std::optional<int>& y = look.*count;
      return Sample{static_cast<double>(look.trials), y ? *y : report::kOpen};
    });
  };
  report::Panel panel{
      .title = condition.name + ": " +
               (rate.decided_after_trials ? fmt::format("{} after {} trials", NameOf(rate.verdict),
                                                        *rate.decided_after_trials)
                                          : std::string("not known")),
      .x = {"trials", 0},
      .y = {condition.paired ? "seeds that no longer dock" : "trials that did not dock", -0.4},
      .series = {{"fails", over_trials(&Look::fails_at), report::CurveColor(1), Mark::kSteps},
                 {"passes", over_trials(&Look::passes_at), report::CurveColor(2), Mark::kSteps},
                 {"so far", over_trials(&Look::worse), report::CurveColor(0), Mark::kSteps, 3.5}},
      .legend = report::Legend::kAbove};
  double top = 3;
  for (const report::Series& series : panel.series)
    for (const Sample& sample : series.points)
      if (sample.y >= top) top = sample.y + 0.6;
  panel.y.high = top;
  panel.y.tick_step = top <= 8 ? 1 : top <= 16 ? 2 : 5;  // counts have no halves
  return panel;
}

report::Panel RatesPanel(const std::vector<ConditionReport>& conditions) {
  report::Series before{"baseline", {}, report::CurveColor(7), Mark::kBars};
  report::Series now{"now", {}, report::CurveColor(0), Mark::kBars};
  before.dot_px = now.dot_px = 9;
  report::Panel panel{.title = "baseline and now, 95 % intervals",
                      .y = {"docked [%]", -3, 103},
                      .legend = report::Legend::kAbove};
  for (const ConditionReport& c : conditions) {
    const auto x = static_cast<double>(panel.x.names.size());
    panel.x.names.push_back(c.name);
    const auto add = [](report::Series* series, double at, int docked, size_t trials,
                        const statistics::Interval& interval) {
      if (trials > 0)
        series->points.push_back(
            report::SampleWithin(at, docked / static_cast<double>(trials), interval, 100));
    };
    add(&before, x - 0.1, c.baseline_docked, static_cast<size_t>(c.baseline_trials),
        c.baseline_interval_95);
    add(&now, x + 0.1, c.docked, c.trials.size(), c.interval_95);
  }
  panel.series = {before, now};
  return panel;
}

}  // namespace

report::Figure GateFigure(const GateReport& report) {
  report::Figure figure{.title = fmt::format("{}: {}", report.description, NameOf(report.verdict)),
                        .columns = std::min<size_t>(3, report.conditions.size() + 1),
                        .width_px = 560,
                        .height_px = 460};
  if (!report.assignments.empty())
    figure.title += fmt::format(" ({})", fmt::join(report.assignments, ", "));
  for (const ConditionReport& condition : report.conditions)
    figure.panels.push_back(PathPanel(condition));
  figure.panels.push_back(RatesPanel(report.conditions));
  return figure;
}

}  // namespace turbidock::gate
