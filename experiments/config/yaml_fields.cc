#include "experiments/config/yaml_fields.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <sstream>
#include <utility>

#include "experiments/config/nearest_name.h"
#include "sim/base/check.h"

namespace turbidock::config {
namespace {

const char* const kFromSet = "--set";

template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;

// ---------------------------------------------------------------------------------- text and units

std::string Join(const std::vector<std::string>& parts, const char* separator) {
  std::string text;
  for (size_t i = 0; i < parts.size(); ++i) {
    if (i > 0) text += separator;
    text += parts[i];
  }
  return text;
}

std::string ElementPath(const std::string& path, size_t index) {
  return path + "[" + std::to_string(index) + "]";
}

// "V s/m" from "kd_v_s_per_m": the longest tail of unit words. Empty where a key names no unit.
std::string UnitOf(const std::string& key) {
  static constexpr std::pair<std::string_view, const char*> kUnits[] = {
      {"m", "m"},   {"m2", "m2"},   {"m3", "m3"},       {"s", "s"},       {"s2", "s2"},
      {"ms", "ms"}, {"rad", "rad"}, {"deg", "deg"},     {"mm", "mm"},     {"kg", "kg"},
      {"v", "V"},   {"hz", "Hz"},   {"newton", "N"},    {"mps", "m/s"},   {"mps2", "m/s2"},
      {"px", "px"}, {"ml", "ml"},   {"radps", "rad/s"}, {"percent", "%"},
  };
  std::vector<std::string_view> words;
  for (size_t begin = 0; begin <= key.size();) {
    const size_t end = std::min(key.find('_', begin), key.size());
    words.emplace_back(key.data() + begin, end - begin);
    begin = end + 1;
  }
  auto unit_of = [](std::string_view word) -> const char* {
    for (const auto& [name, unit] : kUnits)
      if (name == word) return unit;
    return nullptr;
  };
  // the first word is the quantity's name, whatever it is
  size_t first = words.size();
  while (first > 1 && (unit_of(words[first - 1]) || words[first - 1] == "per")) --first;
  if (first < words.size() - 1 && words[first] == "ml" && words[first + 1] == "m3") return "ml/m3";

  std::string above, below;
  bool per = false;
  for (size_t i = first; i < words.size(); ++i) {
    if (words[i] == "per") {
      per = true;
      continue;
    }
    std::string& side = per ? below : above;
    if (!side.empty()) side += " ";
    side += unit_of(words[i]);
  }
  if (below.empty()) return above;
  return (above.empty() ? "1" : above) + "/" +
         (below.find(' ') == std::string::npos ? below : "(" + below + ")");
}

std::string InUnit(const std::string& key) {
  const std::string unit = UnitOf(key);
  return unit.empty() ? "" : " in " + unit;
}

bool IsMatrix(const NumbersRef& numbers) { return numbers.rows > 1 && numbers.cols > 1; }

// Element k of a plain list.
double* ElementOf(const NumbersRef& numbers, int k) {
  return numbers.data + k * (numbers.rows == 1 ? numbers.col_stride : numbers.row_stride);
}

NumbersRef RowOf(const NumbersRef& matrix, int row) {
  return {matrix.data + row * matrix.row_stride, 1, matrix.cols, 0, matrix.col_stride};
}

// What a value of the field is: "number in m", "one of active, passive".
std::string TypeName(const Field& field) {
  const std::string in_unit = InUnit(field.key);
  return std::visit(Overloaded{
                        [](bool*) -> std::string { return "true or false"; },
                        [&](int*) { return "whole number" + in_unit; },
                        [&](int64_t*) { return "whole number" + in_unit; },
                        [&](double*) { return "number" + in_unit; },
                        [](std::string*) -> std::string { return "text"; },
                        [&](std::vector<double>*) { return "list of numbers" + in_unit; },
                        [&](const NumbersRef& n) {
                          if (!IsMatrix(n))
                            return "list of " + std::to_string(n.rows * n.cols) + " numbers" +
                                   in_unit;
                          return "list of " + std::to_string(n.rows) + " rows of " +
                                 std::to_string(n.cols) + " numbers" + in_unit;
                        },
                        [](const EnumRef& e) { return "one of " + Join(e.names, ", "); },
                        [](const GroupRef&) -> std::string { return "group of keys"; },
                        [](const ListRef&) -> std::string { return "list of groups"; },
                    },
                    field.value);
}

std::string WithArticle(const std::string& type) {
  const bool bare = type.starts_with("true") || type == "text" || type.starts_with("one of");
  return bare ? type : "a " + type;
}

// ---------------------------------------------------------------------------------------- messages

[[noreturn]] void FailKey(const YamlNode& at, const std::string& problem) {
  throw ConfigError(at.Where() + (at.path.empty() ? "" : at.path + ": ") + problem);
}

// The value as the user wrote it: quoted if it is text.
std::string Written(const YamlNode& at, const char* quote) {
  switch (at.node.Type()) {
    case YAML::NodeType::Sequence:
      return "a list";
    case YAML::NodeType::Map:
      return "a group of keys";
    case YAML::NodeType::Scalar: {
      constexpr size_t kLongest = 60;
      const std::string& text = at.node.Scalar();
      const std::string shown = text.size() > kLongest ? text.substr(0, kLongest) + "..." : text;
      return quote + shown + quote;
    }
    default:
      return "";
  }
}

[[noreturn]] void FailValue(const YamlNode& at, const std::string& problem,
                            const char* quote = "'") {
  const std::string written = Written(at, quote);
  if (written.empty()) FailKey(at, "has no value, " + problem);
  throw ConfigError(at.Where() + at.path + " = " + written + ", " + problem);
}

[[noreturn]] void FailType(const YamlNode& at, const Field& field) {
  FailValue(at, "must be " + WithArticle(TypeName(field)));
}

// Dotted paths of the fields called `key` anywhere in the group.
void FindByName(const GroupRef& group, const std::string& path, const std::string& key,
                std::vector<std::string>* found) {
  for (const auto& field : group.fields) {
    const std::string full = Dotted(path, field.key);
    if (field.key == key || full == key) found->push_back(full);
    if (const auto* inner = std::get_if<GroupRef>(&field.value))
      FindByName(*inner, full, key, found);
  }
}

[[noreturn]] void FailUnknown(const YamlNode& at, const std::string& key, const GroupRef& group,
                              const GroupRef& root, const std::string& root_path) {
  std::vector<std::string> known;
  for (const auto& field : group.fields) known.push_back(field.key);
  if (const std::string nearest = NearestName(key, known); !nearest.empty())
    FailKey(at, "unknown key; did you mean " + nearest + "?");
  std::vector<std::string> elsewhere;
  FindByName(root, root_path, key, &elsewhere);
  if (elsewhere.size() == 1) {
    const bool is_path = elsewhere[0] == key;
    FailKey(at, is_path ? "unknown key; a file nests its keys, one level a line"
                        : "unknown key; did you mean " + elsewhere[0] + "?");
  }
  FailKey(at, "unknown key; allowed: " + Join(known, ", "));
}

// ----------------------------------------------------------------------------------------- reading

class Reader {
 public:
  Reader(const GroupRef& root, std::string root_path, Origins* origins)
      : root_(root), root_path_(std::move(root_path)), origins_(origins) {}

  void ReadGroup(const YamlNode& at, const GroupRef& group,
                 std::initializer_list<std::string_view> read_elsewhere = {}) const;
  void ReadValue(const YamlNode& at, const Field& field) const;
  // Notes where the value was set, and that what was below it is gone.
  void NoteOrigin(const YamlNode& at) const;

 private:
  void ReadBool(const YamlNode& at, const Field& field, bool* value) const;
  template <class Int>
  void ReadInt(const YamlNode& at, const Field& field, Int* value) const;
  void ReadDouble(const YamlNode& at, const Field& field, double* value) const;
  void ReadText(const YamlNode& at, const Field& field, std::string* value) const;
  void ReadEnum(const YamlNode& at, const Field& field, const EnumRef& value) const;
  void ReadNumbers(const YamlNode& at, const Field& field, const NumbersRef& numbers) const;
  void ReadList(const YamlNode& at, const Field& field, const ListRef& list) const;

  const GroupRef& root_;
  std::string root_path_;
  Origins* origins_;
};

int LineOf(const YAML::Node& node, int fallback) {
  const YAML::Mark mark = node.Mark();
  return mark.is_null() ? fallback : mark.line + 1;
}

YamlNode ElementNode(const YamlNode& at, size_t index) {
  const YAML::Node node = at.node[index];
  return {node, at.file, ElementPath(at.path, index), LineOf(node, at.line)};
}

void Reader::ReadGroup(const YamlNode& at, const GroupRef& group,
                       std::initializer_list<std::string_view> read_elsewhere) const {
  std::map<std::string, int> first_line;
  for (const auto& entry : at.node) {
    YamlNode child{entry.second, at.file, at.path, LineOf(entry.first, at.line)};
    if (!entry.first.IsScalar()) FailKey(child, "a key must be plain text");
    const std::string& key = entry.first.Scalar();
    child.path = Dotted(at.path, key);

    const auto [first, is_new] = first_line.emplace(key, child.line);
    if (!is_new) {
      const std::string where =
          at.file == kFromSet ? "" : ", first given in line " + std::to_string(first->second);
      FailKey(child, "duplicate key" + where);
    }
    if (std::find(read_elsewhere.begin(), read_elsewhere.end(), key) != read_elsewhere.end())
      continue;
    const auto field = std::find_if(group.fields.begin(), group.fields.end(),
                                    [&](const Field& f) { return f.key == key; });
    if (field == group.fields.end()) FailUnknown(child, key, group, root_, root_path_);
    ReadValue(child, *field);
  }
}

void Reader::NoteOrigin(const YamlNode& at) const {
  if (!origins_) return;
  (*origins_)[at.path] = at.Where();
}

void Reader::ReadValue(const YamlNode& at, const Field& field) const {
  NoteOrigin(at);
  std::visit(Overloaded{
                 [&](bool* value) { ReadBool(at, field, value); },
                 [&](int* value) { ReadInt(at, field, value); },
                 [&](int64_t* value) { ReadInt(at, field, value); },
                 [&](double* value) { ReadDouble(at, field, value); },
                 [&](std::string* value) { ReadText(at, field, value); },
                 [&](std::vector<double>* values) {
                   if (!at.node.IsSequence()) FailType(at, field);
                   std::vector<double> read(at.node.size());
                   for (size_t i = 0; i < read.size(); ++i)
                     ReadDouble(ElementNode(at, i), field, &read[i]);
                   *values = std::move(read);
                 },
                 [&](const NumbersRef& numbers) { ReadNumbers(at, field, numbers); },
                 [&](const EnumRef& value) { ReadEnum(at, field, value); },
                 [&](const GroupRef& group) {
                   if (!at.node.IsMap()) FailType(at, field);
                   ReadGroup(at, group);
                 },
                 [&](const ListRef& list) { ReadList(at, field, list); },
             },
             field.value);
}

void Reader::ReadBool(const YamlNode& at, const Field& field, bool* value) const {
  const bool plain = at.node.IsScalar() && at.node.Tag() == "?";
  const bool is_true = plain && at.node.Scalar() == "true";
  if (!is_true && !(plain && at.node.Scalar() == "false")) FailType(at, field);
  *value = is_true;
}

// The number of the longest beginning of `text` that is one, and what follows it.
struct Parsed {
  double value = 0;
  std::errc error{};
  std::string_view rest;
};

Parsed ParseDouble(std::string_view text) {
  std::string_view digits = text;
  const bool negative = digits.starts_with('-');
  if (digits.starts_with('+') || negative) digits.remove_prefix(1);
  // YAML's own spellings of what the ranges refuse
  Parsed parsed;
  for (const std::string_view name : {".inf", ".Inf", ".INF"})
    if (digits == name) parsed.value = std::numeric_limits<double>::infinity();
  for (const std::string_view name : {".nan", ".NaN", ".NAN"})
    if (digits == name) parsed.value = std::numeric_limits<double>::quiet_NaN();
  if (parsed.value != 0) {
    if (negative) parsed.value = -parsed.value;
    return parsed;
  }

  const bool begins_like_number =
      !digits.empty() && (std::isdigit(static_cast<unsigned char>(digits[0])) || digits[0] == '.');
  if (!begins_like_number) return {0, std::errc::invalid_argument, text};
  const char* const end = digits.data() + digits.size();
  const auto result = std::from_chars(digits.data(), end, parsed.value);
  if (negative) parsed.value = -parsed.value;
  parsed.error = result.ec;
  parsed.rest = {result.ptr, static_cast<size_t>(end - result.ptr)};
  return parsed;
}

void Reader::ReadDouble(const YamlNode& at, const Field& field, double* value) const {
  const std::string number = "number" + InUnit(field.key);
  if (!at.node.IsScalar()) FailValue(at, "must be a " + number);
  if (at.node.Tag() != "?") FailValue(at, "must be a " + number + ", without quotes or tag");
  const Parsed parsed = ParseDouble(at.node.Scalar());
  if (parsed.error == std::errc::result_out_of_range)
    FailValue(at, "is too large or too small a number", "");
  if (parsed.error != std::errc{}) FailValue(at, "must be a " + number);
  if (!parsed.rest.empty()) FailValue(at, "give a plain " + number);
  if (!field.range.Contains(parsed.value)) FailValue(at, field.range.Sentence(), "");
  *value = parsed.value;
}

template <class Int>
void Reader::ReadInt(const YamlNode& at, const Field& field, Int* value) const {
  const std::string number = "whole number" + InUnit(field.key);
  if (!at.node.IsScalar()) FailValue(at, "must be a " + number);
  if (at.node.Tag() != "?") FailValue(at, "must be a " + number + ", without quotes or tag");
  const std::string& text = at.node.Scalar();
  const char* const begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const char* const end = text.data() + text.size();
  Int parsed = 0;
  const auto result = std::from_chars(begin, end, parsed);
  if (result.ec == std::errc::result_out_of_range && result.ptr == end)
    FailValue(at,
              "must be in [" + std::to_string(std::numeric_limits<Int>::min()) + ", " +
                  std::to_string(std::numeric_limits<Int>::max()) + "]",
              "");
  if (result.ec != std::errc{} || result.ptr != end) {
    const Parsed as_double = ParseDouble(text);
    const bool is_number = as_double.error == std::errc{} && as_double.rest.empty();
    if (is_number) FailValue(at, "must be a " + number, "");
    FailValue(at, (as_double.error == std::errc{} ? "give a plain " : "must be a ") + number);
  }
  if (!field.range.Contains(static_cast<double>(parsed))) FailValue(at, field.range.Sentence(), "");
  *value = parsed;
}

void Reader::ReadText(const YamlNode& at, const Field& field, std::string* value) const {
  if (!at.node.IsScalar()) FailType(at, field);
  *value = at.node.Scalar();
}

void Reader::ReadEnum(const YamlNode& at, const Field& field, const EnumRef& value) const {
  if (!at.node.IsScalar()) FailType(at, field);
  const auto& name = at.node.Scalar();
  const auto found = std::find(value.names.begin(), value.names.end(), name);
  if (found == value.names.end()) FailType(at, field);
  value.set(static_cast<size_t>(found - value.names.begin()));
}

void Reader::ReadNumbers(const YamlNode& at, const Field& field, const NumbersRef& numbers) const {
  auto require_size = [&](const YamlNode& list, int size, const std::string& type) {
    if (!list.node.IsSequence()) FailValue(list, "must be " + WithArticle(type));
    if (static_cast<int>(list.node.size()) != size)
      throw ConfigError(list.Where() + list.path + " has " + std::to_string(list.node.size()) +
                        (list.node.size() == 1 ? " element" : " elements") + ", must be " +
                        WithArticle(type));
  };
  if (IsMatrix(numbers)) {
    require_size(at, numbers.rows, TypeName(field));
    for (int row = 0; row < numbers.rows; ++row)
      ReadNumbers(ElementNode(at, row), field, RowOf(numbers, row));
    return;
  }
  const int count = numbers.rows * numbers.cols;
  require_size(at, count, "list of " + std::to_string(count) + " numbers" + InUnit(field.key));
  for (int k = 0; k < count; ++k) ReadDouble(ElementNode(at, k), field, ElementOf(numbers, k));
}

void Reader::ReadList(const YamlNode& at, const Field& field, const ListRef& list) const {
  if (!at.node.IsSequence()) FailType(at, field);
  if (origins_)
    std::erase_if(*origins_,
                  [&](const auto& entry) { return entry.first.starts_with(at.path + "["); });
  list.resize(0);  // elements begin with their own defaults, not with those of the list
  list.resize(at.node.size());
  for (size_t i = 0; i < at.node.size(); ++i) {
    const YamlNode element = ElementNode(at, i);
    if (!element.node.IsMap()) FailValue(element, "must be a group of keys");
    NoteOrigin(element);
    ReadGroup(element, list.element(i));
  }
}

// ------------------------------------------------------------------------------------- --set paths

// "a.b[0].c" or "a.b.0.c" -> a, b, 0, c. Nothing if it is no path.
std::optional<std::vector<std::string>> SplitPath(const std::string& path) {
  std::vector<std::string> words(1);
  bool closed = false;  // after "]": only "." or "[" may follow
  for (size_t i = 0; i < path.size(); ++i) {
    const char c = path[i];
    if (c == '.' || c == '[') {
      if (words.back().empty()) return std::nullopt;
      words.emplace_back();
      closed = false;
      if (c == '.') continue;
      const size_t end = path.find(']', i);
      if (end == std::string::npos) return std::nullopt;
      words.back() = path.substr(i + 1, end - i - 1);
      const bool digits = !words.back().empty() &&
                          words.back().find_first_not_of("0123456789") == std::string::npos;
      if (!digits) return std::nullopt;
      i = end;
      closed = true;
    } else {
      if (closed) return std::nullopt;
      words.back() += c;
    }
  }
  if (words.back().empty()) return std::nullopt;
  return words;
}

// The part of a field that one more word of a path names; `at` is the path so far and grows by it.
Field Descend(const Field& field, const std::string& word, const GroupRef& root, YamlNode* at) {
  if (const auto* group = std::get_if<GroupRef>(&field.value)) {
    at->path = Dotted(at->path, word);
    for (const auto& inner : group->fields)
      if (inner.key == word) return inner;
    FailUnknown(*at, word, *group, root, "");
  }

  size_t index = 0;
  const auto parsed = std::from_chars(word.data(), word.data() + word.size(), index);
  const bool is_index = parsed.ec == std::errc{} && parsed.ptr == word.data() + word.size();
  auto require_index = [&](size_t size) {
    if (!is_index)
      FailKey(*at, "is a " + TypeName(field) + "; write an element as " + at->path + "[0]");
    if (index >= size) FailKey(*at, "has no element " + word + ", it has " + std::to_string(size));
    at->path = ElementPath(at->path, index);
  };
  Field element{field.key, field.range, field.doc, {}};
  if (const auto* list = std::get_if<ListRef>(&field.value)) {
    require_index(list->size());
    element.value = list->element(index);
  } else if (const auto* numbers = std::get_if<NumbersRef>(&field.value)) {
    require_index(IsMatrix(*numbers) ? numbers->rows : numbers->rows * numbers->cols);
    if (IsMatrix(*numbers))
      element.value = RowOf(*numbers, static_cast<int>(index));
    else
      element.value = ElementOf(*numbers, static_cast<int>(index));
  } else if (auto* const* values = std::get_if<std::vector<double>*>(&field.value)) {
    require_index((*values)->size());
    element.value = (*values)->data() + index;
  } else {
    FailKey(*at, "has no key " + word + ": it is " + WithArticle(TypeName(field)));
  }
  return element;
}

// ------------------------------------------------------------------------------------------ saving

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
  std::string quoted = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      quoted += std::string("\\") + c;
    } else if (byte < 0x20 || byte == 0x7f) {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\x%02x", byte);
      quoted += escape;
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

std::string NumbersAsYaml(const NumbersRef& numbers) {
  std::vector<std::string> parts;
  if (IsMatrix(numbers)) {
    for (int row = 0; row < numbers.rows; ++row)
      parts.push_back(NumbersAsYaml(RowOf(numbers, row)));
  } else {
    for (int k = 0; k < numbers.rows * numbers.cols; ++k)
      parts.push_back(FormatNumber(*ElementOf(numbers, k)));
  }
  return "[" + Join(parts, ", ") + "]";
}

// A value that fits on its key's line; nothing for a group or a list of groups that has elements.
std::optional<std::string> ValueAsYaml(const Field& field) {
  using Text = std::optional<std::string>;
  return std::visit(
      Overloaded{
          [](const bool* value) -> Text { return *value ? "true" : "false"; },
          [](const int* value) -> Text { return std::to_string(*value); },
          [](const int64_t* value) -> Text { return std::to_string(*value); },
          [](const double* value) -> Text { return FormatNumber(*value); },
          [](const std::string* value) -> Text { return TextAsYaml(*value); },
          [](const std::vector<double>* values) -> Text {
            std::vector<std::string> parts;
            for (const double x : *values) parts.push_back(FormatNumber(x));
            return "[" + Join(parts, ", ") + "]";
          },
          [](const NumbersRef& numbers) -> Text { return NumbersAsYaml(numbers); },
          [](const EnumRef& value) -> Text { return TextAsYaml(value.names[value.get()]); },
          [](const GroupRef& group) -> Text {
            if (group.fields.empty()) return "{}";
            return std::nullopt;
          },
          [](const ListRef& list) -> Text {
            if (list.size() == 0) return "[]";
            return std::nullopt;
          },
      },
      field.value);
}

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
      std::vector<std::string> element = GroupLines(list.element(i));
      if (element.empty()) element.push_back("{}");
      for (size_t k = 0; k < element.size(); ++k)
        lines.push_back((k == 0 ? "  - " : "    ") + element[k]);
    }
  }
  return lines;
}

void AppendKeys(const GroupRef& group, const std::string& path, std::vector<KeyDoc>* docs) {
  static const std::string kMust = "must be ";
  for (const auto& field : group.fields) {
    KeyDoc doc{Dotted(path, field.key), TypeName(field), ValueAsYaml(field).value_or(""), "",
               field.doc};
    const std::string sentence = field.range.Sentence();
    const bool is_limited = std::isfinite(field.range.low) || std::isfinite(field.range.high);
    if (is_limited)
      doc.range = sentence.starts_with(kMust) ? sentence.substr(kMust.size()) : sentence;
    docs->push_back(doc);
    if (const auto* inner = std::get_if<GroupRef>(&field.value)) AppendKeys(*inner, doc.key, docs);
    if (const auto* list = std::get_if<ListRef>(&field.value)) {
      list->resize(0);
      list->resize(1);
      AppendKeys(list->element(0), doc.key + "[]", docs);
    }
  }
}

// Notes the line where each document of a text begins.
class DocumentLines : public YAML::EventHandler {
 public:
  const std::vector<int>& lines() const { return lines_; }

  void OnDocumentStart(const YAML::Mark& mark) override { lines_.push_back(mark.line + 1); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}

 private:
  std::vector<int> lines_;
};

// The only document of a text, null if it holds none. YAML::Load ignores whatever follows the first
// document, and YAML::LoadAll never returns where the parser cannot go on (text that begins with a
// comma), so the beginning of a second document is looked for first.
YAML::Node ParseOnly(const std::string& text, YamlNode at) {
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    DocumentLines documents;
    if (parser.HandleNextDocument(documents) && parser.HandleNextDocument(documents)) {
      at.line = documents.lines().back();
      FailKey(at, "one YAML document ends and more follows");
    }
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    if (!error.mark.is_null()) at.line = error.mark.line + 1;
    FailKey(at, "not valid YAML: " + error.msg);
  }
}

std::string ReadFile(const std::string& file) {
  auto fail = [&]() -> ConfigError {
    return ConfigError(file + ": cannot be read: " + std::strerror(errno));
  };
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"),
                                                               &std::fclose);
  if (!stream) throw fail();
  std::string text;
  char buffer[4096];
  while (const size_t n = std::fread(buffer, 1, sizeof buffer, stream.get()))
    text.append(buffer, n);
  if (std::ferror(stream.get())) throw fail();
  return text;
}

// A node keeps the style in which it was written, whatever the emitter is told.
void SetFlowStyle(YAML::Node* node) {
  if (!node->IsSequence() && !node->IsMap()) return;
  node->SetStyle(YAML::EmitterStyle::Flow);
  for (auto entry : *node) {
    if (node->IsMap())
      SetFlowStyle(&entry.second);
    else
      SetFlowStyle(&entry);
  }
}

}  // namespace

// ------------------------------------------------------------------------------------ public parts

std::string YamlNode::Where() const {
  return file == kFromSet ? file + " " : file + ":" + std::to_string(line) + ": ";
}

std::string OneLine(const YAML::Node& node) {
  YAML::Node flow = YAML::Clone(node);
  SetFlowStyle(&flow);
  YAML::Emitter out;
  out << flow;
  std::string text = out.c_str();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::optional<YamlNode> YamlNode::Find(const std::string& key) const {
  if (!node.IsMap()) return std::nullopt;
  for (const auto& entry : node)
    if (entry.first.IsScalar() && entry.first.Scalar() == key)
      return YamlNode{entry.second, file, Dotted(path, key), LineOf(entry.first, line)};
  return std::nullopt;
}

YamlNode LoadYaml(const std::string& file) { return ParseYaml(ReadFile(file), file); }

YamlNode ParseYaml(const std::string& text, const std::string& file) {
  YamlNode root{{}, file, ""};
  root.node = ParseOnly(text, root);
  if (root.node.IsNull()) throw ConfigError(file + ": is empty");
  root.line = LineOf(root.node, 1);
  if (!root.node.IsMap())
    throw ConfigError(root.Where() + "is " + Written(root, "'") + ", must be a group of keys");
  return root;
}

namespace internal {

void ReadGroup(const YamlNode& node, const GroupRef& group, Origins* origins,
               std::initializer_list<std::string_view> read_elsewhere) {
  if (!node.node.IsMap()) FailValue(node, "must be a group of keys");
  Reader(group, node.path, origins).ReadGroup(node, group, read_elsewhere);
}

void ApplySetToGroup(const std::string& assignment, const GroupRef& group, Origins* origins) {
  const size_t equals = assignment.find('=');
  const std::string path = assignment.substr(0, equals);
  YamlNode at{{}, kFromSet, path};
  if (equals == std::string::npos) FailKey(at, "must be KEY=VALUE");
  const auto words = SplitPath(path);
  if (!words) FailKey(at, "is no key; write group.key=value");

  const Reader reader(group, "", origins);
  at.path.clear();
  Field field{"", {}, "", group};
  for (const auto& word : *words) field = Descend(field, word, group, &at);

  at.node = ParseOnly(assignment.substr(equals + 1), at);
  reader.ReadValue(at, field);
}

void ThrowWithOrigin(const ConfigError& error, const Origins& origins) {
  for (std::string key = error.key(); !key.empty();) {
    if (const auto found = origins.find(key); found != origins.end())
      throw ConfigError(found->second + error.what());
    const size_t cut = key.find_last_of(".[");
    key.resize(cut == std::string::npos ? 0 : cut);
  }
  throw error;
}

std::string SaveGroup(const GroupRef& group) {
  const std::vector<std::string> lines = GroupLines(group);
  return lines.empty() ? "{}\n" : Join(lines, "\n") + "\n";
}

std::vector<KeyDoc> ListGroupKeys(const GroupRef& group) {
  std::vector<KeyDoc> docs;
  AppendKeys(group, "", &docs);
  return docs;
}

}  // namespace internal

}  // namespace turbidock::config
