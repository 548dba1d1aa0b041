#include "experiments/trial/series.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <boost/algorithm/string/classification.hpp>
#include <boost/algorithm/string/split.hpp>
#include <string_view>
#include <utility>

#include "experiments/report/table.h"

namespace turbidock::trial {
namespace {

constexpr std::string_view kVolts = "_v";  // a thruster's column ends in it, and no other

// Calls add(name, value) for each column of a frame, in their order.
template <class Add>
void VisitColumns(const FrameRecord& r, const std::vector<std::string>& thrusters, const Add& add) {
  const auto add_pose = [&add](const std::string& of, const Pose& X) {
    const Pose c = X.Canonical();
    add(of + "_x_m", c.p.x());
    add(of + "_y_m", c.p.y());
    add(of + "_z_m", c.p.z());
    add(of + "_qw", c.q.w());
    add(of + "_qx", c.q.x());
    add(of + "_qy", c.q.y());
    add(of + "_qz", c.q.z());
  };
  add("frame", r.frame);
  add("time_s", r.time_s);
  add("stage", r.stage);
  add("controlled", int64_t{r.controlled});
  add("fitness", r.fitness);
  add_pose("est", r.est_X_HM);
  add("image_time_s", r.image_time_s);
  add_pose("true_at_image", r.true_at_image_X_HM);
  add_pose("true", r.true_X_HM);
  add("desired_x_m", r.desired.x_m);
  add("desired_y_m", r.desired.y_m);
  add("desired_z_m", r.desired.z_m);
  add("desired_yaw_rad", r.desired.yaw_rad);
  for (size_t i = 0; i < thrusters.size(); ++i)
    add(thrusters[i] + std::string(kVolts),
        r.command.volts.empty() ? kNeutralVolts : r.command.volts[i]);
  add_pose("vehicle", r.true_X_WB);
  add("surge_mps", r.true_V_WB_B.v.x());
  add("sway_mps", r.true_V_WB_B.v.y());
  add("heave_mps", r.true_V_WB_B.v.z());
  add("roll_rate_rad_s", r.true_V_WB_B.w.x());
  add("pitch_rate_rad_s", r.true_V_WB_B.w.y());
  add("yaw_rate_rad_s", r.true_V_WB_B.w.z());
  add("insertion_depth_m", r.insertion_depth_m);
  add("dock_force_newton", r.dock_force_newton);
  add("collision_force_newton", r.collision_force_newton);
}

std::vector<std::string> Split(const std::string& text, const char* separator) {
  std::vector<std::string> parts;
  return boost::split(parts, text, boost::is_any_of(separator));
}

}  // namespace

Series::Series(const std::vector<std::string>& thrusters) {
  VisitColumns({}, thrusters, [&]<class V>(std::string name, const V&) {
    columns_.push_back({std::move(name), std::vector<V>()});
  });
}

Series Series::Of(const TrialLog& log, int every_frames) {
  Series series(log.thrusters);
  const auto step = static_cast<size_t>(every_frames);
  for (size_t i = 0; i < log.frames.size(); i += step) {
    FrameRecord row = log.frames[i];
    for (size_t j = i + 1; j < std::min(i + step, log.frames.size()); ++j) {
      row.dock_force_newton = std::max(row.dock_force_newton, log.frames[j].dock_force_newton);
      row.collision_force_newton =
          std::max(row.collision_force_newton, log.frames[j].collision_force_newton);
    }
    series.Add(row);
  }
  return series;
}

void Series::Add(const FrameRecord& frame) {
  size_t at = 0;
  const std::vector<std::string> unnamed(voltages().size());
  VisitColumns(frame, unnamed, [&]<class V>(const std::string&, const V& value) {
    std::get<std::vector<V>>(columns_[at++].values).push_back(value);
  });
}

template <class V>
const std::vector<V>& Series::ColumnOf(const std::string& name) const {
  const auto column = std::ranges::find(columns_, name, &Column::name);
  TD_CHECK(column != columns_.end(), "a column of a log: " + name);
  return std::get<std::vector<V>>(column->values);
}
const std::vector<double>& Series::Numbers(const std::string& name) const {
  return ColumnOf<double>(name);
}
const std::vector<control::Stage>& Series::stages() const {
  return ColumnOf<control::Stage>("stage");
}
const std::vector<int64_t>& Series::controlled() const { return ColumnOf<int64_t>("controlled"); }

std::vector<std::string> Series::voltages() const {
  std::vector<std::string> voltages = names();
  std::erase_if(voltages, [](const std::string& name) { return !name.ends_with(kVolts); });
  return voltages;
}

Pose Series::PoseAt(const std::string& of, size_t row) const {
  const auto at = [&](const char* part) { return Numbers(of + part)[row]; };
  return {Eigen::Quaterniond(at("_qw"), at("_qx"), at("_qy"), at("_qz")),
          {at("_x_m"), at("_y_m"), at("_z_m")}};
}

std::vector<std::string> Series::names() const {
  std::vector<std::string> names;
  for (const Column& column : columns_) names.push_back(column.name);
  return names;
}

size_t Series::rows() const {
  if (columns_.empty()) return 0;
  return std::visit([](const auto& values) { return values.size(); }, columns_[0].values);
}

Cell Series::At(size_t row, size_t column) const {
  return std::visit([row](const auto& values) -> Cell { return values[row]; },
                    columns_[column].values);
}

Series Series::From(size_t row) const {
  Series rest = *this;
  for (Column& column : rest.columns_)
    std::visit(
        [row](auto& values) {
          values.erase(values.begin(), values.begin() + static_cast<ptrdiff_t>(row));
        },
        column.values);
  return rest;
}

std::string Series::Csv() const {
  std::string csv = fmt::format("{}\n", fmt::join(names(), ","));
  for (size_t row = 0; row < rows(); ++row)
    for (size_t i = 0; i < columns_.size(); ++i)
      csv += report::CsvField(At(row, i)) + (i + 1 < columns_.size() ? "," : "\n");
  return csv;
}

Series Series::FromCsv(const std::string& text, const std::string& where) {
  std::vector<std::string> lines = Split(text, "\n");
  if (lines.back().empty()) lines.pop_back();
  if (lines.empty()) throw ConfigError(where + ": is empty");
  const std::vector<std::string> names = Split(lines[0], ",");
  std::vector<report::Json> columns(names.size(), report::Json::array());
  for (size_t row = 1; row < lines.size(); ++row) {
    const std::vector<std::string> values = Split(lines[row], ",");
    if (values.size() != names.size())
      throw ConfigError(fmt::format("{}:{}: has {} values, the header {}", where, row + 1,
                                    values.size(), names.size()));
    for (size_t i = 0; i < names.size(); ++i) {
      const std::optional<double> number = report::NumberIn(values[i]);
      const Cell word = values[i].empty() ? Cell() : Cell(values[i]);
      columns[i].push_back(number ? Cell(*number) : word);
    }
  }
  report::Json json;
  for (size_t i = 0; i < names.size(); ++i) json[names[i]] = std::move(columns[i]);
  try {
    return FromJson(json);
  } catch (const ConfigError& error) {
    throw ConfigError(where + ": is no trajectory: " + error.what());
  }
}

Series Series::FromJson(const report::Json& json) {
  if (json.empty()) return {};
  std::vector<std::string> thrusters;
  for (const auto& [name, values] : json.items())
    if (name.ends_with(kVolts)) thrusters.push_back(name.substr(0, name.size() - kVolts.size()));
  Series series(thrusters);
  const std::vector<std::string> known = series.names();
  for (const auto& [name, values] : json.items())
    if (std::ranges::find(known, name) == known.end())
      throw ConfigError("no log has a column " + name);
  for (Column& column : series.columns_) {
    const auto cells = json.find(column.name);
    if (cells == json.end() || !cells->is_array())
      throw ConfigError("it has no column " + column.name);
    if (cells->size() != json.front().size())
      throw ConfigError(column.name, "has another number of rows than the others");
    for (size_t row = 0; row < cells->size(); ++row) {
      const auto add = [&cell = (*cells)[row]](auto& values) {
        using V = typename std::decay_t<decltype(values)>::value_type;
        if (cell.is_null() && !std::is_same_v<V, double>) throw ConfigError("is missing");
        ReadCell(cell, &values.emplace_back());
      };
      try {
        std::visit(add, column.values);
      } catch (const ConfigError& error) {
        throw ConfigError(fmt::format("{} in row {}", column.name, row + 1), error.what());
      }
    }
  }
  return series;
}

void to_json(report::Json& json, const Series& series) {
  json = report::Json::object();
  for (const Series::Column& column : series.columns())
    json[column.name] =
        std::visit([](const auto& values) { return report::Json(values); }, column.values);
}

}  // namespace turbidock::trial
