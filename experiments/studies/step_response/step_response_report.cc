#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "experiments/studies/step_response/step_response.h"
#include "experiments/system/build_info.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/pose.h"
#include "sim/base/units.h"

namespace turbidock::step_response {
namespace {

// Millimetres or degrees.
double Shown(control::Axis axis, double value) {
  return axis == control::kYaw ? units::DegFromRad(value) : units::MmFromM(value);
}
const char* ShownUnit(control::Axis axis) { return axis == control::kYaw ? "°" : "mm"; }
std::string Text(control::Axis axis, const std::string& value) {
  return report::Quantity{"", ShownUnit(axis)}.Text(value);
}

report::Table TableOf(const std::vector<AxisResponse>& responses) {
  const auto scaled = [](const std::optional<double>& value, double unit, int digits) {
    return value ? report::Fixed(unit * *value, digits) : "-";
  };
  report::Table table({"<axis", "rise, s", "overshoot, %", "settling, s", "push moves",
                       "recovery, s", "crossover, Hz", "phase margin, °", "gain margin, times",
                       "delay margin, ms", "peak of S"});
  for (const auto& [axis, not_measured, step, disturbance, loop] : responses) {
    if (!not_measured.empty()) continue;
    table.Row({AxisName(axis), report::Fixed(step.rise_time_s, 2),
               report::Fixed(100 * step.overshoot, 0), report::Fixed(step.settling_time_s, 2),
               Text(axis, report::Fixed(std::abs(Shown(axis, disturbance.peak)), 1)),
               report::Fixed(disturbance.recovery_time_s, 2), report::Fixed(loop.crossover_hz, 2),
               scaled(loop.phase_margin_rad, units::DegFromRad(1), 0),
               report::Fixed(loop.gain_margin, 2), scaled(loop.delay_margin_s, 1000, 0),
               report::Fixed(loop.sensitivity_peak, 2)});
  }
  return table;
}

// Leaves a gain margin of M / (M - 1) = 2 and a phase margin of 2 asin(1 / 2M) = 29 degrees.
constexpr double kMostSensitivity = 2;

report::Verdict VerdictOf(const std::vector<AxisResponse>& responses) {
  for (const AxisResponse& r : responses)
    if (!r.not_measured.empty())
      return {fmt::format("{} could not be measured", AxisName(r.axis)), report::Tone::kBad,
              r.not_measured};
  for (const AxisResponse& r : responses)
    if (!r.step.settling_time_s)
      return {fmt::format("the step on {} does not settle", AxisName(r.axis)), report::Tone::kBad,
              fmt::format("It does not come to stay within 5 %; it went beyond by {:.0f} %.",
                          100 * r.step.overshoot)};
  const AxisResponse& worst = *std::ranges::max_element(
      responses, {}, [](const AxisResponse& r) { return r.loop.sensitivity_peak; });
  const bool is_robust = worst.loop.sensitivity_peak <= kMostSensitivity;
  return {is_robust ? "robust" : "little robust",
          is_robust ? report::Tone::kGood : report::Tone::kBad,
          fmt::format(
              "The largest peak of S is {:.2f}, on {}; up to {:g} it guarantees a gain margin of 2 "
              "and a phase margin of 29°.",
              worst.loop.sensitivity_peak, AxisName(worst.axis), kMostSensitivity)};
}

// How far it moved from rest, where it should be, and the demand.
report::Panel TimePanel(const std::string& title, control::Axis axis, const Answer& a,
                        const std::string& demand_unit) {
  report::Series demand{.color = trial::kOnPaper.truth, .width_px = 1, .second_axis = true};
  report::Series actual{.color = trial::kOnPaper.estimate};
  for (size_t i = 0; i < a.time_s.size(); ++i) {
    demand.points.push_back({a.time_s[i], a.demand[i]});
    actual.points.push_back({a.time_s[i], Shown(axis, a.actual[i])});
  }
  return {.title = title,
          .x = {.label = "time, s", .tick_step = 5},
          .y = {fmt::format("moved from rest, {}", ShownUnit(axis))},
          .y2 = {fmt::format("demand (grey), {}", demand_unit)},
          .series = {demand, actual},
          .rules = {{Shown(axis, a.wanted), "", trial::kOnPaper.desired}}};
}

// With the limit that the loop must not come near.
report::Panel LoopPanel(const std::string& title, const report::Axis& y, report::Mark mark,
                        double limit, std::vector<report::Sample> points) {
  return {.title = title,
          .x = {.label = "frequency, Hz", .logarithmic = true},
          .y = y,
          .series = {{"", std::move(points), trial::kOnPaper.estimate, mark}},
          .rules = {{limit, "", trial::kOnPaper.limit, report::Mark::kLine}}};
}

report::Section SectionOf(const trial::Scenario& scenario, const AxisResponse& r) {
  const std::string name = AxisName(r.axis);
  const bool is_yaw = r.axis == control::kYaw;
  const std::string demand = scenario.plugins.Spec().asks_for_volts() ? "V" : is_yaw ? "N m" : "N";
  const auto gain_db = [](const LoopPoint& p) { return 20 * std::log10(p.gain); };
  // within half a turn of the critical -180 deg
  const auto phase_deg = [](const LoopPoint& p) {
    return units::DegFromRad(WrapAngle(p.phase_rad + std::numbers::pi) - std::numbers::pi);
  };
  const auto over_frequency = [&](auto of) {
    return report::SamplesOf(r.loop.points, &LoopPoint::frequency_hz, of);
  };
  const std::string step =
      fmt::format("{}: step of {}", name,
                  Text(r.axis, fmt::format("{:g}", Shown(r.axis, r.step.answer.wanted))));
  const std::string push = is_yaw ? fmt::format("{}: steady push of {:g} N m", name, kPush_newton_m)
                                  : fmt::format("{}: steady push of {:g} N", name, kPush_newton);
  return {.title = "Axis " + name,
          .note =
              "Over time blue is the true place, red where it should be, grey the controller's "
              "demand.",
          .panels = {TimePanel(step, r.axis, r.step.answer, demand),
                     TimePanel(push, r.axis, r.disturbance.answer, demand),
                     LoopPanel(name + ": gain of the loop", {"gain, dB"},
                               report::Mark::kLineWithDots, 0, over_frequency(gain_db)),
                     LoopPanel(name + ": phase of the loop",
                               {.label = "phase, °", .low = -360, .high = 0, .tick_step = 90},
                               report::Mark::kDots, -180, over_frequency(phase_deg))},
          .wide = true};
}

}  // namespace

report::Report ReportOf(const trial::Scenario& scenario,
                        const std::vector<AxisResponse>& responses) {
  const Eigen::Vector4d& noise = scenario.true_pose.noise;
  const bool by_cameras = scenario.pose_source == trial::PoseSource::kCameras;
  report::Report report{
      .kind = "step_response",
      .title = fmt::format("{}: {}", scenario.description, scenario.controller_name()),
      .build = system::VersionAndCommit(),
      .verdict = VerdictOf(responses),
      .facts = {{"controller", scenario.controller_name()},
                {"poses from", by_cameras ? "the cameras" : "the truth"},
                {"push", fmt::format("{:g} N", kPush_newton), "steady; of yaw 0.1 N m"},
                {"sinusoids", fmt::format("{:g} %", 100 * kAddedShare),
                 "of what the vehicle can give, added to the demand to measure the loop"}}};
  const std::string poses =
      by_cameras ? "Poses are estimates."
                 : fmt::format(
                       "Poses are true ones with noise of {:.2g} mm and {:.2g}° (x and yaw "
                       "at 0.6 m), without it where the loop is measured.",
                       units::MmFromM(noise[0]), units::DegFromRad(noise[3]));
  report.sections = {{.title = "Answers and margins",
                      .note = "In still water. Rise from 10 to 90 % of the step, settling to 5 % "
                              "of it, recovery to a tenth of the peak. S is the sensitivity "
                              "1 / (1 + L). \"-\": not within what was measured. " +
                              poses,
                      .table = TableOf(responses)}};
  for (const AxisResponse& response : responses)
    if (response.not_measured.empty())
      report.sections.push_back(SectionOf(scenario, response));
    else
      report.sections[0].lines.push_back(std::string("not measured: ") + response.not_measured);
  return report;
}

}  // namespace turbidock::step_response
