#pragma once
// What came of a trial, as a report.

#include <optional>
#include <string>
#include <vector>

#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/series.h"
#include "experiments/trial/trial_view.h"

namespace turbidock::trial {

// `record` is a result as result.json has it (`list result-keys`), `series` its log, which may lack
// rows. A stage's time links to "t=TIME_S".
report::Report ReportOf(const Scenario& scenario, const report::Json& record, const Series& series);

// Its sections that show a log: where it was, what was seen, and panels over time, whose curves
// begin with a row (trace_panels.h).
std::vector<report::Section> TraceSections(const Series& series, const ViewCriteria& criteria,
                                           size_t first_row = 0);

// How far cameras can see, in m: where green light has left 2 % of a contrast; nothing without
// cameras.
std::optional<double> Sight_m(const Scenario& scenario);

// "night sea, active marker, seed 1".
std::string TitleOf(const Scenario& scenario);

}  // namespace turbidock::trial
