#pragma once
// Strict YAML for any struct with Fields (sim/base/fields.h): loading in layers, --set, saving and
// the table of keys, all from the one list of fields.
//
//   Origins origins;
//   Scenario scenario;                                    // layer 1: the defaults in the struct
//   ReadFields(LoadYaml("night_sea.yaml"), &scenario, &origins);
//   ApplySet("water.milk_ml_m3=20", &scenario, &origins);
//   CheckSettings(scenario, origins);                     // after the last layer
//
// Whatever is wrong is a ConfigError with the file and line of the offending key:
//
//   night_sea.yaml:12: camera.baseline_m = 'abc', must be a number in m
//   night_sea.yaml:14: water.milk_ml_m4: unknown key; did you mean milk_ml_m3?
//   --set camera.baseline_m = -0.1, must be in [0.01, 1]

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "sim/base/fields.h"

namespace turbidock::config {

// A part of a YAML document and where it is: `path` is the dotted key, empty for the whole
// document.
struct YamlNode {
  YAML::Node node;
  std::string file;
  std::string path;
  int line = 1;

  // The value of a key of this map, or nothing. For keys that no struct describes.
  std::optional<YamlNode> Find(const std::string& key) const;
  // "FILE:LINE: ", the beginning of a message about this node.
  std::string Where() const;
};

// Reads a file, or text as if it were a file of that name. Throws ConfigError when it cannot be
// read, is no valid YAML, holds nothing, more than one document, or no map.
YamlNode LoadYaml(const std::string& file);
YamlNode ParseYaml(const std::string& text, const std::string& file);

// A value as YAML in one line; the same for any comments and line breaks.
std::string OneLine(const YAML::Node& node);

// Where each value was last set: dotted key (and that of each group) -> "FILE:LINE: " or "--set ".
// A key that is absent has its default.
using Origins = std::map<std::string, std::string, std::less<>>;

// Sets the members whose keys are present; a list is replaced as a whole, its elements begin with
// their defaults. Keys named in `read_elsewhere` are left to the caller. `origins` may be null.
template <HasFields T>
void ReadFields(const YamlNode& node, T* object, Origins* origins,
                std::initializer_list<std::string_view> read_elsewhere = {});

// Sets one value from "key.path=value"; the value is YAML in one line, a list element is
// key.path[0] or key.path.0. `origins` may be null.
template <HasFields T>
void ApplySet(const std::string& assignment, T* object, Origins* origins);

// Runs the ranges and Check of the whole object; to be called after the last layer.
template <HasFields T>
void CheckSettings(const T& object, const Origins& origins);

// All of the above: defaults, then the files in order, then the assignments, then the checks.
template <HasFields T>
T LoadLayers(const std::vector<std::string>& files, const std::vector<std::string>& assignments);

// Every field, with its description as a comment. Loading it gives the same object, bit for bit.
template <HasFields T>
std::string SaveYaml(const T& object);

// One line of the table of keys.
struct KeyDoc {
  std::string key;    // dotted; elements of a list of groups are written key[]
  std::string type;   // "number in m", "3 numbers", "one of active, passive", "group"
  std::string value;  // the default as YAML; empty for groups
  std::string range;  // "in [0, 1]"; empty where any value will do
  std::string doc;
};
template <HasFields T>
std::vector<KeyDoc> ListKeys();

// ------------------------------------------------------------------------------------------------
// A struct's fields with their types erased, so that the work above is done once, in the .cc file.

struct Field;

struct GroupRef {
  std::vector<Field> fields;
};

// A list of structs: element references are valid until the next Resize.
struct ListRef {
  std::function<size_t()> size;
  std::function<void(size_t)> resize;  // new elements have their defaults
  std::function<GroupRef(size_t)> element;
};

// Numbers whose count is fixed; element (row, col) is data[row * row_stride + col * col_stride]. A
// list of rows where there are several rows and columns, else a plain list.
struct NumbersRef {
  double* data = nullptr;
  int rows = 0, cols = 0;
  int row_stride = 0, col_stride = 0;
};

struct EnumRef {
  std::vector<std::string> names;
  std::function<size_t()> get;
  std::function<void(size_t)> set;
};

struct Field {
  std::string key;
  Range range;
  std::string doc;
  std::variant<bool*, int*, int64_t*, double*, std::string*, std::vector<double>*, NumbersRef,
               EnumRef, GroupRef, ListRef>
      value;
};

// References to the members of `object`, which must outlive them.
template <HasFields T>
GroupRef GroupOf(T* object);

namespace internal {

void ReadGroup(const YamlNode& node, const GroupRef& group, Origins* origins,
               std::initializer_list<std::string_view> read_elsewhere);
void ApplySetToGroup(const std::string& assignment, const GroupRef& group, Origins* origins);
// Rethrows `error` with the origin of its key, or of the group around it, in front.
[[noreturn]] void ThrowWithOrigin(const ConfigError& error, const Origins& origins);
std::string SaveGroup(const GroupRef& group);
std::vector<KeyDoc> ListGroupKeys(const GroupRef& group);

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

template <HasFields T>
ListRef ListOf(std::vector<T>* list) {
  return {[list] { return list->size(); }, [list](size_t n) { list->resize(n); },
          [list](size_t i) { return GroupOf(&(*list)[i]); }};
}

template <class V>
auto RefTo(V* member) {
  if constexpr (HasFields<V>) {
    return GroupOf(member);
  } else if constexpr (IsVectorOfStructs<V>::value) {
    return ListOf(member);
  } else if constexpr (std::is_enum_v<V>) {
    return EnumOf(member);
  } else if constexpr (std::is_base_of_v<Eigen::MatrixBase<V>, V>) {
    constexpr int rows = V::RowsAtCompileTime, cols = V::ColsAtCompileTime;
    static_assert(rows > 0 && cols > 0, "only matrices of fixed size");
    return V::IsRowMajor ? NumbersRef{member->data(), rows, cols, cols, 1}
                         : NumbersRef{member->data(), rows, cols, 1, rows};
  } else if constexpr (requires { std::tuple_size<V>::value; }) {
    constexpr int size = static_cast<int>(std::tuple_size_v<V>);
    return NumbersRef{member->data(), size, 1, 1, size};
  } else {
    return member;
  }
}

}  // namespace internal

template <HasFields T>
GroupRef GroupOf(T* object) {
  GroupRef group;
  T::Fields(*object, [&](const char* key, auto& member, const Range& range, const char* doc) {
    group.fields.push_back({key, range, doc, internal::RefTo(&member)});
  });
  return group;
}

template <HasFields T>
void ReadFields(const YamlNode& node, T* object, Origins* origins,
                std::initializer_list<std::string_view> read_elsewhere) {
  internal::ReadGroup(node, GroupOf(object), origins, read_elsewhere);
}

template <HasFields T>
void ApplySet(const std::string& assignment, T* object, Origins* origins) {
  internal::ApplySetToGroup(assignment, GroupOf(object), origins);
}

template <HasFields T>
void CheckSettings(const T& object, const Origins& origins) {
  try {
    CheckFields(object, "");
  } catch (const ConfigError& error) {
    internal::ThrowWithOrigin(error, origins);
  }
}

template <HasFields T>
T LoadLayers(const std::vector<std::string>& files, const std::vector<std::string>& assignments) {
  T object;
  Origins origins;
  for (const auto& file : files) ReadFields(LoadYaml(file), &object, &origins);
  for (const auto& assignment : assignments) ApplySet(assignment, &object, &origins);
  CheckSettings(object, origins);
  return object;
}

template <HasFields T>
std::string SaveYaml(const T& object) {
  T copy = object;
  return internal::SaveGroup(GroupOf(&copy));
}

template <HasFields T>
std::vector<KeyDoc> ListKeys() {
  T defaults;
  return internal::ListGroupKeys(GroupOf(&defaults));
}

}  // namespace turbidock::config
