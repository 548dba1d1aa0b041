#pragma once
// A gate's report for people and machines.

#include <string>

#include "experiments/studies/gate/gate.h"

namespace turbidock::gate {

// A table for the terminal, without a final newline.
std::string GateTable(const GateReport& report);

// summary.json: everything, SI units, every trial that the verdict rests on.
std::string GateJson(const GateReport& report);

// junit.xml: a test suite a condition, whose properties are rate, interval, trials and seeds, with
// one test case. A condition that fails is a failure, one that is inconclusive an error.
std::string GateJunit(const GateReport& report);

// summary.md, to be posted at a pull request.
std::string GateMarkdown(const GateReport& report);

// A measure's value in its unit (MeasureReport::unit) for people: "12.3 s", 0.0045 m as "4.5 mm",
// 0.95 as "95.0 %" where the unit is empty.
std::string ShownValue(double value, const std::string& unit);

// What was found of one measure, as a sentence: "success rate 95.0 % -> 80.0 %: 6 pairs lost, 0
// gained; worse, known after 31 trials".
std::string DescribeMeasure(const MeasureReport& measure, bool paired);

}  // namespace turbidock::gate
