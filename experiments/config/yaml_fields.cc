#include "experiments/config/yaml_fields.h"

#include <yaml-cpp/emitter.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <iterator>
#include <string_view>

namespace turbidock::config {
namespace {

using internal::Overloaded;
using internal::TypeName;

// In quotes where YAML or people might read something else than text.
void EmitSaved(const std::string& text, YAML::Emitter* out) {
  constexpr const char* kReserved[] = {"null", "true", "false", "yes", "no", "on", "off", "y", "n"};
  const bool is_plain =
      !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) &&
      std::ranges::all_of(text,
                          [](unsigned char c) {
                            return std::isalnum(c) || c == '_' || c == '.' || c == '/' || c == '-';
                          }) &&
      std::ranges::none_of(kReserved,
                           [&](const char* word) { return strcasecmp(text.c_str(), word) == 0; });
  if (!is_plain) *out << YAML::DoubleQuoted;
  *out << text;
}

// 2.0e-04: to YAML 1.1 a number with an exponent has a point.
std::string NumberAsYaml(double number) {
  std::string text = FormatNumber(number);
  const size_t exponent = text.find('e');
  if (exponent != std::string::npos && text.find('.') == std::string::npos)
    text.insert(exponent, ".0");
  return text;
}

bool IsBlock(const Field& field) {
  if (const auto* group = std::get_if<GroupRef>(&field.value)) return !group->fields.empty();
  const auto* list = std::get_if<ListRef>(&field.value);
  return list && list->of_groups && list->size() > 0;
}

// In a group each value has its description as a comment.
void Emit(const Field& field, YAML::Emitter* out) {
  const auto emit_group = [out](const GroupRef& group) {
    if (group.fields.empty()) *out << YAML::Flow;
    *out << YAML::BeginMap;
    for (const Field& inner : group.fields) {
      const bool is_block = IsBlock(inner);
      *out << YAML::Key << inner.key;
      if (is_block && !inner.doc.empty()) *out << YAML::Comment(inner.doc);
      *out << YAML::Value;
      Emit(inner, out);
      if (!is_block && !inner.doc.empty()) *out << YAML::Comment(inner.doc);
    }
    *out << YAML::EndMap;
  };
  const auto emit_list = [&](const ListRef& list) {
    if (!IsBlock(field)) *out << YAML::Flow;
    *out << YAML::BeginSeq;
    for (size_t i = 0; i < list.size(); ++i) Emit(list.element(i), out);
    *out << YAML::EndSeq;
  };
  std::visit(Overloaded{[&](const auto* value) { *out << *value; },
                        [&](const double* value) { *out << NumberAsYaml(*value); },
                        [&](const std::string* value) { EmitSaved(*value, out); },
                        [&](const InputFile* value) { EmitSaved(value->path, out); },
                        [&](const EnumRef& value) { EmitSaved(value.names[value.get()], out); },
                        emit_group, emit_list},
             field.value);
}

// A value that fits on its key's line; nothing for a group or a list of groups that has elements.
std::optional<std::string> ValueAsYaml(const Field& field) {
  if (IsBlock(field)) return std::nullopt;
  YAML::Emitter out;
  Emit(field, &out);
  return out.c_str();
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
  const std::string_view path = key;
  const size_t dot = path.find('.');
  const std::string name(path.substr(0, dot));
  const auto there = std::ranges::find(group->fields, name, &Field::key);
  auto* inner = there == group->fields.end() ? nullptr : std::get_if<GroupRef>(&there->value);
  if (dot != std::string_view::npos) {
    if (!inner) {
      group->fields.push_back({name, {}, "", GroupRef{}});
      inner = std::get_if<GroupRef>(&group->fields.back().value);
    }
    AddField(key + dot + 1, range, doc, std::move(value), inner);
  } else if (auto* more = std::get_if<GroupRef>(&value); more && inner) {
    std::ranges::move(more->fields, std::back_inserter(inner->fields));
    std::ranges::move(more->presets, std::back_inserter(inner->presets));
    TD_CHECK(!more->given || !inner->given, "one listener in a group");
    if (more->given) inner->given = std::move(more->given);
  } else {
    TD_CHECK(there == group->fields.end(), "one field of a key");
    group->fields.push_back({name, range, doc, std::move(value)});
  }
}

void ArrangeGroups(std::span<const std::pair<const char*, const char*>> groups, GroupRef* group) {
  for (const auto& [name, doc] : groups) {
    const auto there = std::ranges::find(group->fields, name, &Field::key);
    TD_CHECK(there != group->fields.end(), "a field of each group");
    there->doc = doc;
    std::rotate(there, there + 1, group->fields.end());
  }
}

std::vector<std::string> PresetsIn(const GroupRef& group) {
  std::vector<std::string> keys = group.presets;
  for (const Field& field : group.fields)
    if (const auto* inner = std::get_if<GroupRef>(&field.value))
      for (const std::string& key : PresetsIn(*inner)) keys.push_back(JoinKey(field.key, key));
  return keys;
}

void ForEachFile(const GroupRef& group, const std::function<void(InputFile*)>& act) {
  const std::function<void(const Field&)> look = [&](const Field& field) {
    if (const auto* file = std::get_if<InputFile*>(&field.value)) act(*file);
    if (const auto* inner = std::get_if<GroupRef>(&field.value)) ForEachFile(*inner, act);
    if (const auto* list = std::get_if<ListRef>(&field.value); list && list->of_groups)
      for (size_t i = 0; i < list->size(); ++i) look(list->element(i));
  };
  for (const Field& field : group.fields) look(field);
}

std::string TextAt(const GroupRef& group, const std::string& key) {
  YamlNode at{nullptr, kFromSet, key};
  YAML::Emitter out;
  out << YAML::Flow;
  Emit(FieldAt(group, &at), &out);
  return out.c_str();
}

std::string ValueIn(const GroupRef& group, const std::string& key) {
  YamlNode at{nullptr, kFromSet, key};
  const std::optional<std::string> value = ValueAsYaml(FieldAt(group, &at));
  if (!value) throw ConfigError(key, "is a group");
  return *value;
}

std::string SaveGroup(const GroupRef& group) {
  YAML::Emitter out;
  Emit({.value = group}, &out);
  return std::string(out.c_str()) + "\n";
}

std::vector<KeyDoc> ListGroupKeys(const GroupRef& group) {
  std::vector<KeyDoc> docs;
  AppendKeys(group, "", &docs);
  return docs;
}

}  // namespace internal

}  // namespace turbidock::config
