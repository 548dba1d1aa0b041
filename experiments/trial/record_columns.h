#pragma once
// A trial's record as a row of named cells: what the pipe from a worker and a batch's
// file have in common. All from TrialRecord::Fields.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "experiments/trial/cell.h"
#include "experiments/trial/trial_record.h"

namespace turbidock::trial {

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
