#pragma once
// One value of a row: of a trial's record (record_columns.h) or of a frame of its log (series.h).
// The pipe from a worker, SQL, CSV and JSON carry rows of them.

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>

#include "experiments/report/json.h"
#include "sim/base/fields.h"

namespace turbidock::trial {

// A bool, a number or a text; null for what did not happen and for a number that is not finite.
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

}  // namespace turbidock::trial
