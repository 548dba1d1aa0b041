#pragma once
// A gate's verdict as a figure for papers.

#include "experiments/report/plot.h"
#include "experiments/studies/gate/gate.h"

namespace turbidock::gate {

// For each condition the way of the success rate's test to its decision, between the borders at
// which it fails and passes; last the success rates of baseline and build with 95 % intervals.
report::Figure GateFigure(const GateReport& report);

}  // namespace turbidock::gate
