#pragma once
// Cells of a trial's row as JSON values, and back.

#include <nlohmann/json.hpp>

#include "experiments/trial/record_columns.h"

namespace turbidock::farm {

inline nlohmann::ordered_json JsonOf(const trial::Cell& cell) {
  return std::visit(
      [](const auto& value) -> nlohmann::ordered_json {
        if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, std::monostate>)
          return nullptr;
        else
          return value;
      },
      cell);
}

inline trial::Cell CellOf(const nlohmann::ordered_json& json) {
  if (json.is_boolean()) return json.get<bool>();
  if (json.is_number_float()) return json.get<double>();
  if (json.is_number()) return json.get<int64_t>();
  if (json.is_string()) return json.get<std::string>();
  return {};
}

}  // namespace turbidock::farm
