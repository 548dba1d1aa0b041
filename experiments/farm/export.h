#pragma once
// Results as text: one row a trial.

#include <string>
#include <vector>

#include "experiments/farm/result_store.h"

namespace turbidock::farm {

struct ExportOptions {
  bool jsonl = false;   // a JSON object a line in place of CSV
  bool timing = false;  // also what differs from run to run
};

// Columns: trial and seed, cell and sample, the verdict, every parameter, every figure, the reason.
// Equal results give equal text (without timing).
// What a trial does not have is empty, in JSON null.
std::string ExportText(const std::vector<StoredTrial>& trials, const ExportOptions& options);

}  // namespace turbidock::farm
