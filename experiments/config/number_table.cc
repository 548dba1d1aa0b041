#include "experiments/config/number_table.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <boost/algorithm/string/classification.hpp>
#include <boost/algorithm/string/split.hpp>
#include <boost/algorithm/string/trim.hpp>
#include <charconv>
#include <cmath>
#include <limits>

#include "experiments/system/output_path.h"
#include "sim/base/fields.h"

namespace turbidock::config {
namespace {

double NumberOrNaN(const std::string& text) {
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && stop == end ? number : std::numeric_limits<double>::quiet_NaN();
}

std::vector<std::string> CellsIn(const std::string& line) {
  std::vector<std::string> cells;
  boost::split(cells, line, boost::is_any_of(","));
  for (std::string& cell : cells) boost::trim(cell);
  return cells;
}

}  // namespace

const std::vector<double>* NumberTable::Find(const std::string& name) const {
  const auto at = std::ranges::find(names, name);
  return at == names.end() ? nullptr : &columns[static_cast<size_t>(at - names.begin())];
}

std::string NumberTable::Csv() const {
  std::string csv = fmt::format("{}\n", fmt::join(names, ","));
  for (size_t row = 0; row < rows(); ++row)
    for (size_t i = 0; i < columns.size(); ++i) {
      if (std::isfinite(columns[i][row])) csv += FormatNumber(columns[i][row]);
      csv += i + 1 < columns.size() ? ',' : '\n';
    }
  return csv;
}

std::string PlaceOf(const std::string& file, size_t row) {
  constexpr size_t kFirstLine = 2;
  return fmt::format("{}:{}", file, row + kFirstLine);
}

NumberTable ReadNumberTable(const std::string& file) {
  const std::string text = system::ReadWhole(file);
  std::vector<std::string> lines;
  boost::split(lines, text, boost::is_any_of("\n"));
  while (!lines.empty() && boost::trim_copy(lines.back()).empty()) lines.pop_back();
  constexpr size_t kFewest = 2;
  if (lines.size() < kFewest) throw ConfigError(file + ": has no rows");
  NumberTable table{.names = CellsIn(lines[0]), .columns = {}};
  for (auto name = table.names.begin(); name != table.names.end(); ++name)
    if (std::find(table.names.begin(), name, *name) != name)
      throw ConfigError(fmt::format("{}:1: has the column {} twice", file, *name));
  table.columns.resize(table.names.size());
  for (auto& column : table.columns) column.reserve(lines.size());
  for (size_t row = 0; row + 1 < lines.size(); ++row) {
    const std::vector<std::string> cells = CellsIn(lines[row + 1]);
    if (cells.size() != table.names.size())
      throw ConfigError(fmt::format("{}: has {} values, the header {}", PlaceOf(file, row),
                                    cells.size(), table.names.size()));
    for (size_t i = 0; i < cells.size(); ++i) table.columns[i].push_back(NumberOrNaN(cells[i]));
  }
  return table;
}

const std::vector<double>& TimesOf(const NumberTable& table, const std::string& file) {
  const std::vector<double>* times = table.Find("time_s");
  if (!times) throw ConfigError(file + ":1: has no column time_s");
  for (size_t row = 0; row < times->size(); ++row) {
    const double now = (*times)[row];
    if (!std::isfinite(now)) throw ConfigError(PlaceOf(file, row) + ": time_s is no number");
    if (row > 0 && !(now > (*times)[row - 1]))
      throw ConfigError(fmt::format("{}: the clock runs backwards, from {} to {} s",
                                    PlaceOf(file, row), FormatNumber((*times)[row - 1]),
                                    FormatNumber(now)));
  }
  return *times;
}

}  // namespace turbidock::config
