#pragma once
// Strict YAML for any struct with Fields (sim/base/fields.h): loading in layers, --set, saving and
// the table of keys, all from the one list of fields.
//
//   Scenario scenario;  // the defaults in the struct
//   ReadLayers({.files = {LoadYaml("night_sea.yaml")}, .assignments = {"water.milk_ml_m3=20"}},
//              &scenario);
//
// Whatever is wrong is a ConfigError with the file and line of the offending key, a line for each
// mistake in a file:
//
//   night_sea.yaml:12: camera.baseline_m = 'abc', must be a number
//   night_sea.yaml:14: water.milk_ml_m4: unknown key; did you mean milk_ml_m3?
//   --set camera.baseline_m = -0.1, must be in [0.01, 1]

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "experiments/config/group_ref.h"
#include "experiments/config/yaml_node.h"
#include "sim/base/fields.h"

namespace turbidock::config {

// Where each value was last set: dotted key (and that of each group) -> "FILE:LINE: " or "--set ".
// A key that is absent has its default.
using Origins = std::map<std::string, std::string, std::less<>>;

// Settings in the order in which they are read over an object's defaults: the last one says.
struct Layers {
  std::vector<YamlNode> files{};
  std::vector<std::string> assignments{};  // of --set
};

// Several mistakes, a line each.
struct ConfigErrors : ConfigError {
  using ConfigError::ConfigError;
};

// One line of the table of keys.
struct KeyDoc {
  std::string key;    // dotted; elements of a list of groups are written key[]
  std::string type;   // "number", "list of 3 numbers", "one of active, passive"
  std::string value;  // the default as YAML; empty for groups
  std::string range;  // "in [0, 1]"; empty where any value will do
  std::string doc;
};

// ------------------------------------------------------------------------------------------------
// A struct may also have `void MoreFields(GroupRef* group)`, for fields that are known only when
// the program runs.
//
// A struct's fields with their types erased, so that the work below is done once, in the .cc file.

struct Field;

struct GroupRef {
  std::vector<Field> fields;
};

// Numbers, rows of numbers or structs; references to its elements are valid until the next resize.
struct ListRef {
  bool of_groups = false;
  std::function<size_t()> size;
  std::function<void(size_t)> resize;  // new elements have their defaults; none: the size is fixed
  std::function<Field(size_t)> element;  // its value alone
};

struct EnumRef {
  std::vector<std::string> names;
  std::function<size_t()> get;
  std::function<void(size_t)> set;
};

using ValueRef =
    std::variant<bool*, int*, int64_t*, double*, std::string*, EnumRef, GroupRef, ListRef>;

struct Field {
  std::string key{};
  Range range{};
  std::string doc{};
  ValueRef value;
};

namespace internal {

// Apart from GroupOf, which is compiled for every struct.
void AddField(const char* key, const Range& range, const char* doc, ValueRef value,
              GroupRef* group);
void ReadGroup(const YamlNode& node, const GroupRef& group, Origins* origins,
               std::initializer_list<std::string_view> read_elsewhere);
void ApplySetToGroup(const std::string& assignment, const GroupRef& group, Origins* origins);
void ReadOne(const YamlNode& node, const ValueRef& value);
std::optional<YamlNode> LastOf(const Layers& layers, const std::string& key);
// Rethrows `error` with the origin of its key, or of the group around it, in front.
[[noreturn]] void ThrowWithOrigin(const ConfigError& error, const Origins& origins);
std::string SaveGroup(const GroupRef& group);
std::string ValueIn(const GroupRef& group, const std::string& key);
std::vector<KeyDoc> ListGroupKeys(const GroupRef& group);

// Joins a function for each kind of a variant, for std::visit.
template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;

template <class E>
EnumRef EnumOf(E* member) {
  constexpr auto& kNames = EnumNames<E>::kNames;
  EnumRef ref;
  for (const auto& [value, name] : kNames) ref.names.push_back(name);
  ref.get = [member] {
    for (size_t i = 0; i < kNames.size(); ++i)
      if (kNames[i].first == *member) return i;
    TD_CHECK(false, "an enum's value is missing in EnumNames");
  };
  ref.set = [member](size_t i) { *member = kNames[i].first; };
  return ref;
}

ListRef ListOf(std::vector<double>* numbers);
// Numbers whose count is fixed; element (row, col) is data[row * row_stride + col * col_stride]. A
// list of rows where there are several rows and columns, else a plain list.
ListRef ListOf(double* data, size_t rows, size_t cols, size_t row_stride, size_t col_stride);

template <class V>
ValueRef RefTo(V* member) {
  if constexpr (HasFields<V>) {
    return GroupOf(member);
  } else if constexpr (IsVectorOfStructs<V>::value) {
    return ListRef{true, [member] { return member->size(); },
                   [member](size_t n) { member->resize(n); },
                   [member](size_t i) { return Field{.value = GroupOf(&(*member)[i])}; }};
  } else if constexpr (std::is_enum_v<V>) {
    return EnumOf(member);
  } else if constexpr (std::is_base_of_v<Eigen::MatrixBase<V>, V>) {
    constexpr int rows = V::RowsAtCompileTime, cols = V::ColsAtCompileTime;
    static_assert(rows > 0 && cols > 0, "only matrices of fixed size");
    return V::IsRowMajor ? ListOf(member->data(), rows, cols, cols, 1)
                         : ListOf(member->data(), rows, cols, 1, rows);
  } else if constexpr (requires { std::tuple_size<V>::value; }) {
    return ListOf(member->data(), member->size(), 1, 1, member->size());
  } else if constexpr (std::is_same_v<V, std::vector<double>>) {
    return ListOf(member);
  } else {
    return member;
  }
}

}  // namespace internal

template <HasFields T>
GroupRef GroupOf(T* object) {
  GroupRef group;
  T::Fields(*object, [&group](const char* key, auto& member, const Range& range, const char* doc) {
    internal::AddField(key, range, doc, internal::RefTo(&member), &group);
  });
  if constexpr (requires { object->MoreFields(&group); }) object->MoreFields(&group);
  return group;
}

// ------------------------------------------------------------------------------------------------
// What is done with a struct's fields.

// Sets the members whose keys are present; a list is replaced as a whole, its elements begin with
// their defaults. Keys named in `read_elsewhere` are left to the caller. `origins` may be null.
template <HasFields T>
void ReadFields(const YamlNode& node, T* object, Origins* origins,
                std::initializer_list<std::string_view> read_elsewhere = {}) {
  internal::ReadGroup(node, GroupOf(object), origins, read_elsewhere);
}

// Sets one value from "key.path=value"; the value is YAML in one line, a list element is
// key.path[0] or key.path.0. `origins` may be null.
template <HasFields T>
void ApplySet(const std::string& assignment, T* object, Origins* origins) {
  internal::ApplySetToGroup(assignment, GroupOf(object), origins);
}

// Runs the ranges and Check of the whole object; to be called after the last layer.
template <HasFields T>
void CheckSettings(const T& object, const Origins& origins) {
  try {
    CheckFields(object, "");
  } catch (const ConfigError& error) {
    internal::ThrowWithOrigin(error, origins);
  }
}

// Reads all layers over the object and checks it. Returns where each value was set.
template <HasFields T>
Origins ReadLayers(const Layers& layers, T* object) {
  Origins origins;
  const GroupRef group = GroupOf(object);
  for (const YamlNode& file : layers.files) internal::ReadGroup(file, group, &origins, {});
  for (const std::string& assignment : layers.assignments)
    internal::ApplySetToGroup(assignment, group, &origins);
  CheckSettings(*object, origins);
  return origins;
}

// One value of any type that a field may have, of any finite size.
template <class V>
void ReadValue(const YamlNode& node, V* value) {
  internal::ReadOne(node, internal::RefTo(value));
}

// What the layers give for this one key, or `otherwise`: for a preset, which others begin with and
// which must be known before they are read. Nothing else in the layers is looked at.
template <class V>
V Peek(const Layers& layers, const std::string& key, V otherwise) {
  if (const auto last = internal::LastOf(layers, key)) ReadValue(*last, &otherwise);
  return otherwise;
}

// All of the above: defaults, then the files in order, then the assignments, then the checks.
template <HasFields T>
T LoadLayers(const std::vector<std::string>& files, const std::vector<std::string>& assignments) {
  T object;
  Layers layers{.assignments = assignments};
  for (const std::string& file : files) layers.files.push_back(LoadYaml(file));
  ReadLayers(layers, &object);
  return object;
}

// Every field, with its description as a comment. Loading it gives the same object, bit for bit.
template <HasFields T>
std::string SaveYaml(const T& object) {
  T copy = object;
  return internal::SaveGroup(GroupOf(&copy));
}

// The value of one key, "key.path" or "key.path[0]", as YAML in one line. ConfigError for a key
// that is not there or is a group.
template <HasFields T>
std::string ValueOf(const T& object, const std::string& key) {
  T copy = object;
  return internal::ValueIn(GroupOf(&copy), key);
}

template <HasFields T>
std::vector<KeyDoc> ListKeys() {
  T defaults;
  return internal::ListGroupKeys(GroupOf(&defaults));
}

}  // namespace turbidock::config
