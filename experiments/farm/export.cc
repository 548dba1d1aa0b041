#include "experiments/farm/export.h"

#include <charconv>
#include <nlohmann/json.hpp>

#include "experiments/farm/cell_json.h"

namespace turbidock::farm {
namespace {

using Json = nlohmann::ordered_json;

// A parameter as the number that it is, else as text.
Json ValueOf(const std::string& text) {
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, number);
  return result.ec == std::errc{} && result.ptr == end ? Json(number) : Json(text);
}

Json RowOf(const StoredTrial& trial, bool timing) {
  const std::vector<trial::Column>& columns = trial::Columns();
  const std::vector<trial::Cell> cells = trial::CellsOf(trial.record);
  Json row = {{"trial", trial.trial}};
  const auto add = [&](trial::Place place) {
    for (size_t i = 0; i < cells.size(); ++i)
      if (columns[i].place == place) row[columns[i].name] = JsonOf(cells[i]);
  };
  add(trial::Place::kKey);
  row["cell"] = trial.cell;
  row["sample"] = trial.sample;
  add(trial::Place::kVerdict);
  for (const Parameter& parameter : trial.parameters) row[parameter.key] = ValueOf(parameter.value);
  add(trial::Place::kFigure);
  add(trial::Place::kRemark);
  if (timing) add(trial::Place::kRun);
  return row;
}

// RFC 4180.
std::string CsvField(const Json& value) {
  if (value.is_null()) return "";
  if (value.is_number_float()) return FormatNumber(value.get<double>());
  if (!value.is_string()) return value.dump();
  const auto& text = value.get_ref<const std::string&>();
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

}  // namespace

std::string ExportText(const std::vector<StoredTrial>& trials, ExportFormat format, bool timing) {
  std::string text;
  for (const StoredTrial& trial : trials) {
    const Json row = RowOf(trial, timing);
    if (format == ExportFormat::kJsonl) {
      text += row.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
      continue;
    }
    std::string names, values;
    for (const auto& [name, value] : row.items()) {
      names += (names.empty() ? "" : ",") + CsvField(name);
      values += (values.empty() ? "" : ",") + CsvField(value);
    }
    if (text.empty()) text = names + "\n";
    text += values + "\n";
  }
  return text;
}

}  // namespace turbidock::farm
