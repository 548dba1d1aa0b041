#pragma once
// Strict YAML for any struct with Fields (sim/base/fields.h): loading in layers, --set, saving and
// the table of keys, all from the one list of fields.
//
//   Scenario scenario;  // the defaults in the struct
//   ReadLayers({{"", LoadYaml("night_sea.yaml")}, ParseAssignment("water.milk_ml_m3=20")},
//              &scenario);
//
// Whatever is wrong is a ConfigError with the file and line of the offending key, a line for each
// mistake in a file:
//
//   night_sea.yaml:12: cameras.rig.baseline_m = 'abc', must be a number
//   night_sea.yaml:14: water.milk_ml_m4: unknown key; did you mean milk_ml_m3?
//   --set cameras.rig.baseline_m = -0.1, must be in [0.01, 1]

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "experiments/config/given_keys.h"
#include "experiments/config/group_ref.h"
#include "experiments/config/yaml_node.h"
#include "sim/base/fields.h"

namespace turbidock::config {

// "key.path=value" of --set; the value is YAML in one line, a list element is key.path[0] or
// key.path.0.
Assignment ParseAssignment(const std::string& text);
std::vector<Assignment> ParseAssignments(const std::vector<std::string>& texts);
// The same values, a group of keys as one for each key in it.
std::vector<Assignment> LeavesOf(const std::vector<Assignment>& assignments);

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
  bool required = false;  // a file must give it: value is what no file may leave it at
};

// ------------------------------------------------------------------------------------------------
// A struct may also have
//  - `static constexpr std::array kGroups` of name and description: groups that follow its other
//    fields in this order. A field is in one by its key in dots, "control.pid", whatever struct its
//    member is in;
//  - `void MoreFields(GroupRef* group)`, for fields that are known only when the program runs, in
//    front of the others;
//  - `void Given(const std::string& key)`, called after a value in it was read: for keys that stand
//    for others. What is given later is read over what they set;
//  - `static constexpr std::array kPresets`: such keys, read before the others of the same file.
//
// A struct's fields with their types erased, so that the work below is done once, in the .cc file.

struct Field;

struct GroupRef {
  std::vector<Field> fields;
  std::vector<std::string> presets{};
  std::function<void(const std::string& key)> given{};
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

using ValueRef = std::variant<bool*, int*, int64_t*, double*, std::string*, InputFile*, EnumRef,
                              GroupRef, ListRef>;

struct Field {
  std::string key{};
  Range range{};
  std::string doc{};
  ValueRef value;
};

namespace internal {

// Apart from GroupOf, which is compiled for every struct. A group that is there already gets the
// fields of one of the same key.
void AddField(const char* key, const Range& range, const char* doc, ValueRef value,
              GroupRef* group);
void ArrangeGroups(std::span<const std::pair<const char*, const char*>> groups, GroupRef* group);
void ReadGroup(const YamlNode& node, const GroupRef& group, Origins* origins,
               const std::vector<std::string>& read_elsewhere);
void ReadResolvedGroup(const YamlNode& node, const GroupRef& group);
// A group that a value is in, and what it is to be told.
struct Around {
  std::string path;
  std::function<void(const std::string& key)> given;
};
// The field that `at->path` names, element by element, and the groups around it, from outside.
Field FieldAt(const GroupRef& group, YamlNode* at, std::vector<Around>* around = nullptr);
std::string TypeName(const Field& field);  // "number", "one of active, passive"
// The value of a key, of whatever type, in one line.
std::string TextAt(const GroupRef& group, const std::string& key);
Origins ReadLayersOf(const std::vector<Assignment>& layers, const GroupRef& group,
                     GivenKeys* given);
// One of the layers.
void ReadLayer(const Assignment& layer, const GroupRef& group, Origins* origins);
void AddOrigins(const Origins& layer, Origins* all);
void ReadOne(const YamlNode& node, const ValueRef& value);
std::vector<std::string> PresetsIn(const GroupRef& group);
void ForEachFile(const GroupRef& group, const std::function<void(InputFile*)>& act);
// Rethrows `error` with the origin of its key, or of the group around it, in front.
[[noreturn]] void ThrowWithOrigin(const ConfigError& error, const Origins& origins);
std::string SaveGroup(const GroupRef& group);
std::string ValueIn(const GroupRef& group, const std::string& key);
Range RangeIn(const GroupRef& group, const std::string& key);
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
  if constexpr (requires { object->MoreFields(&group); }) object->MoreFields(&group);
  T::Fields(*object, [&group](const char* key, auto& member, const Range& range, const char* doc) {
    internal::AddField(key, range, doc, internal::RefTo(&member), &group);
  });
  if constexpr (requires { T::kGroups; }) internal::ArrangeGroups(T::kGroups, &group);
  if constexpr (requires { object->Given(std::string()); })
    group.given = [object](const std::string& key) { object->Given(key); };
  if constexpr (requires { T::kPresets; }) group.presets = {T::kPresets.begin(), T::kPresets.end()};
  return group;
}

// ------------------------------------------------------------------------------------------------
// What is done with a struct's fields.

// Sets the members whose keys are present; a list is replaced as a whole, its elements begin with
// their defaults. Keys named in `read_elsewhere` are left to the caller. `origins` may be null.
template <HasFields T>
void ReadFields(const YamlNode& node, T* object, Origins* origins,
                const std::vector<std::string>& read_elsewhere = {}) {
  internal::ReadGroup(node, GroupOf(object), origins, read_elsewhere);
}

// Runs the ranges and Check of the whole object, which is at this path of its document; to be
// called after the last layer.
template <HasFields T>
void CheckSettings(const T& object, const Origins& origins, const std::string& path = "") {
  try {
    CheckFields(object, path);
  } catch (const ConfigError& error) {
    internal::ThrowWithOrigin(error, origins);
  }
}

// Reads all layers over the object, in their order. Returns where each value was set.
template <HasFields T>
Origins SetLayers(const std::vector<Assignment>& layers, T* object, GivenKeys* given = nullptr) {
  return internal::ReadLayersOf(layers, GroupOf(object), given);
}

// The same, and checks it.
template <HasFields T>
Origins ReadLayers(const std::vector<Assignment>& layers, T* object, GivenKeys* given = nullptr) {
  Origins origins = SetLayers(layers, object, given);
  CheckSettings(*object, given ? given->origins : origins);
  return origins;
}

// Reads what SaveYaml wrote, and checks it: presets stand for nothing, files are as they are
// written and need not be there.
template <HasFields T>
void ReadResolved(const YamlNode& node, T* object) {
  internal::ReadResolvedGroup(node, GroupOf(object));
  CheckFields(*object, "");
}

// One value of any type that a field may have, of any finite size.
template <class V>
void ReadValue(const YamlNode& node, V* value) {
  internal::ReadOne(node, internal::RefTo(value));
}

// All of the above: defaults, then the files in order, then the assignments, then the checks.
template <HasFields T>
T LoadLayers(const std::vector<std::string>& files, const std::vector<std::string>& assignments) {
  T object;
  std::vector<Assignment> layers;
  layers.reserve(files.size() + assignments.size());
  for (const std::string& file : files) layers.push_back({"", LoadYaml(file)});
  for (const std::string& text : assignments) layers.push_back(ParseAssignment(text));
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

// Which numbers a key may be, alone. ConfigError for a key that is not there.
template <HasFields T>
Range RangeOf(const T& object, const std::string& key) {
  T copy = object;
  return internal::RangeIn(GroupOf(&copy), key);
}

// The keys of its presets, in dots, in the order in which they are read.
template <HasFields T>
std::vector<std::string> PresetsOf(const T& object) {
  T copy = object;
  return internal::PresetsIn(GroupOf(&copy));
}

// Does it to each of its fields that names a file.
template <HasFields T>
void ForEachFileIn(T* object, const std::function<void(InputFile*)>& act) {
  internal::ForEachFile(GroupOf(object), act);
}

// The files that it names.
template <HasFields T>
std::vector<std::string> FilesNamedIn(const T& object) {
  T copy = object;
  std::vector<std::string> files;
  ForEachFileIn(&copy, [&files](InputFile* file) {
    if (!file->empty()) files.push_back(file->path);
  });
  return files;
}

// The value of any key, also of a group or a list of them, in one line.
template <HasFields T>
std::string TextOf(const T& object, const std::string& key) {
  T copy = object;
  return internal::TextAt(GroupOf(&copy), key);
}

template <HasFields T>
std::vector<KeyDoc> ListKeys() {
  T defaults;
  return internal::ListGroupKeys(GroupOf(&defaults));
}

}  // namespace turbidock::config
