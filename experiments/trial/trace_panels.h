#pragma once
// How a trial went, as panels over time: the figure, the page and the film draw the same ones.

#include <vector>

#include "experiments/report/plot.h"
#include "experiments/trial/series.h"
#include "experiments/trial/trial_view.h"

namespace turbidock::trial {

// The panels in their order, from the top.
enum class Trace { kX, kY, kZ, kYaw, kFitness, kThrusters, kSpeed, kContact };

struct TraceOptions {
  // Curves begin with this row. Axes are those of all rows, so that a picture may grow.
  size_t first_row = 0;
  const ViewColors& colors = kOnPaper;
};

// The marker's position in the camera head (mm) and its yaw (°): truth, estimate, desired value and
// what the stage allows about it; F with its limits; voltages, speeds (mm/s) and contact forces
// (N). Behind them are the stages; their names are those of the first panel's blocks. An estimate
// stands at its image's time, and apart from the others where nothing is detected: nothing acts on
// it.
std::vector<report::Panel> TracePanels(const Series& series, const ViewCriteria& criteria,
                                       const TraceOptions& options = {});

}  // namespace turbidock::trial
