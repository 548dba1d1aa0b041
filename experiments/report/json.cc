#include "experiments/report/json.h"

#include "sim/base/check.h"

namespace turbidock::report {
namespace {

constexpr int kDeepest = 64;  // levels, as of YAML; whoever goes through a document may recurse

}  // namespace

// A file's name may be of any bytes.
std::string JsonText(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string JsonLine(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json ParseJson(const std::string& text, const std::string& where) {
  try {
    return Json::parse(text, [&](int depth, Json::parse_event_t, Json&) {
      if (depth > kDeepest) throw ConfigError(where + ": is nested deeper than 64 levels");
      return true;
    });
  } catch (const Json::exception& error) {
    // without the library's name of the error in brackets
    const std::string why = error.what();
    throw ConfigError(where + ": is no JSON: " + why.substr(why.find("] ") + 2));
  }
}

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

void AddCsv(const Json& row, std::string* text) {
  std::string keys, values;
  for (const auto& [key, value] : row.items()) {
    keys += CsvField(key) + ",";
    values += CsvField(value) + ",";
  }
  keys.back() = values.back() = '\n';
  *text += text->empty() ? keys + values : values;
}

}  // namespace turbidock::report
