#pragma once
// Results as text: one row a trial.

#include <string>
#include <vector>

#include "experiments/farm/result_store.h"

namespace turbidock::farm {

enum class ExportFormat { kCsv, kJsonl };
constexpr auto Names(ExportFormat) {
  using enum ExportFormat;
  return EnumList<ExportFormat>({{kCsv, "csv"}, {kJsonl, "jsonl"}});
}

// Columns: trial and seed, cell and sample, the verdict, every parameter, every figure, the reason;
// with `timing` also what differs from run to run. Equal results give equal text (without timing).
// What a trial does not have is empty, in JSON null.
std::string ExportText(const std::vector<StoredTrial>& trials, ExportFormat format, bool timing);

}  // namespace turbidock::farm
