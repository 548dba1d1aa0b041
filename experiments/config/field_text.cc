#include "experiments/config/field_text.h"

#include <fmt/format.h>
#include <yaml-cpp/emitter.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

namespace turbidock::config::internal {
namespace {

// "V s/m" from "kd_v_s_per_m": the longest tail of unit words. Empty where a key names no unit.
std::string UnitOf(std::string key) {
  static const std::map<std::string, const char*> kUnits = {
      {"m", "m"},   {"m2", "m2"},   {"m3", "m3"},       {"s", "s"},       {"s2", "s2"},
      {"ms", "ms"}, {"rad", "rad"}, {"deg", "deg"},     {"mm", "mm"},     {"kg", "kg"},
      {"v", "V"},   {"hz", "Hz"},   {"newton", "N"},    {"mps", "m/s"},   {"mps2", "m/s2"},
      {"px", "px"}, {"ml", "ml"},   {"radps", "rad/s"}, {"percent", "%"},
  };
  std::string above, below;
  // from the last word; the first is the quantity's name, whatever it is
  for (size_t cut = 0; (cut = key.rfind('_')) != std::string::npos; key.resize(cut)) {
    const std::string word = key.substr(cut + 1);
    if (word == "per") {
      below = std::exchange(above, "");
      continue;
    }
    const auto unit = kUnits.find(word);
    if (unit == kUnits.end()) break;
    if (!above.empty()) above.insert(0, " ");
    above.insert(0, unit->second);
  }
  if (above == "ml m3") return "ml/m3";
  if (below.empty()) return above;
  return (above.empty() ? "1" : above) + "/" +
         (below.find(' ') == std::string::npos ? below : "(" + below + ")");
}

// The first row of a matrix.
std::optional<ListRef> RowOf(const ListRef& list) {
  const Field first = list.element(0);
  const auto* row = std::get_if<ListRef>(&first.value);
  return row ? std::optional(*row) : std::nullopt;
}

// Words that YAML or people read as something else than text.
bool IsReserved(std::string word) {
  std::transform(word.begin(), word.end(), word.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* reserved : {"null", "true", "false", "yes", "no", "on", "off", "y", "n"})
    if (word == reserved) return true;
  return false;
}

std::string TextAsYaml(const std::string& text) {
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) || c == '_' || c == '.' || c == '/' || c == '-';
  };
  if (!text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) && !IsReserved(text) &&
      std::all_of(text.begin(), text.end(), is_plain))
    return text;
  YAML::Emitter quoted;
  quoted << YAML::DoubleQuoted << text;
  return quoted.c_str();
}

}  // namespace

std::string Commas(const std::vector<std::string>& parts) {
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string InUnit(const std::string& key) {
  const std::string unit = UnitOf(key);
  return unit.empty() ? "" : " in " + unit;
}

std::string TypeName(const Field& field) {
  const std::string in_unit = InUnit(field.key);
  return std::visit(Overloaded{
                        [](bool*) -> std::string { return "true or false"; },
                        [&](int*) { return "whole number" + in_unit; },
                        [&](int64_t*) { return "whole number" + in_unit; },
                        [&](double*) { return "number" + in_unit; },
                        [](std::string*) -> std::string { return "text"; },
                        [](const EnumRef& e) { return "one of " + Commas(e.names); },
                        [](const GroupRef&) -> std::string { return "group of keys"; },
                        [&](const ListRef& list) -> std::string {
                          if (list.of_groups) return "list of groups";
                          if (list.resize) return "list of numbers" + in_unit;
                          if (const auto row = RowOf(list))
                            return fmt::format("list of {} rows of {} numbers{}", list.size(),
                                               row->size(), in_unit);
                          return fmt::format("list of {} numbers{}", list.size(), in_unit);
                        },
                    },
                    field.value);
}

std::string WithArticle(const std::string& type) {
  const bool bare = type.starts_with("true") || type == "text" || type.starts_with("one of");
  return bare ? type : "a " + type;
}

std::optional<std::string> ValueAsYaml(const Field& field) {
  using Text = std::optional<std::string>;
  return std::visit(
      Overloaded{
          [](const bool* value) -> Text { return *value ? "true" : "false"; },
          [](const int* value) -> Text { return std::to_string(*value); },
          [](const int64_t* value) -> Text { return std::to_string(*value); },
          [](const double* value) -> Text { return FormatNumber(*value); },
          [](const std::string* value) -> Text { return TextAsYaml(*value); },
          [](const EnumRef& value) -> Text { return TextAsYaml(value.names[value.get()]); },
          [](const GroupRef& group) -> Text {
            if (group.fields.empty()) return "{}";
            return std::nullopt;
          },
          [](const ListRef& list) -> Text {
            if (list.of_groups && list.size() > 0) return std::nullopt;
            std::vector<std::string> parts;
            for (size_t i = 0; i < list.size(); ++i) parts.push_back(*ValueAsYaml(list.element(i)));
            return "[" + Commas(parts) + "]";
          },
      },
      field.value);
}

namespace {

// The fields as lines, without indentation of their own.
std::vector<std::string> GroupLines(const GroupRef& group) {
  std::vector<std::string> lines;
  for (const auto& field : group.fields) {
    const std::string comment = field.doc.empty() ? "" : "  # " + field.doc;
    if (const auto value = ValueAsYaml(field)) {
      lines.push_back(field.key + ": " + *value + comment);
      continue;
    }
    lines.push_back(field.key + ":" + comment);
    if (const auto* inner = std::get_if<GroupRef>(&field.value)) {
      for (const auto& line : GroupLines(*inner)) lines.push_back("  " + line);
      continue;
    }
    const auto& list = std::get<ListRef>(field.value);
    for (size_t i = 0; i < list.size(); ++i) {
      std::vector<std::string> element = GroupLines(std::get<GroupRef>(list.element(i).value));
      if (element.empty()) element.push_back("{}");
      for (size_t k = 0; k < element.size(); ++k)
        lines.push_back((k == 0 ? "  - " : "    ") + element[k]);
    }
  }
  return lines;
}

void AppendKeys(const GroupRef& group, const std::string& path, std::vector<KeyDoc>* docs) {
  for (const auto& field : group.fields) {
    KeyDoc doc{JoinKey(path, field.key), TypeName(field), ValueAsYaml(field).value_or(""), "",
               field.doc};
    if (std::isfinite(field.range.low) || std::isfinite(field.range.high))
      doc.range = field.range.Sentence().substr(std::strlen("must be "));
    docs->push_back(doc);
    if (const auto* inner = std::get_if<GroupRef>(&field.value)) AppendKeys(*inner, doc.key, docs);
    if (const auto* list = std::get_if<ListRef>(&field.value); list && list->of_groups) {
      list->resize(0);
      list->resize(1);
      AppendKeys(std::get<GroupRef>(list->element(0).value), doc.key + "[]", docs);
    }
  }
}

}  // namespace

std::string SaveGroup(const GroupRef& group) {
  const std::vector<std::string> lines = GroupLines(group);
  return lines.empty() ? "{}\n" : fmt::format("{}", fmt::join(lines, "\n")) + "\n";
}

std::vector<KeyDoc> ListGroupKeys(const GroupRef& group) {
  std::vector<KeyDoc> docs;
  AppendKeys(group, "", &docs);
  return docs;
}

}  // namespace turbidock::config::internal
