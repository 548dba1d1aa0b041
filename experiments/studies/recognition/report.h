#pragma once
// The recognition experiment's results as text for people and as files. `table` is empty or belongs
// to the results row by row.

#include <optional>
#include <string>
#include <vector>

#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/table.h"

namespace turbidock::recognition {

// A table of F by milk and distance for each marker, and how it compares.
std::string RecognitionText(const std::vector<CellResult>& results,
                            const std::vector<TableRow>& table,
                            const std::optional<TableComparison>& comparison);

// One document; keys as in the program's documentation.
std::string RecognitionJson(const std::vector<CellResult>& results,
                            const std::vector<TableRow>& table,
                            const std::optional<TableComparison>& comparison);

// One row a cell, in the columns of the published tables and more.
std::string RecognitionCsv(const std::vector<CellResult>& results,
                           const std::vector<TableRow>& table);

}  // namespace turbidock::recognition
