#include "experiments/farm/export.h"

#include "experiments/trial/record_columns.h"

namespace turbidock::farm {
namespace {

using report::Json;

Json RowOf(const StoredTrial& trial, bool timing) {
  const std::vector<trial::Column>& columns = trial::Columns();
  const std::vector<trial::Cell> cells = trial::CellsOf(trial.record);
  Json row = {{"trial", trial.trial}};
  const auto add = [&](trial::Place place) {
    for (size_t i = 0; i < cells.size(); ++i)
      if (columns[i].place == place) row[columns[i].name] = cells[i];
  };
  add(trial::Place::kKey);
  row["cell"] = trial.cell;
  row["sample"] = trial.sample;
  add(trial::Place::kVerdict);
  for (const Parameter& parameter : trial.parameters) row[parameter.key] = ValueOf(parameter);
  add(trial::Place::kMetric);
  add(trial::Place::kRemark);
  if (timing) add(trial::Place::kRun);
  return row;
}

}  // namespace

std::string ExportText(const std::vector<StoredTrial>& trials, const ExportOptions& options) {
  std::string text;
  for (const StoredTrial& trial : trials) {
    const Json row = RowOf(trial, options.timing);
    if (options.jsonl)
      text += report::JsonLine(row) + "\n";
    else
      report::AddCsv(row, &text);
  }
  return text;
}

}  // namespace turbidock::farm
