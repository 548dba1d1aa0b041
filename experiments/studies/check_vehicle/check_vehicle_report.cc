#include "experiments/studies/check_vehicle/check_vehicle_report.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "experiments/media/figure.h"
#include "experiments/report/table.h"
#include "sim/base/units.h"

namespace turbidock::check_vehicle {
namespace {

using report::Fixed;
using units::DegFromRad;

// Without the sign of what rounds to nothing.
double Rounded(double x, double step) { return step * std::round(x / step) + 0.0; }

std::string Vector(const Eigen::Vector3d& p, int digits) {
  const double step = std::pow(10, -digits);
  return fmt::format("{:.{}f}, {:.{}f}, {:.{}f}", Rounded(p.x(), step), digits,
                     Rounded(p.y(), step), digits, Rounded(p.z(), step), digits);
}

// The thrusters as arrows in a plane of B, with what they are called.
report::Panel Layout(const std::string& title, const VehicleCheck& check, int across, int up,
                     const std::string& across_label, const std::string& up_label) {
  constexpr double kLongest_m = 0.15;
  double most = 0;
  for (const ThrusterReport& t : check.thrusters) most = std::max(most, t.forward_newton);
  report::Panel panel{.title = title,
                      .x = {.label = across_label, .tick_step = 0.1},
                      .y = {.label = up_label, .tick_step = 0.1},
                      .legend = up == 1 ? report::Legend::kBeside : report::Legend::kNone};
  for (size_t i = 0; i < check.thrusters.size(); ++i) {
    const ThrusterReport& t = check.thrusters[i];
    const double length_m = most > 0 ? kLongest_m * t.forward_newton / most : 0;
    const Eigen::Vector3d tip = t.p_BT_m + length_m * t.axis_B;
    panel.series.push_back({.name = t.name,
                            .points = {{t.p_BT_m[across], t.p_BT_m[up]}, {tip[across], tip[up]}},
                            .color = report::CurveColor(i),
                            .width_px = 3});
    panel.series.push_back({.points = {{t.p_BT_m[across], t.p_BT_m[up]}},
                            .color = report::CurveColor(i),
                            .mark = report::Mark::kDots,
                            .dot_px = 12});
  }
  return panel;
}

report::Panel Bars(const std::string& title, const std::string& label, const VehicleCheck& check,
                   double AxisReport::*ahead, double AxisReport::*back, double unit) {
  report::Panel panel{.title = title,
                      .x = {.low = -0.6, .high = 3.6, .names = {}},
                      .y = {.label = label},
                      .rules = {{0}}};
  for (size_t i = 0; i < check.axes.size(); ++i) {
    panel.x.names.push_back(check.axes[i].axis);
    const auto x = static_cast<double>(i);
    const double high = unit * (check.axes[i].*ahead), low = unit * (check.axes[i].*back);
    panel.series.push_back({.points = {{x, high, 0, high}, {x, low, low, 0}},
                            .color = report::CurveColor(i),
                            .mark = report::Mark::kBars,
                            .width_px = 8});
  }
  return panel;
}

report::Panel Loads(const VehicleCheck& check) {
  report::Panel panel{.title = "what the sea asks for",
                      .x = {.low = -0.6, .high = 2.6, .names = {}},
                      .y = {.label = "% of the most force", .low = 0},
                      .rules = {{100, "", report::kGrey, report::Mark::kLine}}};
  for (size_t i = 0; i < 3; ++i) {
    const AxisReport& axis = check.axes[i];
    panel.x.names.push_back(axis.axis);
    const double share = 100 * axis.load / std::min(axis.most, -axis.most_back);
    panel.series.push_back({.points = {{static_cast<double>(i), share, 0, share}},
                            .color = report::CurveColor(i),
                            .mark = report::Mark::kBars,
                            .width_px = 8});
  }
  return panel;
}

report::Panel Swinging(const VehicleCheck& check) {
  report::Panel panel{.title = "let go at 5 degrees",
                      .x = {.label = "time [s]"},
                      .y = {.label = "angle [deg]"},
                      .legend = report::Legend::kBeside};
  double longest_s = 1;
  for (const Swing& swing : check.swings) longest_s = std::max(longest_s, 5 * swing.period_s);
  for (size_t i = 0; i < check.swings.size(); ++i) {
    const Swing& swing = check.swings[i];
    const double omega = 2 * std::numbers::pi / swing.period_s;
    const double decay = omega * swing.damping_ratio /
                         std::sqrt(std::max(1e-12, 1 - swing.damping_ratio * swing.damping_ratio));
    panel.series.push_back(
        {.name = swing.axis,
         .points = report::SamplesOf(
             report::Evenly(0, longest_s, 600),
             [&](double t_s) {
               return report::Sample{t_s, 5 * std::exp(-decay * t_s) * std::cos(omega * t_s)};
             }),
         .color = report::CurveColor(i)});
  }
  return panel;
}

}  // namespace

std::string CheckText(const VehicleCheck& check) {
  std::string text = fmt::format("{} in {}\n\n", check.vehicle, check.scenario);
  const Floating& f = check.floating;
  text += fmt::format(
      "{} with {:.1f} N; rests rolled by {:.1f} and pitched by {:.1f} deg; "
      "rights itself with {:.2f} N m a radian\n",
      f.buoyancy_newton >= 0 ? "rises" : "sinks", std::abs(f.buoyancy_newton),
      Rounded(DegFromRad(f.roll_rad), 0.1), Rounded(DegFromRad(f.pitch_rad), 0.1),
      f.righting_newton_m);
  for (const Swing& swing : check.swings)
    text += fmt::format("swings in {} with a period of {:.2f} s, damping ratio {:.2f}\n",
                        swing.axis, swing.period_s, Rounded(swing.damping_ratio, 0.01));
  report::Table thrusters(
      {"<thruster", "<at (x, y, z) m", "<pushes along", "N", "back N", "<drives"});
  for (const ThrusterReport& t : check.thrusters)
    thrusters.Row({t.name, Vector(t.p_BT_m, 3), Vector(t.axis_B, 2), Fixed(t.forward_newton, 1),
                   Fixed(t.reverse_newton, 1), t.drives});
  report::Table axes({"<axis", "most", "back", "speed", "back", "tilts deg", "the sea asks"});
  for (const AxisReport& a : check.axes) {
    const bool turns = a.axis == "yaw";
    const std::string force = turns ? " N m" : " N";
    const double unit = turns ? DegFromRad(1) : 1;
    axes.Row({a.axis, Fixed(a.most, 1) + force, Fixed(a.most_back, 1) + force,
              Fixed(unit * a.speed, 2) + (turns ? " deg/s" : " m/s"), Fixed(unit * a.speed_back, 2),
              Fixed(DegFromRad(std::max(std::abs(a.roll_rad), std::abs(a.pitch_rad))), 1),
              turns ? "-" : Fixed(a.load, 1) + " N"});
  }
  text += "\n" + thrusters.Text() + "\n" + axes.Text() + "\n";
  for (const ViewReport& view : check.views)
    text += fmt::format("{}, marker {:.2f} m ahead: {} comes nearest to its border, {:.0f} px\n",
                        view.place, view.x_m, view.nearest, view.margin_px);
  const PoleReport& p = check.pole;
  text += fmt::format(
      "docked, the pole is {:.0f} mm past the mouth and {:.0f} mm in the straight "
      "hole, {:.0f} mm to the left and {:.0f} mm above its axis, with {:.0f} mm "
      "free around it\n",
      1000 * p.depth_m, 1000 * p.past_throat_m, Rounded(1000 * p.aside_m, 1),
      Rounded(1000 * p.above_m, 1), 1000 * p.clearance_m);
  for (const std::string& warning : check.warnings) text += "\nwarning: " + warning;
  for (const std::string& problem : check.problems) text += "\nproblem: " + problem;
  if (!check.warnings.empty() || !check.problems.empty()) text += "\n";
  text += check.problems.empty() ? "\nready to dock\n" : "\nnot ready to dock\n";
  return text;
}

void WriteCheckFigure(const std::string& path, const VehicleCheck& check) {
  media::WriteFigure(
      path,
      {.title = check.vehicle,
       .columns = 2,
       .width_px = 700,
       .height_px = 420,
       .panels = {
           Layout("from above: where thrusters push", check, 0, 1, "x, ahead [m]", "y, left [m]"),
           Layout("from the left", check, 0, 2, "x, ahead [m]", "z, up [m]"),
           Bars("most force", "N, N m", check, &AxisReport::most, &AxisReport::most_back, 1),
           Bars("fastest", "m/s, rad/s", check, &AxisReport::speed, &AxisReport::speed_back, 1),
           Loads(check), Swinging(check)}});
}

std::string NamesTable(bool markdown) {
  report::Table table({"<part", "<kind", "<name", "<what it is"});
  for (const vehicle::ModelName& name : vehicle::ModelNames())
    table.Row(
        {name.of, name.kind, markdown ? fmt::format("`{}`", name.name) : name.name, name.meaning});
  return markdown ? table.Markdown() : table.Text();
}

}  // namespace turbidock::check_vehicle
