#include "experiments/trial/recorded.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "control/thrust_allocation.h"

namespace turbidock::trial {
namespace {

using config::NumberTable;
using control::Axes;
using control::Playback;
using control::VehicleModel;
using TableColumns = std::vector<const std::vector<double>*>;

const std::array<const char*, control::kAxisCount> kAxisColumns = {"surge_newton", "sway_newton",
                                                                   "heave_newton", "yaw_newton_m"};
constexpr double kLeastPulse_us = 800, kMostPulse_us = 2200;  // what servos take at all

bool IsPulse(double x) { return x >= kLeastPulse_us && x <= kMostPulse_us; }

std::string Listing(const std::vector<std::string>& names) {
  return fmt::format("{}", fmt::join(names, ", "));
}

std::vector<std::string> NamesIn(const VehicleModel& vehicle) {
  std::vector<std::string> names;
  names.reserve(vehicle.thrusters.size());
  for (const control::ThrusterModel& thruster : vehicle.thrusters) names.push_back(thruster.name);
  return names;
}

// The columns of one unit, one for each thruster; none where the table has none of them.
TableColumns ThrusterColumns(const NumberTable& table, const std::string& where,
                             const std::string& unit, const std::vector<std::string>& thrusters) {
  TableColumns found;
  std::vector<std::string> missing;
  for (const std::string& thruster : thrusters) {
    if (const auto* column = table.Find(thruster + unit))
      found.push_back(column);
    else
      missing.push_back(thruster);
  }
  if (found.empty()) return {};
  if (!missing.empty())
    throw ConfigError(fmt::format("{}:1: has no column {}{}; the vehicle's thrusters are {}", where,
                                  missing[0], unit, Listing(thrusters)));
  if (unit == "_newton") return found;  // others may be forces of something else
  for (const std::string& name : table.names)
    if (name.ends_with(unit) &&
        std::ranges::find(thrusters, name.substr(0, name.size() - unit.size())) == thrusters.end())
      throw ConfigError(fmt::format("{}:1: {} is of no thruster of the vehicle; it has {}", where,
                                    name, Listing(thrusters)));
  return found;
}

// What a table of other thrusters' commands is told.
[[noreturn]] void FailWithoutCommands(const NumberTable& table, const std::string& where,
                                      const std::vector<std::string>& thrusters) {
  std::vector<std::string> others;
  for (const std::string& name : table.names)
    if (name.ends_with("_v") || name.ends_with("_pwm_us")) others.push_back(name);
  throw ConfigError(fmt::format(
      "{}:1: has no commands: {}the vehicle wants THRUSTER_v, THRUSTER_pwm_us or THRUSTER_newton "
      "of {}, or {}",
      where, others.empty() ? "" : "it has " + Listing(others) + ", ", Listing(thrusters),
      fmt::join(kAxisColumns, ", ")));
}

double VoltsIn(double value, const std::string& place, const std::string& name) {
  if (value >= 0 && value <= kMaxVolts) return value;
  throw ConfigError(fmt::format(
      "{}: {}_v = {}, must be in [0, {}]{}", place, name, FormatNumber(value), kMaxVolts,
      IsPulse(value)         ? "; it looks like a pulse width: name the column " + name + "_pwm_us"
      : std::abs(value) <= 1 ? "; it looks like a share of full thrust: 2.5 + 2.5 x is its voltage"
                             : ""));
}

double PulseIn(double value, const std::string& place, const std::string& name) {
  if (IsPulse(value)) return std::clamp(control::VoltsOfPulse(value), 0.0, kMaxVolts);
  throw ConfigError(fmt::format("{}: {}_pwm_us = {}, must be in [{}, {}]{}", place, name,
                                FormatNumber(value), kLeastPulse_us, kMostPulse_us,
                                value >= 0 && value <= kMaxVolts
                                    ? "; it looks like volts: name the column " + name + "_v"
                                    : ""));
}

double ThrustIn(double value, const std::string& place, const control::ThrusterModel& thruster) {
  const double most = std::max(thruster.curve.FullForward(), -thruster.curve.FullReverse());
  if (std::abs(value) > 2 * most && IsPulse(value))
    throw ConfigError(fmt::format(
        "{}: {}_newton = {}, but it gives {} N at most; it looks like a pulse width: name the "
        "column {}_pwm_us",
        place, thruster.name, FormatNumber(value), FormatNumber(most), thruster.name));
  return thruster.curve.Volts(value);
}

// A row without a number has no command; one that has only some is a mistake.
bool HasCommand(const TableColumns& columns, size_t row, const std::string& place) {
  const auto numbers = std::ranges::count_if(
      columns, [row](const auto* column) { return std::isfinite((*column)[row]); });
  if (numbers != 0 && numbers != std::ssize(columns))
    throw ConfigError(place + ": has commands for some thrusters only");
  return numbers != 0;
}

// No command for so much longer than usual that something is missing.
void RequireNoGaps(const std::vector<Playback::Row>& rows, const std::string& where) {
  constexpr double kShortest_s = 1, kUsual = 20;
  constexpr size_t kFew = 10;  // a schedule written by hand, not a log
  if (rows.size() < kFew) return;
  std::vector<double> steps;
  steps.reserve(rows.size());
  for (size_t i = 1; i < rows.size(); ++i) steps.push_back(rows[i].time_s - rows[i - 1].time_s);
  std::vector<double> sorted = steps;
  std::ranges::sort(sorted);
  const double usual_s = sorted[sorted.size() / 2];
  for (size_t i = 0; i < steps.size(); ++i)
    if (steps[i] > std::max(kShortest_s, kUsual * usual_s))
      throw ConfigError(fmt::format(
          "{}: no command from {:.3f} s on for {:.3f} s, where one comes every {:.3g} s: a gap; "
          "play the parts on their own",
          where, rows[i].time_s, steps[i], usual_s));
}

// Where a table has its commands, and what those of a row are.
struct CommandAt {
  TableColumns columns;
  std::function<ThrusterCommand(size_t row, const std::string& place)> at;
};

CommandAt ByThruster(const TableColumns& columns, const std::string& unit,
                     const VehicleModel& vehicle) {
  return {columns, [=, &vehicle](size_t row, const std::string& place) {
            ThrusterCommand command;
            for (size_t i = 0; i < columns.size(); ++i) {
              const double value = (*columns[i])[row];
              const control::ThrusterModel& thruster = vehicle.thrusters[i];
              command.volts.push_back(unit == "_v"        ? VoltsIn(value, place, thruster.name)
                                      : unit == "_pwm_us" ? PulseIn(value, place, thruster.name)
                                                          : ThrustIn(value, place, thruster));
            }
            return command;
          }};
}

CommandAt ByAxis(const TableColumns& columns, const VehicleModel& vehicle) {
  const control::ForceAllocation allocation({}, vehicle, /*may_lack_axes=*/true);
  return {columns, [=](size_t row, const std::string& /*place*/) {
            Axes demand;
            for (size_t axis = 0; axis < columns.size(); ++axis)
              demand[static_cast<int>(axis)] = (*columns[axis])[row];
            return allocation.Share(demand).command;
          }};
}

// The first kind that the table has. Demands by axis before thrusters' newtons: a thruster may be
// called after its axis.
CommandAt CommandsOf(const NumberTable& table, const std::string& where,
                     const VehicleModel& vehicle) {
  const std::vector<std::string> thrusters = NamesIn(vehicle);
  for (const char* unit : {"_v", "_pwm_us"})
    if (const TableColumns columns = ThrusterColumns(table, where, unit, thrusters);
        !columns.empty())
      return ByThruster(columns, unit, vehicle);
  TableColumns axes;
  for (const char* name : kAxisColumns)
    if (const auto* column = table.Find(name)) axes.push_back(column);
  if (axes.size() == kAxisColumns.size()) return ByAxis(axes, vehicle);
  const TableColumns columns = ThrusterColumns(table, where, "_newton", thrusters);
  if (columns.empty()) FailWithoutCommands(table, where, thrusters);
  return ByThruster(columns, "_newton", vehicle);
}

}  // namespace

std::vector<Playback::Row> CommandsIn(const NumberTable& table, const std::string& where,
                                      const VehicleModel& vehicle) {
  const std::vector<double>& times = config::TimesOf(table, where);
  const CommandAt command_at = CommandsOf(table, where, vehicle);
  const TableColumns& columns = command_at.columns;
  std::vector<Playback::Row> rows;
  rows.reserve(times.size());
  for (size_t row = 0; row < times.size(); ++row) {
    const std::string place = config::PlaceOf(where, row);
    if (HasCommand(columns, row, place)) rows.push_back({times[row], command_at.at(row, place)});
  }
  if (rows.empty()) throw ConfigError(where + ": has no row with a command");
  return rows;
}

Playback PlaybackOf(const control::PlaybackParams& params, const VehicleModel& vehicle,
                    double duration_s) {
  std::vector<Playback::Row> rows =
      CommandsIn(config::ReadNumberTable(params.file), params.file, vehicle);
  RequireNoGaps(rows, params.file);
  const double from_s = rows.front().time_s, to_s = rows.back().time_s;
  for (Playback::Row& row : rows) row.time_s -= params.begin_s;
  if (rows.front().time_s > duration_s || rows.back().time_s < 0)
    throw ConfigError("control.playback.begin_s",
                      fmt::format("{} leaves no command for the trial's {} s: those of {} are from "
                                  "{} to {} s",
                                  FormatNumber(params.begin_s), FormatNumber(duration_s),
                                  params.file.path, FormatNumber(from_s), FormatNumber(to_s)));
  return {std::move(rows), vehicle.thrusters.size()};
}

control::ControllerSpec PlaybackSpec(const control::PlaybackParams& params) {
  return {.make = [](const auto&...) { return std::make_unique<control::OpenLoop>(); },
          .commands = [params](const VehicleModel& vehicle,
                               double duration_s) -> control::CommandsOverTime {
            return [commands = PlaybackOf(params, vehicle, duration_s)](
                       double time_s) -> const ThrusterCommand& { return commands.At(time_s); };
          }};
}

vehicle::CurrentSeries CurrentOf(const vehicle::SeaParams& sea) {
  const std::string& file = sea.current.file;
  if (file.empty()) return {};
  const NumberTable table = config::ReadNumberTable(file);
  const std::vector<double>& times = config::TimesOf(table, file);
  const auto* x = table.Find("water_x_mps");
  const auto* y = table.Find("water_y_mps");
  const auto* z = table.Find("water_z_mps");
  const auto* speed = table.Find("speed_mps");
  const auto* direction = table.Find("direction_rad");
  const bool by_components = x && y;
  // One of the two in full, and nothing of the other.
  if (by_components ? speed || direction : !speed || !direction || x || y || z)
    throw ConfigError(file +
                      ":1: must have columns water_x_mps and water_y_mps (and water_z_mps) or "
                      "speed_mps and direction_rad, not of both");
  vehicle::CurrentSeries series;
  series.reserve(times.size());
  for (size_t row = 0; row < times.size(); ++row) {
    Eigen::Vector3d v_W;
    if (by_components)
      v_W = {(*x)[row], (*y)[row], z ? (*z)[row] : 0};
    else
      v_W = (*speed)[row] *
            Eigen::Vector3d(std::cos((*direction)[row]), std::sin((*direction)[row]), 0);
    constexpr double kMost_mps = 5;
    if (v_W.array().isNaN().any()) continue;  // not measured then
    if (!(v_W.norm() <= kMost_mps))
      throw ConfigError(fmt::format("{}: a current of {:.3g} m/s, must be at most {} m/s",
                                    config::PlaceOf(file, row), v_W.norm(), kMost_mps));
    series.push_back({times[row], v_W});
  }
  if (series.empty()) throw ConfigError(file + ": has no row with a current");
  return series;
}

vehicle::Sea SeaOf(const Scenario& scenario, Rng rng) {
  return {scenario.sea, rng, CurrentOf(scenario.sea)};
}

}  // namespace turbidock::trial
