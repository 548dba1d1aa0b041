#include "experiments/trial/series.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include "experiments/report/table.h"

namespace turbidock::trial {
namespace {

constexpr std::string_view kVolts = "_v";  // a thruster's column ends in it, and no other

// Calls add(of, what, value) for each column of a frame, in their order: OFWHAT is its name.
template <class Add>
void VisitColumns(const FrameRecord& r, const std::vector<std::string>& thrusters, const Add& add) {
  const auto add_pose = [&add](std::string_view of, const Pose& X) {
    const Pose c = X.Canonical();
    add(of, "_x_m", c.p.x());
    add(of, "_y_m", c.p.y());
    add(of, "_z_m", c.p.z());
    add(of, "_qw", c.q.w());
    add(of, "_qx", c.q.x());
    add(of, "_qy", c.q.y());
    add(of, "_qz", c.q.z());
  };
  add("frame", "", r.frame);
  add("time_s", "", r.time_s);
  add("stage", "", r.stage);
  add("controlled", "", int64_t{r.controlled});
  add("fitness", "", r.fitness);
  add_pose("est", r.est_X_HM);
  add("image_time_s", "", r.image_time_s);
  add_pose("true_at_image", r.true_at_image_X_HM);
  add_pose("true", r.true_X_HM);
  add("desired_x_m", "", r.desired.x_m);
  add("desired_y_m", "", r.desired.y_m);
  add("desired_z_m", "", r.desired.z_m);
  add("desired_yaw_rad", "", r.desired.yaw_rad);
  for (size_t i = 0; i < thrusters.size(); ++i)
    add(thrusters[i], kVolts, r.command.volts.empty() ? kNeutralVolts : r.command.volts[i]);
  add_pose("vehicle", r.true_X_WB);
  add("surge_mps", "", r.true_V_WB_B.v.x());
  add("sway_mps", "", r.true_V_WB_B.v.y());
  add("heave_mps", "", r.true_V_WB_B.v.z());
  add("roll_rate_rad_s", "", r.true_V_WB_B.w.x());
  add("pitch_rate_rad_s", "", r.true_V_WB_B.w.y());
  add("yaw_rate_rad_s", "", r.true_V_WB_B.w.z());
  add("insertion_depth_m", "", r.insertion_depth_m);
  add("dock_force_newton", "", r.dock_force_newton);
  add("collision_force_newton", "", r.collision_force_newton);
}

// A value's bits and back; how many bytes they are, and what says so in the header.
template <class V>
constexpr size_t kWidth = std::is_enum_v<V> ? 1 : 8;

template <class V>
uint64_t BitsOf(V value) {
  if constexpr (std::is_enum_v<V>)
    return static_cast<uint64_t>(value);
  else
    return std::bit_cast<uint64_t>(value);
}

template <class V>
V ValueOf(uint64_t bits) {
  if constexpr (!std::is_enum_v<V>) {
    return std::bit_cast<V>(bits);
  } else {
    if (bits >= EnumNames<V>::kNames.size()) throw ConfigError("a series: a word out of range");
    return static_cast<V>(bits);
  }
}

template <class V>
report::Json KindOf() {
  if constexpr (std::is_enum_v<V>) {
    report::Json words = report::Json::array();
    for (const auto& [value, name] : EnumNames<V>::kNames) words.push_back(name);
    return words;
  } else if constexpr (std::is_integral_v<V>) {
    return "int";
  } else {
    return "double";
  }
}

// Adds a field of a CSV.
void AddText(const std::string& text, size_t row, Series::Column* column) {
  const std::optional<double> number = report::NumberIn(text);
  const Cell cell = number ? Cell(*number) : text.empty() ? Cell() : Cell(text);
  const auto add = [&cell](auto& values) {
    using V = typename std::decay_t<decltype(values)>::value_type;
    if (cell.is_null() && !std::is_same_v<V, double>) throw ConfigError("is missing");
    ReadCell(cell, &values.emplace_back());
  };
  try {
    std::visit(add, column->values);
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{} in row {}", column->name, row), error.what());
  }
}

std::vector<std::string> Split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text)
    if (c == separator)
      parts.emplace_back();
    else
      parts.back() += c;
  return parts;
}

}  // namespace

Series::Series(const std::vector<std::string>& thrusters) {
  VisitColumns({}, thrusters, [&]<class V>(std::string_view of, std::string_view what, const V&) {
    columns_.push_back({fmt::format("{}{}", of, what), std::vector<V>()});
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
  const auto is_voltage = [](const Column& column) { return column.name.ends_with(kVolts); };
  const std::vector<std::string> unnamed(std::ranges::count_if(columns_, is_voltage));
  VisitColumns(frame, unnamed, [&]<class V>(std::string_view, std::string_view, const V& value) {
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
  std::vector<std::string> lines = Split(text, '\n');
  if (lines.back().empty()) lines.pop_back();
  if (lines.empty()) throw ConfigError(where + ": is empty");
  const std::vector<std::string> names = Split(lines[0], ',');
  std::vector<std::vector<std::string>> rows;
  for (size_t row = 1; row < lines.size(); ++row) {
    rows.push_back(Split(lines[row], ','));
    if (rows.back().size() != names.size())
      throw ConfigError(fmt::format("{}:{}: has {} values, the header {}", where, row + 1,
                                    rows.back().size(), names.size()));
  }
  try {
    Series series = Of(names);
    for (Column& column : series.columns_) {
      const auto at = std::ranges::find(names, column.name) - names.begin();
      for (size_t row = 0; row < rows.size(); ++row)
        AddText(rows[row][static_cast<size_t>(at)], row + 1, &column);
    }
    return series;
  } catch (const ConfigError& error) {
    throw ConfigError(where + ": is no trajectory: " + error.what());
  }
}

// Without rows, with the columns of these names, in their own order.
Series Series::Of(const std::vector<std::string>& names) {
  std::vector<std::string> thrusters;
  for (const std::string& name : names)
    if (name.ends_with(kVolts)) thrusters.push_back(name.substr(0, name.size() - kVolts.size()));
  Series series(thrusters);
  const std::vector<std::string> known = series.names();
  for (const std::string& name : names)
    if (std::ranges::find(known, name) == known.end())
      throw ConfigError("no log has a column " + name);
  for (const std::string& name : known)
    if (std::ranges::find(names, name) == names.end())
      throw ConfigError("it has no column " + name);
  return series;
}

std::string Series::Bytes() const {
  report::Json columns = report::Json::array();
  std::string planes;
  for (const Column& column : columns_) {
    const auto add = [&](const auto& values) {
      using V = typename std::decay_t<decltype(values)>::value_type;
      columns.push_back({column.name, KindOf<V>()});
      const size_t begin = planes.size(), rows = values.size();
      planes.resize(begin + kWidth<V> * rows);
      for (size_t row = 0; row < rows; ++row)
        for (size_t k = 0; k < kWidth<V>; ++k)
          planes[begin + k * rows + row] = static_cast<char>(BitsOf(values[row]) >> (8 * k) & 0xff);
    };
    std::visit(add, column.values);
  }
  return report::JsonLine({{"rows", rows()}, {"columns", columns}}) + "\n" + planes;
}

Series Series::FromBytes(std::string_view bytes) {
  const std::string header(bytes.substr(0, bytes.find('\n')));
  const report::Json json = report::ParseJson(header, "a series");
  std::vector<std::string> names;
  size_t rows = 0;
  try {
    rows = json.at("rows").get<size_t>();
    for (const report::Json& column : json.at("columns")) names.push_back(column.at(0));
  } catch (const report::Json::exception& error) {
    throw ConfigError("a series: ", error.what());
  }
  if (names.empty()) return {};
  Series series = Of(names);
  std::string_view planes = bytes.substr(std::min(bytes.size(), header.size() + 1));
  for (size_t i = 0; i < names.size(); ++i) {
    const auto read = [&](auto& values) {
      using V = typename std::decay_t<decltype(values)>::value_type;
      const size_t size = kWidth<V> * rows;
      if (series.columns_[i].name != names[i] || json["columns"][i].at(1) != KindOf<V>() ||
          rows > planes.size() || size > planes.size())
        throw ConfigError("a series: column " + names[i] + " is not this program's");
      for (size_t row = 0; row < rows; ++row) {
        uint64_t bits = 0;
        for (size_t k = 0; k < kWidth<V>; ++k)
          bits |= uint64_t{static_cast<uint8_t>(planes[k * rows + row])} << (8 * k);
        values.push_back(ValueOf<V>(bits));
      }
      planes.remove_prefix(size);
    };
    std::visit(read, series.columns_[i].values);
  }
  return series;
}

Series Series::Rounded(int digits) const {
  Series rounded = *this;
  for (Column& column : rounded.columns_) {
    auto* const numbers = std::get_if<std::vector<double>>(&column.values);
    if (!numbers) continue;
    // of the 52 bits behind the first; a time finds its frame
    constexpr int kTimes = 8;
    const int least = column.name.ends_with("time_s") ? std::max(digits, kTimes) : digits;
    const auto kept = static_cast<int>(std::ceil(least * std::log2(10.0)));
    const uint64_t step = uint64_t{1} << std::max(0, 52 - kept);
    for (double& number : *numbers)
      if (std::isfinite(number))
        number = std::bit_cast<double>((std::bit_cast<uint64_t>(number) + step / 2) & ~(step - 1));
  }
  return rounded;
}

}  // namespace turbidock::trial
