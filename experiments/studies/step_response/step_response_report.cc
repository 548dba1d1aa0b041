#include "experiments/studies/step_response/step_response_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "experiments/media/gnuplot.h"
#include "experiments/report/json.h"
#include "experiments/report/table.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/pose.h"
#include "sim/base/units.h"

namespace turbidock::step_response {
namespace {

constexpr double kPanelHeight_px = 260, kPanelWidth_px = 420, kTitle_px = 40;
constexpr int kRows = 4;  // step, disturbance, gain, phase

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

std::string Color(const Rgb& rgb) {
  return fmt::format("'#{:02x}{:02x}{:02x}'", rgb[0], rgb[1], rgb[2]);
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
  return report::JsonText({{"controller", scenario.control.law},
                           {"estimator", scenario.pose_source},
                           {"axes", responses}});
}

std::string StepCsv(const std::vector<AxisResponse>& responses) {
  std::string csv = "axis,test,time_s,wanted,actual,demand_v\n";
  for (const AxisResponse& r : responses) {
    const auto add = [&](const char* test, const Answer& a) {
      for (size_t i = 0; i < a.time_s.size(); ++i)
        csv += fmt::format("{},{},{},{},{},{}\n", AxisName(r.axis), test, FormatNumber(a.time_s[i]),
                           FormatNumber(a.wanted[i]), FormatNumber(a.actual[i]),
                           FormatNumber(a.volts[i]));
    };
    add("step", r.step.answer);
    add("disturbance", r.disturbance.answer);
  }
  return csv;
}

void WriteStepFigure(const std::string& path, const std::string& title,
                     const std::vector<AxisResponse>& responses) {
  const auto columns = static_cast<int>(responses.size());
  media::GnuplotScript script;
  const auto answer = [&](const std::string& name, control::Axis axis, const Answer& a) {
    script.BeginData(name);
    for (size_t i = 0; i < a.time_s.size(); ++i)
      script.Row({a.time_s[i], Shown(axis, a.wanted[i]), Shown(axis, a.actual[i]), a.volts[i]});
    script.EndData();
  };
  for (int i = 0; i < columns; ++i) {
    const AxisResponse& r = responses[static_cast<size_t>(i)];
    answer(fmt::format("step{}", i), r.axis, r.step.answer);
    answer(fmt::format("push{}", i), r.axis, r.disturbance.answer);
    script.BeginData(fmt::format("loop{}", i));
    for (const LoopPoint& p : r.loop.points) {
      // within half a turn of the critical -180 deg
      const double phase_rad = WrapAngle(p.phase_rad + std::numbers::pi) - std::numbers::pi;
      script.Row({p.frequency_hz, 20 * std::log10(p.gain), units::DegFromRad(phase_rad)});
    }
    script.EndData();
  }
  script.Line(fmt::format("set multiplot layout {},{} columnsfirst title {}", kRows, columns,
                          media::GnuplotQuoted(title)));
  script.Line("set grid linecolor rgb '#d8dce0'").Line("unset key").Line("set border 3");
  script.Line("set tics nomirror").Line("set lmargin 9").Line("set rmargin 9");
  const std::string wanted =
      " with lines linewidth 1.6 dashtype (8,5) linecolor rgb " + Color(trial::kOnPaper.desired);
  const std::string actual =
      " with lines linewidth 2 linecolor rgb " + Color(trial::kOnPaper.estimate);
  const std::string volts =
      " axes x1y2 with lines linewidth 1 linecolor rgb " + Color(trial::kOnPaper.truth);
  for (int i = 0; i < columns; ++i) {
    const AxisResponse& r = responses[static_cast<size_t>(i)];
    const auto time_panel = [&](const std::string& data, const std::string& what) {
      script.Line("set title " + media::GnuplotQuoted(what));
      script.Line("set xlabel 'time [s]' offset 0,0.5").Line("set xtics autofreq 5");
      script.Line(fmt::format("set ylabel 'moved [{}]' offset 1,0", ShownUnit(r.axis)));
      script.Line("set y2tics").Line("set y2label 'demand [V] (grey)' offset -1,0");
      script.Line("set border 11");
      script.Line(fmt::format("plot ${0} using 1:4{1}, ${0} using 1:2{2}, ${0} using 1:3{3}", data,
                              volts, wanted, actual));
    };
    time_panel(fmt::format("step{}", i),
               fmt::format("{}: step, rise {} s, overshoot {:.0f} %", AxisName(r.axis),
                           Text(r.step.rise_time_s, "{:.1f}"), 100 * r.step.overshoot));
    time_panel(fmt::format("push{}", i),
               fmt::format("{}: steady push, moves {:.1f} {}", AxisName(r.axis),
                           Shown(r.axis, r.disturbance.peak), ShownUnit(r.axis)));
    script.Line("unset y2tics").Line("unset y2label").Line("set border 3").Line("set logscale x");
    script.Line("set xtics autofreq").Line("set xlabel 'frequency [Hz]' offset 0,0.5");
    const auto bode_panel = [&](const char* label, const std::string& what, double limit,
                                int column, const char* style) {
      script.Line("set title " + media::GnuplotQuoted(what));
      script.Line(fmt::format("set ylabel '{}' offset 1,0", label));
      script.Line(fmt::format(
          "plot $loop{0} using 1:{1} with {2} pointtype 7 pointsize "
          "0.6 linewidth 2 linecolor rgb {3}, {4} with lines linewidth 1.4 "
          "linecolor rgb {5}",
          i, column, style, Color(trial::kOnPaper.estimate), limit, Color(trial::kOnPaper.limit)));
    };
    bode_panel("gain [dB]",
               fmt::format("loop: gain margin {}", Text(r.loop.gain_margin, "x{:.1f}")), 0, 2,
               "linespoints");
    script.Line("set yrange [-360:0]").Line("set ytics 90");
    bode_panel(
        "phase [deg]",
        fmt::format("phase margin {} deg at {} Hz", Text(Deg(r.loop.phase_margin_rad), "{:.0f}"),
                    Text(r.loop.crossover_hz, "{:.2f}")),
        -180, 3, "points");
    script.Line("set yrange [*:*]").Line("set ytics autofreq");
    script.Line("unset logscale x");
  }
  script.Line("unset multiplot");
  script.WritePng(path, static_cast<int>(kPanelWidth_px * columns),
                  static_cast<int>(kTitle_px + kRows * kPanelHeight_px));
}

}  // namespace turbidock::step_response
