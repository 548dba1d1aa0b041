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

// Kind "recognition", after the published figures: how far and how turbid it may be, F over milk,
// Areas, and F by milk and distance; beside it the table or, without one, the published tables.
report::Report ReportOf(const std::vector<CellResult>& results, const std::vector<TableRow>& table);

// The study's own keys: README.md.
report::Json ResultJson(const std::vector<CellResult>& results, const std::vector<TableRow>& table);

// What the cameras see, after the published Figs. 11 and 13: left and right images of a cell's last
// frame with the estimated marker, distance down, five steps of milk across at most, as a PNG. The
// marker's results only. Contrast is stretched, of all images alike. ConfigError when the path
// cannot be written.
void WriteImageSheet(const std::string& path, const trial::Scenario& scenario, MarkerKind marker,
                     const std::vector<CellResult>& results);

}  // namespace turbidock::recognition
