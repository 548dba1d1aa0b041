#pragma once
// A report as JSON: what `--json` prints, what `turbidock report` reads and what a page draws.

#include <string>

#include "experiments/report/json.h"
#include "experiments/report/report.h"

namespace turbidock::report {

// {"kind", "schema_version", the keys of `result`, "report": {...}}. `result` is an object: the
// study's numbers under names of its own, for programs.
Json Document(const Report& report, const Json& result);

// A series of a panel, in columns; a cell and a table of a report.
void to_json(Json& json, const Series& series);
void to_json(Json& json, const Cell& cell);
void to_json(Json& json, const Table& table);

// The "report" of a document, checked as far as a page relies on it. ConfigError "WHERE: ..." for
// JSON that is no document, or is one of a newer schema.
Json ReportIn(const Json& document, const std::string& where);

}  // namespace turbidock::report
