// Reading of what yaml_fields.h declares: a node of YAML, or one value by its key, into fields.

#include <fmt/ranges.h>

#include <algorithm>
#include <boost/algorithm/string/split.hpp>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

#include "experiments/config/data_files.h"
#include "experiments/config/nearest_name.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/system/plain_text.h"

namespace turbidock::config {
namespace {

using internal::Around;
using internal::Overloaded;
using internal::TypeName;

// ---------------------------------------------------------------------------------------- messages

std::string Commas(const std::vector<std::string>& parts) {
  return fmt::format("{}", fmt::join(parts, ", "));
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

// `more`: keys of the root besides its fields.
[[noreturn]] void FailUnknown(const YamlNode& at, const std::string& key, const GroupRef& group,
                              const GroupRef& root, const std::string& root_path,
                              const std::vector<std::string>& more = {}) {
  std::vector<std::string> known, elsewhere;
  for (const auto& field : group.fields) known.push_back(field.key);
  const bool is_root = at.path == JoinKey(root_path, key);
  if (is_root) known.insert(known.end(), more.begin(), more.end());
  const std::string allowed = "llowed: " + Commas(known);
  constexpr size_t kFew = 24;
  if (const std::string nearest = DidYouMean(key, known); !nearest.empty())
    at.Fail("unknown key" + nearest + (is_root && known.size() <= kFew ? " A" + allowed : ""));
  FindByName(root, root_path, key, &elsewhere);
  if (elsewhere.size() != 1) at.Fail("unknown key; a" + allowed);
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

// "a.b[0].c" or "a.b.0.c" -> a, b, 0, c; a word is empty where it is no path.
std::vector<std::string> SplitPath(std::string path) {
  for (size_t i = path.find('['); i != std::string::npos; i = path.find('[', i)) {
    const size_t close = path.find_first_not_of("0123456789", i + 1);
    if (close == std::string::npos || path[close] != ']' ||
        std::string_view("[.\0", 3).find(path.c_str()[close + 1]) == std::string_view::npos)
      return {""};
    path.erase(close, 1);
    path[i] = '.';
  }
  std::vector<std::string> words;
  return boost::split(words, path, [](char c) { return c == '.'; });
}

// A bundled model keeps its name. Any other file is beside the one that names it, or for --set in
// the working directory.
std::string FileOf(const YamlNode& at) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const std::string& name = at.tree->text;
  if (name.empty() || IsBundledModel(name)) return name;
  const fs::path folder = at.file == kFromSet ? "" : fs::path(at.file).parent_path();
  const fs::path path = fs::absolute(folder / name).lexically_normal();
  if (!fs::is_regular_file(path, ignored))
    FailValue(at, name.ends_with(".csv") ? "is no file"
                                         : "is neither a file nor one of the bundled models");
  return path.string();
}

struct ReadOptions {
  // Presets stand for nothing, and files are as they are written.
  bool is_resolved = false;
  std::vector<std::string> read_elsewhere = {};
  std::vector<Around> around = {};  // from outside to inside
};

// Reads values into fields.
class Reader {
 public:
  Reader(const GroupRef& root, std::string root_path, Origins* origins, ReadOptions options = {})
      : root_(root),
        root_path_(std::move(root_path)),
        origins_(origins),
        options_(std::move(options)) {}

  // Reads a value, and throws for all mistakes in it.
  void Read(const YamlNode& at, const Field& field) {
    ReadGiven(at, field);
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
  template <class Do>
  void Noting(const Do& act) {
    try {
      act();
    } catch (const ConfigError& error) {
      mistakes_.push_back(system::OneLineOf(error.what()));
    }
  }

  void ReadGroup(const YamlNode& at, const GroupRef& group) {
    if (group.given && !options_.is_resolved) options_.around.push_back({at.path, group.given});
    if (!options_.is_resolved)
      for (const std::string& preset : group.presets) ReadPreset(at, group, preset);
    for (const auto& [key, child] : at.Entries()) {
      if (at.path == root_path_ && std::ranges::count(options_.read_elsewhere, key) > 0) continue;
      if (presets_.contains(child.path)) continue;
      Noting([&, &key = key, &child = child] {
        if (const Field* field = FindField(group, key))
          ReadGiven(child, *field);
        else
          FailUnknown(child, key, group, root_, root_path_, options_.read_elsewhere);
      });
    }
    if (group.given && !options_.is_resolved) options_.around.pop_back();
  }

  // A preset in a group, "procedure.approach.mode", where the group's node has it.
  void ReadPreset(YamlNode at, const GroupRef& group, const std::string& preset) {
    const std::optional<YamlNode> given = at.FindPath(preset);
    if (!given) return;
    at.path = preset;
    const Field field = internal::FieldAt(group, &at);
    presets_.insert(given->path);
    Noting([&] { ReadGiven(*given, field); });
  }

  // Reads a value, and tells the groups that it is in.
  void ReadGiven(const YamlNode& at, const Field& field) {
    ReadValue(at, field);
    for (size_t i = options_.around.size(); i-- > 0;) {
      const Around& group = options_.around[i];
      try {
        if (at.path.size() > group.path.size())
          group.given(at.path.substr(group.path.empty() ? 0 : group.path.size() + 1));
      } catch (const ConfigError& error) {
        if (error.key().empty()) throw;  // it has a place of its own
        throw ConfigError(at.Where() + error.what());
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
                   [&](std::string* value) { *value = TextOf(at, field); },
                   [&](InputFile* value) {
                     const std::string name = TextOf(at, field);
                     value->path = options_.is_resolved ? name : FileOf(at);
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

  // An empty value of --set is an empty text: a shell takes the quotes off.
  static std::string TextOf(const YamlNode& at, const Field& field) {
    if (at.file == kFromSet && at.tree->kind == YamlTree::Kind::kNothing) return "";
    if (!at.Text()) FailType(at, field);
    return at.tree->text;
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
    if (error == std::errc::result_out_of_range && stop == end) {
      const auto& [low, high, low_open, high_open] = field.range;
      const Int least =
          low > static_cast<double>(Limits::min()) ? static_cast<Int>(low) : Limits::min();
      const Int most =
          high < static_cast<double>(Limits::max()) ? static_cast<Int>(high) : Limits::max();
      FailValue(at, fmt::format("must be in [{}, {}]", least, most), "");
    }
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
  ReadOptions options_;
  std::set<std::string> presets_;  // that were read before the others
  std::vector<std::string> mistakes_;
};

// ------------------------------------------------------------------------------------- --set paths

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

}  // namespace

namespace internal {

std::string TypeName(const Field& field) {
  constexpr const char* kSimple[] = {"true or false", "whole number", "whole number",
                                     "number",        "text",         "file"};
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

Field FieldAt(const GroupRef& group, YamlNode* at, std::vector<Around>* around) {
  const std::vector<std::string> words = SplitPath(at->path);
  if (std::ranges::count(words, "") > 0) at->Fail("is no key; write group.key=value");
  at->path.clear();
  Field field{"", {}, "", group};
  for (const auto& word : words) {
    const auto* in = std::get_if<GroupRef>(&field.value);
    if (around && in && in->given) around->push_back({at->path, in->given});
    field = Descend(field, word, group, at);
  }
  return field;
}

void ReadGroup(const YamlNode& node, const GroupRef& group, Origins* origins,
               const std::vector<std::string>& read_elsewhere) {
  Origins set;
  Reader(group, node.path, &set, {.read_elsewhere = read_elsewhere})
      .Read(node, {"", {}, "", group});
  if (origins) AddOrigins(set, origins);
}

void ReadLayer(const Assignment& layer, const GroupRef& group, Origins* origins) {
  if (layer.key.empty())
    return Reader(group, layer.value.path, origins).Read(layer.value, {"", {}, "", group});
  YamlNode at = layer.value;
  at.path = layer.key;
  ReadOptions options;
  Field field = FieldAt(group, &at, &options.around);
  if (auto* part = std::get_if<GroupRef>(&field.value))
    for (const std::string& preset : group.presets)
      if (preset.starts_with(at.path + "."))
        part->presets.push_back(preset.substr(at.path.size() + 1));
  Reader(group, "", origins, options).Read(at, field);
}

void ReadResolvedGroup(const YamlNode& node, const GroupRef& group) {
  Reader(group, node.path, nullptr, {.is_resolved = true}).Read(node, {"", {}, "", group});
}

void ReadOne(const YamlNode& node, const ValueRef& value) {
  const GroupRef nothing;
  Reader(nothing, "", nullptr).Read(node, {"", Finite(), "", value});
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

}  // namespace internal

}  // namespace turbidock::config
