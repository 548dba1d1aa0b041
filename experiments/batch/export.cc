#include "experiments/batch/export.h"

#include "experiments/batch/store_sql.h"

namespace turbidock::batch {
namespace {

report::Json ExportRow(const StoredTrial& trial, bool timing) {
  std::vector<std::string> keys;
  for (const Parameter& parameter : trial.parameters) keys.push_back(parameter.key);
  const std::map<std::string, trial::Cell> cells = RowOf(trial);
  report::Json row = {{"trial", trial.trial}};
  for (const TrialColumn& column : TrialColumns(keys))
    if (column.is_result || (timing && !column.is_log)) row[column.name] = cells.at(column.name);
  return row;
}

}  // namespace

std::string ExportText(const std::vector<StoredTrial>& trials, bool timing) {
  std::string text;
  for (const StoredTrial& trial : trials) report::AddCsv(ExportRow(trial, timing), &text);
  return text;
}

}  // namespace turbidock::batch
