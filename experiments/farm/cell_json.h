#pragma once
// Cells of a trial's row as JSON values, and back.

#include "experiments/report/json.h"
#include "experiments/trial/record_columns.h"

template <>
struct nlohmann::adl_serializer<turbidock::trial::Cell> {
  static void to_json(ordered_json& json, const turbidock::trial::Cell& cell) {
    std::visit(
        [&json]<class V>(const V& value) {
          if constexpr (!std::is_same_v<V, std::monostate>) json = value;
        },
        cell);
  }
  static void from_json(const ordered_json& json, turbidock::trial::Cell& cell) {
    cell = {};
    if (json.is_boolean()) cell = json.get<bool>();
    if (json.is_number_integer()) cell = json.get<int64_t>();
    if (json.is_number_float()) cell = json.get<double>();
    if (json.is_string()) cell = json.get<std::string>();
  }
};
