#include "experiments/config/yaml_fields.h"

#include <fmt/ranges.h>
#include <yaml-cpp/emitter.h>

#include <algorithm>
#include <boost/algorithm/string/split.hpp>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

#include "experiments/config/nearest_name.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"

namespace turbidock::config {
namespace {

using internal::Overloaded;

// ---------------------------------------------------------------------------------------- messages

std::string Commas(const std::vector<std::string>& parts) {
  return fmt::format("{}", fmt::join(parts, ", "));
}

// What a value of the field is: "number", "one of active, passive".
std::string TypeName(const Field& field) {
  constexpr const char* kSimple[] = {"true or false", "whole number", "whole number", "number",
                                     "text"};
  if (field.value.index() < std::size(kSimple)) return kSimple[field.value.index()];
  if (const auto* one = std::get_if<EnumRef>(&field.value)) return "one of " + Commas(one->names);
  const auto* list = std::get_if<ListRef>(&field.value);
  if (!list) return "group of keys";
  if (list->of_groups) return "list of groups";
  if (list->resize) return "list of numbers";
  const Field first = list->element(0);
  const auto* row = std::get_if<ListRef>(&first.value);
  return row ? fmt::format("list of {} rows of {} numbers", list->size(), row->size())
             : fmt::format("list of {} numbers", list->size());
}

std::string WithArticle(const std::string& type) {
  const bool bare = type.starts_with("true") || type == "text" || type.starts_with("one of");
  return bare ? type : "a " + type;
}

// A text is quoted unless it is a number.
[[noreturn]] void FailValue(const YamlNode& at, const std::string& problem,
                            const char* quote = "'") {
  if (at.tree->kind == YamlTree::Kind::kNothing) at.Fail("has no value, " + problem);
  const std::string written = at.IsList()  ? "a list"
                              : at.IsMap() ? "a group of keys"
                                           : quote + system::Shortened(at.tree->text) + quote;
  throw ConfigError(at.Where() + at.path + " = " + written + ", " + problem);
}

[[noreturn]] void FailType(const YamlNode& at, const Field& field) {
  FailValue(at, "must be " + WithArticle(TypeName(field)));
}

const Field* FindField(const GroupRef& group, const std::string& key) {
  const auto found = std::ranges::find(group.fields, key, &Field::key);
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
  std::vector<std::string> known, elsewhere;
  for (const auto& field : group.fields) known.push_back(field.key);
  const std::string nearest = DidYouMean(key, known);
  if (!nearest.empty()) at.Fail("unknown key" + nearest);
  FindByName(root, root_path, key, &elsewhere);
  if (elsewhere.size() != 1) at.Fail("unknown key; allowed: " + Commas(known));
  at.Fail(elsewhere[0] == key ? "unknown key; a file nests its keys, one level a line"
                              : "unknown key; did you mean " + elsewhere[0] + "?");
}

// ----------------------------------------------------------------------------------------- reading

// The number of the longest beginning of `text` that is one, and what follows it.
struct Parsed {
  double value = 0;
  std::errc error{};
  std::string_view rest{};
};

Parsed ParseDouble(std::string_view text) {
  const double sign = text.starts_with('-') ? -1 : 1;
  const std::string_view digits = text.substr(sign < 0 || text.starts_with('+') ? 1 : 0);
  // YAML's own spellings of what the ranges refuse
  for (const std::string_view name : {".inf", ".Inf", ".INF", ".nan", ".NaN", ".NAN"})
    if (digits == name) return {.value = std::numeric_limits<double>::quiet_NaN()};
  if (digits.find_first_of("0123456789.") != 0) return {0, std::errc::invalid_argument, text};
  Parsed parsed;
  const char* const end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, parsed.value);
  return {sign * parsed.value, error, {stop, static_cast<size_t>(end - stop)}};
}

// Reads values into fields.
class Reader {
 public:
  Reader(const GroupRef& root, std::string root_path, Origins* origins,
         std::initializer_list<std::string_view> read_elsewhere = {})
      : root_(root),
        root_path_(std::move(root_path)),
        origins_(origins),
        read_elsewhere_(read_elsewhere) {}

  // Reads a value, and throws for all mistakes in it.
  void Read(const YamlNode& at, const Field& field) {
    ReadValue(at, field);
    constexpr size_t kMostSaid = 10;
    const size_t count = mistakes_.size();
    if (count == 1) throw ConfigError(mistakes_[0]);
    if (count > kMostSaid) {
      mistakes_.resize(kMostSaid);
      mistakes_.push_back(fmt::format("and {} mistakes more", count - kMostSaid));
    }
    if (count > 1) throw ConfigErrors(fmt::format("{}", fmt::join(mistakes_, "\n")));
  }

 private:
  // A mistake in one key keeps no other from being read.
  void ReadGroup(const YamlNode& at, const GroupRef& group) {
    for (const auto& [key, child] : at.Entries()) {
      if (at.path == root_path_ && std::ranges::count(read_elsewhere_, key) > 0) continue;
      try {
        if (const Field* field = FindField(group, key))
          ReadValue(child, *field);
        else
          FailUnknown(child, key, group, root_, root_path_);
      } catch (const ConfigError& error) {
        mistakes_.push_back(system::OneLineOf(error.what()));
      }
    }
  }

  // Notes where the value was set, and reads it.
  void ReadValue(const YamlNode& at, const Field& field) {
    if (origins_) (*origins_)[at.path] = at.Where();
    std::visit(Overloaded{
                   [&](bool* value) {
                     *value = at.tree->plain && at.tree->text == "true";
                     if (!*value && !(at.tree->plain && at.tree->text == "false"))
                       FailType(at, field);
                   },
                   [&](int* value) { ReadInt(at, field, value); },
                   [&](int64_t* value) { ReadInt(at, field, value); },
                   [&](double* value) { ReadDouble(at, field, value); },
                   [&](std::string* value) {
                     if (!at.Text()) FailType(at, field);
                     *value = at.tree->text;
                   },
                   [&](const EnumRef& value) {
                     const auto found = std::ranges::find(value.names, at.Text());
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

  static const std::string& NumberText(const YamlNode& at, const Field& field) {
    if (!at.Text()) FailType(at, field);
    if (!at.tree->plain) FailValue(at, "must be a " + TypeName(field) + ", without quotes");
    return at.tree->text;
  }

  static void ReadDouble(const YamlNode& at, const Field& field, double* value) {
    const Parsed parsed = ParseDouble(NumberText(at, field));
    if (parsed.error == std::errc::result_out_of_range)
      FailValue(at, "is too large or too small a number", "");
    if (parsed.error != std::errc{}) FailType(at, field);
    if (!parsed.rest.empty()) FailValue(at, "give a plain " + TypeName(field));
    if (!field.range.Contains(parsed.value)) FailValue(at, field.range.Sentence(), "");
    *value = parsed.value;
  }

  template <class Int>
  static void ReadInt(const YamlNode& at, const Field& field, Int* value) {
    using Limits = std::numeric_limits<Int>;
    const std::string& text = NumberText(at, field);
    const char* const end = text.data() + text.size();
    Int parsed = 0;
    const auto [stop, error] =
        std::from_chars(text.data() + (text.starts_with('+') ? 1 : 0), end, parsed);
    if (error == std::errc::result_out_of_range && stop == end)
      FailValue(at, fmt::format("must be in [{}, {}]", Limits::min(), Limits::max()), "");
    if (error != std::errc{} || stop != end) {
      const Parsed number = ParseDouble(text);  // 1.5, or 5 pieces
      if (number.error != std::errc{}) FailType(at, field);
      if (number.rest.empty()) FailValue(at, "must be a " + TypeName(field), "");
      FailValue(at, "give a plain " + TypeName(field));
    }
    if (!field.range.Contains(static_cast<double>(parsed)))
      FailValue(at, field.range.Sentence(), "");
    *value = parsed;
  }

  void ReadList(const YamlNode& at, const Field& field, const ListRef& list) {
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
  std::initializer_list<std::string_view> read_elsewhere_;
  std::vector<std::string> mistakes_;
};

// ------------------------------------------------------------------------------------- --set paths

// "a.b[0].c" or "a.b.0.c" -> a, b, 0, c; a word is empty where it is no path.
std::vector<std::string> SplitPath(std::string path) {
  for (size_t i = path.find('['); i != std::string::npos; i = path.find('[', i)) {
    const size_t close = path.find_first_not_of("0123456789", i + 1);
    if (close == std::string::npos || path[close] != ']' ||
        std::string_view("[.", 3).find(path.c_str()[close + 1]) == std::string_view::npos)
      return {""};
    path.erase(close, 1);
    path[i] = '.';
  }
  std::vector<std::string> words;
  return boost::split(words, path, [](char c) { return c == '.'; });
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

// The field that `at->path` names, element by element.
Field FieldAt(const GroupRef& group, YamlNode* at) {
  const std::vector<std::string> words = SplitPath(at->path);
  if (std::ranges::count(words, "") > 0) at->Fail("is no key; write group.key=value");
  at->path.clear();
  Field field{"", {}, "", group};
  for (const auto& word : words) field = Descend(field, word, group, at);
  return field;
}

// ----------------------------------------------------------------------------------------- saving

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
  Reader(group, node.path, origins, read_elsewhere).Read(node, {"", {}, "", group});
}

void ReadOne(const YamlNode& node, const ValueRef& value) {
  const GroupRef nothing;
  Reader(nothing, "", nullptr).Read(node, {"", Finite(), "", value});
}

void ApplySetToGroup(const std::string& assignment, const GroupRef& group, Origins* origins) {
  const size_t equals = assignment.find('=');
  YamlNode at{nullptr, kFromSet, assignment.substr(0, equals)};
  if (equals == std::string::npos) at.Fail("must be KEY=VALUE");
  const Field field = FieldAt(group, &at);
  std::string value = assignment.substr(equals + 1);
  // a shell takes the quotes off
  if (value.empty() && std::holds_alternative<std::string*>(field.value)) value = "''";
  Reader(group, "", origins).Read(ParseYamlValue(value, at), field);
}

std::optional<YamlNode> LastOf(const Layers& layers, const std::string& key) {
  std::optional<YamlNode> last;
  // Looks for the rest of the key, after a dot, in what is before it.
  const auto look = [&](std::optional<YamlNode> node, const std::string& rest) {
    const std::vector<std::string> words = SplitPath(rest);
    for (size_t i = 1; node && i < words.size(); ++i) node = node->Find(words[i]);
    if (node) last = node;
  };
  for (const YamlNode& file : layers.files) look(file, "." + key);
  for (const std::string& assignment : layers.assignments) {
    const size_t equals = assignment.find('=');
    const std::string name = assignment.substr(0, equals);
    if (equals != std::string::npos && (key + ".").starts_with(name + "."))
      look(ParseYamlValue(assignment.substr(equals + 1), {nullptr, kFromSet, name}),
           key.substr(name.size()));
  }
  return last;
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
