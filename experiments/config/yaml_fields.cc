#include "experiments/config/yaml_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>

#include "experiments/config/field_text.h"
#include "experiments/config/nearest_name.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"

namespace turbidock::config {
namespace {

using internal::Commas;
using internal::InUnit;
using internal::Overloaded;
using internal::TypeName;
using internal::WithArticle;

// ---------------------------------------------------------------------------------------- messages

// The value as the user wrote it: quoted if it is text.
std::string Written(const YamlNode& at, const char* quote) {
  switch (at.tree->kind) {
    case YamlTree::Kind::kList:
      return "a list";
    case YamlTree::Kind::kMap:
      return "a group of keys";
    case YamlTree::Kind::kText:
      return quote + system::Shortened(at.tree->text) + quote;
    case YamlTree::Kind::kNothing:
      break;
  }
  return "";
}

[[noreturn]] void FailValue(const YamlNode& at, const std::string& problem,
                            const char* quote = "'") {
  const std::string written = Written(at, quote);
  if (written.empty()) at.Fail("has no value, " + problem);
  throw ConfigError(at.Where() + at.path + " = " + written + ", " + problem);
}

[[noreturn]] void FailType(const YamlNode& at, const Field& field) {
  FailValue(at, "must be " + WithArticle(TypeName(field)));
}

const Field* FindField(const GroupRef& group, const std::string& key) {
  const auto found = std::find_if(group.fields.begin(), group.fields.end(),
                                  [&](const Field& field) { return field.key == key; });
  return found == group.fields.end() ? nullptr : &*found;
}

// Dotted paths of the fields called `key` anywhere in the group.
void FindByName(const GroupRef& group, const std::string& path, const std::string& key,
                std::vector<std::string>* found) {
  for (const auto& field : group.fields) {
    const std::string full = JoinKey(path, field.key);
    if (field.key == key || full == key) found->push_back(full);
    if (const auto* inner = std::get_if<GroupRef>(&field.value))
      FindByName(*inner, full, key, found);
  }
}

[[noreturn]] void FailUnknown(const YamlNode& at, const std::string& key, const GroupRef& group,
                              const GroupRef& root, const std::string& root_path) {
  std::vector<std::string> known;
  for (const auto& field : group.fields) known.push_back(field.key);
  if (const std::string nearest = DidYouMean(key, known); !nearest.empty())
    at.Fail("unknown key" + nearest);
  std::vector<std::string> elsewhere;
  FindByName(root, root_path, key, &elsewhere);
  if (elsewhere.size() == 1) {
    const bool is_path = elsewhere[0] == key;
    at.Fail(is_path ? "unknown key; a file nests its keys, one level a line"
                    : "unknown key; did you mean " + elsewhere[0] + "?");
  }
  at.Fail("unknown key; allowed: " + Commas(known));
}

// ----------------------------------------------------------------------------------------- reading

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

// What a layer's keys that the group does not have are.
enum class Unknown { kMistake, kSkipped };

class Reader {
 public:
  Reader(const GroupRef& root, std::string root_path, Origins* origins,
         Unknown unknown = Unknown::kMistake)
      : root_(root), root_path_(std::move(root_path)), origins_(origins), unknown_(unknown) {}

  Unknown unknown() const { return unknown_; }

  void ReadGroup(const YamlNode& at, const GroupRef& group,
                 std::initializer_list<std::string_view> read_elsewhere = {}) const {
    for (const auto& [key, child] : at.Entries()) {
      if (std::find(read_elsewhere.begin(), read_elsewhere.end(), key) != read_elsewhere.end())
        continue;
      if (const Field* field = FindField(group, key))
        ReadValue(child, *field);
      else if (unknown_ == Unknown::kMistake)
        FailUnknown(child, key, group, root_, root_path_);
    }
  }

  // Notes where the value was set, and reads it.
  void ReadValue(const YamlNode& at, const Field& field) const {
    if (origins_) (*origins_)[at.path] = at.Where();
    std::visit(Overloaded{
                   [&](bool* value) {
                     const bool is_true = at.tree->plain && at.tree->text == "true";
                     if (!is_true && !(at.tree->plain && at.tree->text == "false"))
                       FailType(at, field);
                     *value = is_true;
                   },
                   [&](int* value) { ReadInt(at, field, value); },
                   [&](int64_t* value) { ReadInt(at, field, value); },
                   [&](double* value) { ReadDouble(at, field, value); },
                   [&](std::string* value) {
                     if (!at.Text()) FailType(at, field);
                     *value = at.tree->text;
                   },
                   [&](const EnumRef& value) {
                     const auto found =
                         std::find(value.names.begin(), value.names.end(), at.Text());
                     if (found == value.names.end()) FailType(at, field);
                     value.set(static_cast<size_t>(found - value.names.begin()));
                   },
                   [&](const GroupRef& group) {
                     if (!at.IsMap()) FailType(at, field);
                     ReadGroup(at, group);
                   },
                   [&](const ListRef& list) { ReadList(at, field, list); },
               },
               field.value);
  }

 private:
  static const std::string& NumberText(const YamlNode& at, const std::string& number) {
    if (!at.Text()) FailValue(at, "must be a " + number);
    if (!at.tree->plain) FailValue(at, "must be a " + number + ", without quotes");
    return at.tree->text;
  }

  void ReadDouble(const YamlNode& at, const Field& field, double* value) const {
    const std::string number = "number" + InUnit(field.key);
    const Parsed parsed = ParseDouble(NumberText(at, number));
    if (parsed.error == std::errc::result_out_of_range)
      FailValue(at, "is too large or too small a number", "");
    if (parsed.error != std::errc{}) FailValue(at, "must be a " + number);
    if (!parsed.rest.empty()) FailValue(at, "give a plain " + number);
    if (!field.range.Contains(parsed.value)) FailValue(at, field.range.Sentence(), "");
    *value = parsed.value;
  }

  template <class Int>
  void ReadInt(const YamlNode& at, const Field& field, Int* value) const {
    const std::string number = "whole number" + InUnit(field.key);
    const std::string& text = NumberText(at, number);
    const char* const begin = text.data() + (text.starts_with('+') ? 1 : 0);
    const char* const end = text.data() + text.size();
    Int parsed = 0;
    const auto result = std::from_chars(begin, end, parsed);
    if (result.ec == std::errc::result_out_of_range && result.ptr == end)
      FailValue(at,
                fmt::format("must be in [{}, {}]", std::numeric_limits<Int>::min(),
                            std::numeric_limits<Int>::max()),
                "");
    if (result.ec != std::errc{} || result.ptr != end) {
      const Parsed as_double = ParseDouble(text);
      const bool is_number = as_double.error == std::errc{} && as_double.rest.empty();
      if (is_number) FailValue(at, "must be a " + number, "");
      FailValue(at, (as_double.error == std::errc{} ? "give a plain " : "must be a ") + number);
    }
    if (!field.range.Contains(static_cast<double>(parsed)))
      FailValue(at, field.range.Sentence(), "");
    *value = parsed;
  }

  void ReadList(const YamlNode& at, const Field& field, const ListRef& list) const {
    if (!at.IsList()) FailType(at, field);
    if (origins_)
      std::erase_if(*origins_,
                    [&](const auto& entry) { return entry.first.starts_with(at.path + "["); });
    const std::vector<YamlNode> elements = at.Elements();
    if (list.resize) {
      list.resize(0);  // elements begin with their own defaults, not with those of the list
      list.resize(elements.size());
    } else if (elements.size() != list.size()) {
      throw ConfigError(fmt::format("{}{} has {} {}, must be {}", at.Where(), at.path,
                                    elements.size(), elements.size() == 1 ? "element" : "elements",
                                    WithArticle(TypeName(field))));
    }
    for (size_t i = 0; i < elements.size(); ++i)
      ReadValue(elements[i], {field.key, field.range, "", list.element(i).value});
  }

  const GroupRef& root_;
  std::string root_path_;
  Origins* origins_;
  Unknown unknown_;
};

// ------------------------------------------------------------------------------------- --set paths

// "a.b[0].c" or "a.b.0.c" -> a, b, 0, c. Nothing if it is no path.
std::optional<std::vector<std::string>> SplitPath(const std::string& text) {
  std::string path;  // with dots only
  for (size_t i = 0; i < text.size();) {
    if (text[i] != '[') {
      path += text[i++];
      continue;
    }
    const size_t close = text.find_first_not_of("0123456789", i + 1);
    if (close == std::string::npos || text[close] != ']' || close == i + 1) return std::nullopt;
    const bool ends = close + 1 == text.size() || text[close + 1] == '.' || text[close + 1] == '[';
    if (!ends) return std::nullopt;
    path += '.' + text.substr(i + 1, close - i - 1);
    i = close + 1;
  }
  std::vector<std::string> words;
  for (size_t begin = 0; begin <= path.size();) {
    const size_t end = std::min(path.find('.', begin), path.size());
    if (end == begin) return std::nullopt;
    words.push_back(path.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

// The part of a field that one more word of a path names; `at` is the path so far and grows by it.
Field Descend(const Field& field, const std::string& word, const GroupRef& root, YamlNode* at) {
  if (const auto* group = std::get_if<GroupRef>(&field.value)) {
    at->path = JoinKey(at->path, word);
    if (const Field* inner = FindField(*group, word)) return *inner;
    FailUnknown(*at, word, *group, root, "");
  }

  const auto* list = std::get_if<ListRef>(&field.value);
  if (!list) at->Fail("has no key " + word + ": it is " + WithArticle(TypeName(field)));
  size_t index = 0;
  const char* const end = word.data() + word.size();
  const auto parsed = std::from_chars(word.data(), end, index);
  if (parsed.ec != std::errc{} || parsed.ptr != end)
    at->Fail("is a " + TypeName(field) + "; write an element as " + at->path + "[0]");
  if (index >= list->size())
    at->Fail("has no element " + word + ", it has " + std::to_string(list->size()));
  at->path = ElementPath(at->path, index);
  return {field.key, field.range, field.doc, list->element(index).value};
}

// The field that `at->path` names, element by element; nothing where a group does not have it and
// that is no mistake.
std::optional<Field> FieldAt(const GroupRef& group, Unknown unknown, YamlNode* at) {
  const auto words = SplitPath(at->path);
  if (!words) at->Fail("is no key; write group.key=value");
  at->path.clear();
  Field field{"", {}, "", group};
  for (const auto& word : *words) {
    const auto* inside = std::get_if<GroupRef>(&field.value);
    if (unknown == Unknown::kSkipped && inside && !FindField(*inside, word)) return std::nullopt;
    field = Descend(field, word, group, at);
  }
  return field;
}

void ApplySet(const std::string& assignment, const GroupRef& group, const Reader& reader) {
  const size_t equals = assignment.find('=');
  YamlNode at{nullptr, kFromSet, assignment.substr(0, equals)};
  if (equals == std::string::npos) at.Fail("must be KEY=VALUE");
  const std::optional<Field> field = FieldAt(group, reader.unknown(), &at);
  if (!field) return;
  std::string value = assignment.substr(equals + 1);
  // a shell takes the quotes off
  if (value.empty() && std::holds_alternative<std::string*>(field->value)) value = "''";
  reader.ReadValue(ParseYamlValue(value, at), *field);
}

}  // namespace

// ------------------------------------------------------------------------------------ public parts

namespace internal {

ListRef ListOf(std::vector<double>* numbers) {
  return {false, [numbers] { return numbers->size(); }, [numbers](size_t n) { numbers->resize(n); },
          [numbers](size_t i) { return Field{.value = &(*numbers)[i]}; }};
}

ListRef ListOf(double* data, size_t rows, size_t cols, size_t row_stride, size_t col_stride) {
  if (rows > 1 && cols > 1)
    return {false, [=] { return rows; }, nullptr,
            [=](size_t i) {
              return Field{.value = ListOf(data + i * row_stride, 1, cols, 0, col_stride)};
            }};
  const size_t stride = rows == 1 ? col_stride : row_stride;
  return {false, [=] { return rows * cols; }, nullptr,
          [=](size_t i) { return Field{.value = data + i * stride}; }};
}

void AddField(const char* key, const Range& range, const char* doc, ValueRef value,
              GroupRef* group) {
  group->fields.push_back({key, range, doc, std::move(value)});
}

void ReadGroup(const YamlNode& node, const GroupRef& group, Origins* origins,
               std::initializer_list<std::string_view> read_elsewhere) {
  if (!node.IsMap()) FailValue(node, "must be a group of keys");
  Reader(group, node.path, origins).ReadGroup(node, group, read_elsewhere);
}

void ReadOne(const YamlNode& node, const ValueRef& value) {
  const GroupRef nothing;
  Reader(nothing, "", nullptr).ReadValue(node, {"", Finite(), "", value});
}

void ApplySetToGroup(const std::string& assignment, const GroupRef& group, Origins* origins) {
  ApplySet(assignment, group, Reader(group, "", origins));
}

void PeekValue(const Layers& layers, const std::string& key, const ValueRef& value) {
  // The key with the groups around it, and nothing else.
  const size_t dot = key.find('.');
  TD_CHECK(key.find('.', dot + 1) == std::string::npos, "a key, or one of a group");
  GroupRef group{{{key.substr(dot + 1), {}, "", value}}};
  if (dot != std::string::npos) group = {{{key.substr(0, dot), {}, "", group}}};
  const Reader reader(group, "", nullptr, Unknown::kSkipped);
  for (const YamlNode& file : layers.files) reader.ReadGroup(file, group);
  for (const std::string& assignment : layers.assignments) ApplySet(assignment, group, reader);
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

std::string ValueIn(const GroupRef& group, const std::string& key) {
  YamlNode at{nullptr, kFromSet, key};
  const std::optional<std::string> value = ValueAsYaml(*FieldAt(group, Unknown::kMistake, &at));
  if (!value) throw ConfigError(key, "is a group");
  return *value;
}

}  // namespace internal

}  // namespace turbidock::config
