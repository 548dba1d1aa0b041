#pragma once
// A trial's record as a row of named cells: what the pipe from a worker, a batch's file and its
// export have in common. All from TrialRecord::Fields.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "experiments/trial/trial_record.h"

namespace turbidock::trial {

// Nothing for what did not happen, and for a number that is not finite.
using Cell = std::variant<std::monostate, bool, int64_t, double, std::string>;

struct Column {
  std::string name;  // in snake_case, with its unit; unique
  Place place = Place::kFigure;
  const char* sql_type = "REAL";
};

// Every column, in the order of the fields; a group has one for each member, a map one for each
// value of its enum.
const std::vector<Column>& Columns();

// A cell for each column. A trial without an end of its own has no numbers but those of its run.
std::vector<Cell> CellsOf(const TrialRecord& record);
// The record that has these cells. Cells that are nothing: a number of a trial that ended is NaN,
// anything else has its default. ConfigError for an unknown word.
TrialRecord RecordOf(const std::vector<Cell>& cells);

// A number of a trial by which trials are compared, tuned and grouped.
struct Figure {
  std::string name;  // of its column
  std::function<std::optional<double>(const TrialRecord&)> of;
};
// time_s, then every figure.
const std::vector<Figure>& Figures();

// Every field with its key in result.json, its column and its meaning, as a Markdown table.
std::string ResultKeyTable();

}  // namespace turbidock::trial
