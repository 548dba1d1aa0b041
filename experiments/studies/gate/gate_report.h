#pragma once
// A gate's verdict for people and for CI.

#include <cstdint>
#include <string>

#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/studies/gate/gate.h"

namespace turbidock::gate {

// Of kind "gate". Seeds that no longer dock are links to BundleName.
report::Report ReportOf(const GateReport& report);

// How many trials a gate takes and what it can tell, before any has run: of kind "gate_plan_size",
// and as JSON.
report::Report SizeReport(const GatePlan& plan);
report::Json SizesOf(const GatePlan& plan);

// junit.xml: a test suite a condition, whose properties are rate, interval, trials and seeds, with
// one test case. A condition that fails is a failure, one that is inconclusive an error.
std::string Junit(const GateReport& report);

// The folder in failures/ of a trial that is run again.
std::string BundleName(const std::string& condition, int64_t seed);

// A measure's value in its unit (MeasureReport::unit) for people: "12.3 s", 0.0045 m as "4.5 mm",
// 0.95 as "95.0 %" where the unit is empty.
std::string ShownValue(double value, const std::string& unit);

}  // namespace turbidock::gate
