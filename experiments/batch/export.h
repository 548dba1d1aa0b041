#pragma once
// Results as text: one row a trial.

#include <string>
#include <vector>

#include "experiments/batch/result_store.h"

namespace turbidock::batch {

// CSV with the columns of the view `results`: trial and seed, cell and sample, the verdict, every
// parameter, every figure, the reason; with `timing` also what differs from run to run. Equal
// results give equal text without it. What a trial does not have is empty.
std::string ExportText(const std::vector<StoredTrial>& trials, bool timing = false);

}  // namespace turbidock::batch
