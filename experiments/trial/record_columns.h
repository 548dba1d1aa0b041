#pragma once
// A trial's record as a row of named cells: what the pipe from a worker and a batch's
// file have in common. All from TrialRecord::Fields.

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "experiments/report/json.h"
#include "experiments/trial/trial_record.h"

namespace turbidock::trial {

// One value of a row, of a record or of a frame of the log (series.h): a bool, a number or a text;
// null for what did not happen and for a number that is not finite.
using Cell = report::Json;

// Enums by their names.
template <class V>
Cell CellOf(const V& value) {
  if constexpr (std::is_same_v<V, std::optional<double>>)
    return value ? CellOf(*value) : Cell();
  else if constexpr (std::is_same_v<V, double>)
    return std::isfinite(value) ? Cell(value) : Cell();
  else
    return value;
}

// Reads a cell. Null is NaN for a double and leaves anything else as it is. ConfigError, which does
// not know the column's name, for a value of another type or out of V's range.
template <class V>
void ReadCell(const Cell& cell, V* value) {
  const bool is_text = cell.is_string();
  if constexpr (std::is_same_v<V, std::string> || std::is_enum_v<V>) {
    if (cell.is_null()) return;
    if (!is_text) throw ConfigError("is a number, must be text");
    const auto& text = cell.get_ref<const std::string&>();
    if constexpr (std::is_same_v<V, std::string>) {
      *value = text;
    } else {
      for (const auto& [known, name] : EnumNames<V>::kNames)
        if (text == name) {
          *value = known;
          return;
        }
      throw ConfigError("'" + text + "' is no word of this program");
    }
  } else {
    if (is_text) throw ConfigError("'" + cell.get<std::string>() + "' is no number");
    if (cell.is_structured()) throw ConfigError("is neither a number nor a text");
    const double number = cell.is_boolean()  ? static_cast<double>(cell.get<bool>())
                          : cell.is_number() ? cell.get<double>()
                                             : std::numeric_limits<double>::quiet_NaN();
    if constexpr (std::is_same_v<V, std::optional<double>>) {
      *value = cell.is_null() ? std::nullopt : std::optional(number);
    } else if constexpr (std::is_same_v<V, double>) {
      *value = number;
    } else if (cell.is_number_integer()) {
      *value = static_cast<V>(cell.get<int64_t>());  // all digits of a seed
      if (static_cast<int64_t>(*value) != cell.get<int64_t>()) throw ConfigError("is out of range");
    } else if (!cell.is_null()) {
      if (!(std::abs(number) <= 1e9)) throw ConfigError("is out of range");
      *value = static_cast<V>(number);
    }
  }
}

struct Column {
  std::string name;  // in snake_case, with its unit; unique
  Storage storage = Storage::kMetric;
  const char* sql_type = "REAL";
};

// Every column, in the order of the fields; a group has one for each member, a map one for each
// value of its enum.
const std::vector<Column>& Columns();

// A cell for each column. A trial without an end of its own has no numbers but those of its run.
std::vector<Cell> CellsOf(const TrialRecord& record);
// The record that has these cells. Null: a number of a trial that ended is NaN, anything else has
// its default. ConfigError for an unknown word.
TrialRecord RecordOf(const std::vector<Cell>& cells);

// A number of a trial by which trials are compared, tuned and grouped.
struct Metric {
  std::string name;  // of its column
  // Reads that column alone; nothing where it is null.
  std::function<std::optional<double>(const TrialRecord&)> of;
};
// time_s, then every metric.
const std::vector<Metric>& Metrics();

// Every field with its key in result.json, its column and its meaning, as a Markdown table.
std::string ResultKeyTable();

}  // namespace turbidock::trial
