#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <utility>

#include "experiments/report/table.h"
#include "experiments/studies/check_vehicle/check_vehicle.h"
#include "experiments/system/build_info.h"
#include "sim/base/units.h"

namespace turbidock::check_vehicle {
namespace {

using report::Fixed;
using units::DegFromRad;
using units::MmFromM;

// Without the sign of what rounds to nothing.
double Rounded(double x, double step) { return step * std::round(x / step) + 0.0; }

std::string Vector(const Eigen::Vector3d& p, int digits) {
  const double step = std::pow(10, -digits);
  return fmt::format("{:.{}f}, {:.{}f}, {:.{}f}", Rounded(p.x(), step), digits,
                     Rounded(p.y(), step), digits, Rounded(p.z(), step), digits);
}

std::vector<report::Fact> FactsOf(const VehicleCheck& check) {
  const Floating& f = check.floating;
  const Eigen::Vector3d size_mm = 1000 * check.hull_size_m();
  std::vector<report::Fact> facts = {
      {"mass", fmt::format("{:.2f} kg", check.mass_kg), "with its loads"},
      {"hull", fmt::format("{:.0f} x {:.0f} x {:.0f} mm", size_mm.x(), size_mm.y(), size_mm.z()),
       "long, wide and high, from " + check.mjcf},
      {f.buoyancy_newton >= 0 ? "rises with" : "sinks with",
       fmt::format("{:.1f} N", std::abs(f.buoyancy_newton)), "thrusters off"},
      {"rests",
       fmt::format("{:.1f}° and {:.1f}°", Rounded(DegFromRad(f.roll_rad), 0.1),
                   Rounded(DegFromRad(f.pitch_rad), 0.1)),
       "rolled and pitched"},
      {"rights itself with", fmt::format("{:.2f} N m", f.righting_newton_m), "a radian"},
      {"levelled by", check.levels ? "its thrusters" : "its weight alone", "in roll and pitch"}};
  for (const ViewReport& view : check.views)
    facts.push_back(
        {"margin, " + view.place, fmt::format("{:.0f} px", view.margin_px),
         fmt::format("from {} to its border, marker {:.2f} m ahead", view.nearest, view.x_m)});
  const PoleReport& p = check.pole;
  facts.push_back({"pole in the hole", fmt::format("{:.0f} mm", MmFromM(p.past_throat_m)),
                   fmt::format("docked, {:.0f} mm past the mouth", MmFromM(p.depth_m))});
  facts.push_back({"pole off its axis", BesideText(p.aside_m, p.above_m),
                   fmt::format("with {:.0f} mm free around it", MmFromM(p.clearance_m))});
  if (check.flights.flown > 0)
    facts.push_back({"docked", fmt::format("{} of {}", check.flights.docked, check.flights.flown),
                     "trials on the true pose"});
  return facts;
}

// The convex hull of points, projected on x and another axis: the farthest in each direction, of
// which none is along an axis, where two may be equally far.
std::vector<report::Sample> OutlineOf(const std::vector<Eigen::Vector3d>& points_m, int up) {
  return report::SamplesOf(
      report::Evenly(0.001, 0.001 + 2 * std::numbers::pi, 720), [&](double angle_rad) {
        const auto reach = [&](const Eigen::Vector3d& p) {
          return p.x() * std::cos(angle_rad) + p[up] * std::sin(angle_rad);
        };
        const Eigen::Vector3d& farthest = *std::ranges::max_element(points_m, {}, reach);
        return report::Sample{farthest.x(), farthest[up]};
      });
}

// The thrusters as arrows in a plane of B, with what they are called.
report::Panel Layout(const std::string& title, const VehicleCheck& check, int up,
                     const std::string& up_label) {
  constexpr double kLongest_m = 0.15;
  double most = 0;
  for (const ThrusterReport& t : check.thrusters) most = std::max(most, t.forward_newton);
  report::Panel panel{.title = title,
                      .x = {.label = "x (ahead), m"},
                      .y = {.label = up_label},
                      .legend = true,
                      .equal = true};
  for (const HullReport& h : check.hull)
    panel.series.push_back({.name = h.part,
                            .points = OutlineOf(h.points_m, up),
                            .color = report::kGrey,
                            .width_px = h.part == "hull" ? 1.6 : 1});
  for (size_t i = 0; i < check.thrusters.size(); ++i) {
    const ThrusterReport& t = check.thrusters[i];
    const double length_m = most > 0 ? kLongest_m * t.forward_newton / most : 0;
    const Eigen::Vector3d tip = t.p_BT_m + length_m * t.axis_B;
    const report::Sample at{t.p_BT_m.x(), t.p_BT_m[up]};
    const Rgb& color = report::CurveColor(i);
    panel.series.push_back({.name = report::Words(t.name),
                            .points = {at, {tip.x(), tip[up]}},
                            .color = color,
                            .width_px = 3});
    panel.series.push_back(
        {.points = {at}, .color = color, .mark = report::Mark::kDots, .dot_px = 12});
  }
  return panel;
}

report::Section ThrusterSection(const VehicleCheck& check) {
  report::Table table(
      {"<thruster", "<at (x, y, z), m", "<pushes along", "ahead, N", "back, N", "<drives"});
  for (const ThrusterReport& t : check.thrusters)
    table.Row({report::Words(t.name), Vector(t.p_BT_m, 3), Vector(t.axis_B, 2),
               Fixed(t.forward_newton, 1), Fixed(t.reverse_newton, 1), t.drives});
  return {.title = "Thrusters",
          .note =
              "A line goes from a thruster to where it pushes; the longest is the strongest. Grey: "
              "outlines of what can touch of the hull, and of the pole.",
          .table = table,
          .panels = {Layout("from above", check, 1, "y (left), m"),
                     Layout("from the left", check, 2, "z (up), m")}};
}

// What the thrusters have along each axis, and what the sea takes of it.
report::Section AxisSection(const VehicleCheck& check) {
  report::Table table({"<axis", "most", "back", "speed", "back", "tilts, °", "the sea asks"});
  report::Series have{"most force", {}, report::CurveColor(0), report::Mark::kBars, 8};
  report::Series asked{"the sea asks", {}, report::CurveColor(1), report::Mark::kRings, 2, 10};
  report::Panel panel{.title = "force, and what the sea asks for",
                      .y = {.label = "force, N"},
                      .rules = {{0}},
                      .legend = true};
  for (const AxisReport& a : check.axes) {
    const bool turns = a.axis == "yaw";
    const std::string force = turns ? " N m" : " N";
    const double unit = turns ? DegFromRad(1) : 1;
    table.Row({a.axis, Fixed(a.most, 1) + force, Fixed(a.most_back, 1) + force,
               Fixed(unit * a.speed, 2) + (turns ? "°/s" : " m/s"), Fixed(unit * a.speed_back, 2),
               Fixed(DegFromRad(a.tilt_rad()), 1), turns ? "-" : Fixed(a.load, 1) + " N"});
    if (turns) continue;
    const auto x = static_cast<double>(panel.x.names.size());
    panel.x.names.push_back(a.axis);
    have.points.push_back({x, a.most, a.most_back, a.most});
    asked.points.push_back({x, a.load});
    asked.points.push_back({x, -a.load});
  }
  panel.series = {have, asked};
  return {.title = "Axes", .table = table, .panels = {panel}};
}

}  // namespace

report::Report ReportOf(const VehicleCheck& check) {
  const bool ready = check.problems.empty();
  const auto count = [](const std::vector<std::string>& list, const char* what) {
    return fmt::format("{} {}{}", list.size(), what, list.size() == 1 ? "" : "s");
  };
  report::Report report{
      .kind = "check_vehicle",
      .title = fmt::format("{} in {}", std::filesystem::path(check.vehicle).filename().string(),
                           check.scenario),
      .build = system::VersionAndCommit(),
      .verdict = {ready ? "ready to dock" : "not ready to dock",
                  ready ? report::Tone::kGood : report::Tone::kBad,
                  fmt::format("{} and {}.", count(check.problems, "problem"),
                              count(check.warnings, "warning"))},
      .facts = FactsOf(check)};
  if (!ready) report.sections.push_back({.title = "Problems", .lines = check.problems});
  if (!check.warnings.empty())
    report.sections.push_back({.title = "Warnings", .lines = check.warnings});
  report.sections.push_back(ThrusterSection(check));
  report.sections.push_back(AxisSection(check));
  return report;
}

}  // namespace turbidock::check_vehicle
