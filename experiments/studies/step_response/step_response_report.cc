#include "experiments/studies/step_response/step_response_report.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "experiments/media/figure.h"
#include "experiments/report/json.h"
#include "experiments/report/table.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/pose.h"
#include "sim/base/units.h"

namespace turbidock::step_response {
namespace {

// Millimetres or degrees.
double Shown(control::Axis axis, double value) {
  return axis == control::kYaw ? units::DegFromRad(value) : units::MmFromM(value);
}
const char* ShownUnit(control::Axis axis) { return axis == control::kYaw ? "deg" : "mm"; }

std::string Text(const std::optional<double>& value, const char* format) {
  return value ? fmt::format(fmt::runtime(format), *value) : "-";
}

std::optional<double> Deg(const std::optional<double>& rad) {
  if (!rad) return std::nullopt;
  return units::DegFromRad(*rad);
}

// What was wanted, what came of it, and the demand.
report::Panel TimePanel(const std::string& title, control::Axis axis, const Answer& a) {
  std::vector<report::Sample> demand, wanted, actual;
  for (size_t i = 0; i < a.time_s.size(); ++i) {
    demand.push_back({a.time_s[i], a.demand[i]});
    wanted.push_back({a.time_s[i], Shown(axis, a.wanted[i])});
    actual.push_back({a.time_s[i], Shown(axis, a.actual[i])});
  }
  return {
      .title = title,
      .x = {.label = "time [s]", .tick_step = 5},
      .y = {fmt::format("moved [{}]", ShownUnit(axis))},
      .y2 = {"demand (grey)"},
      .series = {
          {.points = demand, .color = trial::kOnPaper.truth, .width_px = 1, .second_axis = true},
          {"", wanted, trial::kOnPaper.desired, report::Mark::kDashes},
          {"", actual, trial::kOnPaper.estimate}}};
}

// With the limit that the loop must not come near.
report::Panel LoopPanel(const std::string& title, const report::Axis& y, report::Mark mark,
                        double limit, std::vector<report::Sample> points) {
  return {.title = title,
          .x = {.label = "frequency [Hz]", .logarithmic = true},
          .y = y,
          .series = {{"", std::move(points), trial::kOnPaper.estimate, mark}},
          .rules = {{limit, "", trial::kOnPaper.limit, report::Mark::kLine}}};
}

}  // namespace

std::string StepTable(const std::vector<AxisResponse>& responses) {
  report::Table table({"<axis", "rise s", "overshoot", "settling s", "push moves", "recovery s",
                       "crossover", "phase", "gain", "delay", "peak S"});
  for (const AxisResponse& r : responses)
    table.Row(
        {AxisName(r.axis), Text(r.step.rise_time_s, "{:.2f}"),
         fmt::format("{:.0f}%", 100 * r.step.overshoot), Text(r.step.settling_time_s, "{:.2f}"),
         fmt::format("{:.1f} {}", Shown(r.axis, r.disturbance.peak), ShownUnit(r.axis)),
         Text(r.disturbance.recovery_time_s, "{:.2f}"), Text(r.loop.crossover_hz, "{:.2f} Hz"),
         Text(Deg(r.loop.phase_margin_rad), "{:.0f} deg"), Text(r.loop.gain_margin, "x{:.2f}"),
         r.loop.delay_margin_s ? fmt::format("{:.0f} ms", 1000 * *r.loop.delay_margin_s) : "-",
         report::Fixed(r.loop.sensitivity_peak, 2)});
  return table.Text();
}

std::string StepJson(const trial::Scenario& scenario, const std::vector<AxisResponse>& responses) {
  return report::JsonText({{"controller", scenario.controller_name()},
                           {"estimator", scenario.pose_source},
                           {"axes", responses}});
}

std::string StepCsv(const std::vector<AxisResponse>& responses) {
  std::string csv = "axis,test,time_s,wanted,actual,demand\n";
  for (const AxisResponse& r : responses) {
    const auto add = [&](const char* test, const Answer& a) {
      for (size_t i = 0; i < a.time_s.size(); ++i)
        csv += fmt::format("{},{},{},{},{},{}\n", AxisName(r.axis), test, FormatNumber(a.time_s[i]),
                           FormatNumber(a.wanted[i]), FormatNumber(a.actual[i]),
                           FormatNumber(a.demand[i]));
    };
    add("step", r.step.answer);
    add("disturbance", r.disturbance.answer);
  }
  return csv;
}

void WriteStepFigure(const std::string& path, const std::string& title,
                     const std::vector<AxisResponse>& responses) {
  // a column an axis; in its rows step, push, gain and phase
  const size_t columns = responses.size();
  std::vector<report::Panel> panels(4 * columns);
  for (size_t i = 0; i < columns; ++i) {
    const AxisResponse& r = responses[i];
    panels[i] = TimePanel(fmt::format("{}: step, rise {} s, overshoot {:.0f} %", AxisName(r.axis),
                                      Text(r.step.rise_time_s, "{:.1f}"), 100 * r.step.overshoot),
                          r.axis, r.step.answer);
    panels[columns + i] =
        TimePanel(fmt::format("{}: steady push, moves {:.1f} {}", AxisName(r.axis),
                              Shown(r.axis, r.disturbance.peak), ShownUnit(r.axis)),
                  r.axis, r.disturbance.answer);
    const auto gain_db = [](const LoopPoint& p) { return 20 * std::log10(p.gain); };
    // within half a turn of the critical -180 deg
    const auto phase_deg = [](const LoopPoint& p) {
      return units::DegFromRad(WrapAngle(p.phase_rad + std::numbers::pi) - std::numbers::pi);
    };
    const auto over_frequency = [&](auto of) {
      return report::SamplesOf(r.loop.points, &LoopPoint::frequency_hz, of);
    };
    panels[2 * columns + i] =
        LoopPanel(fmt::format("loop: gain margin {}", Text(r.loop.gain_margin, "x{:.1f}")),
                  {"gain [dB]"}, report::Mark::kLineWithDots, 0, over_frequency(gain_db));
    panels[3 * columns + i] = LoopPanel(
        fmt::format("phase margin {} deg at {} Hz", Text(Deg(r.loop.phase_margin_rad), "{:.0f}"),
                    Text(r.loop.crossover_hz, "{:.2f}")),
        {.label = "phase [deg]", .low = -360, .high = 0, .tick_step = 90}, report::Mark::kDots,
        -180, over_frequency(phase_deg));
  }
  media::WriteFigure(
      path,
      {.title = title, .columns = columns, .width_px = 420, .height_px = 290, .panels = panels});
}

}  // namespace turbidock::step_response
