#pragma once
// What a study's command prints.

#include "experiments/report/json.h"
#include "experiments/report/report.h"

namespace turbidock::app {

// On stdout: for people the report, with `json` the document of it and of the study's `result`
// (report/report_json.h).
void PrintReport(const report::Report& report, const report::Json& result, bool json);

}  // namespace turbidock::app
