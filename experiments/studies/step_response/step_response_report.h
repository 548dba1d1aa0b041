#pragma once
// Step responses as a report.

#include <vector>

#include "experiments/report/report.h"
#include "experiments/studies/step_response/step_response.h"
#include "experiments/trial/scenario.h"

namespace turbidock::step_response {

// A row an axis in mm and degrees; of each axis the answers to step and force, and the loop's gain
// and phase.
report::Report ReportOf(const trial::Scenario& scenario,
                        const std::vector<AxisResponse>& responses);

}  // namespace turbidock::step_response
