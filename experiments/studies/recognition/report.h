#pragma once
// The recognition experiment's results as a report (experiments/report/report.h) and for programs.
// `table` is empty or belongs to the results row by row.

#include <string>
#include <vector>

#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/table.h"

namespace turbidock::recognition {

// Kind "recognition", after the published figures: F over milk, Areas, F over time, and F by milk
// and distance; beside it the table or, without one, the published tables.
report::Report ReportOf(const std::vector<CellResult>& results, const std::vector<TableRow>& table,
                        double frames_per_second);

// The study's own keys: README.md.
report::Json ResultJson(const std::vector<CellResult>& results, const std::vector<TableRow>& table);

// One row a cell, in the columns of the published tables and more.
std::string RecognitionCsv(const std::vector<CellResult>& results,
                           const std::vector<TableRow>& table);

// Mean F over milk, a panel for each marker with a curve and its deviation for each distance; the
// rows of `reference` at these distances as rings named `reference_name`.
std::vector<report::Panel> FitnessPanels(const std::vector<CellResult>& results,
                                         const std::vector<TableRow>& reference,
                                         const std::string& reference_name);

}  // namespace turbidock::recognition
