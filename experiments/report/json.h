#pragma once
// JSON of results, its keys in their order. A struct with Fields (sim/base/fields.h) is an object;
// a result needs no range and no description there: field("pairs", self.pairs). So
//
//   const Json json = {{"build", build}, {"best", best_row}, {"rows", all_rows}};
//   std::fputs(JsonText(json).c_str(), stdout);
//
// knows bool, numbers (null where they are not finite), text, enums by their Names, what may be
// absent (null), vectors, matrices and quaternions (w, x, y, z), lists and maps of these; a struct
// with AsList(), such as an interval, is that list. What was written reads back: json.get<Row>().

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>

#include "sim/base/fields.h"

namespace turbidock::report {

using Json = nlohmann::ordered_json;

// Two spaces indented, with a final newline.
std::string JsonText(const Json& json);
// In one line, without its end. Bytes that are no UTF-8 (in a crash report, say) are replaced.
std::string JsonLine(const Json& json);
// ConfigError "WHERE: ..." for a text that is no JSON or is nested deeper than 64 levels.
Json ParseJson(const std::string& text, const std::string& where);

// A value as one of a line of CSV: a text that needs it in quotes, numbers so that they read back
// exactly, null as nothing.
std::string CsvField(const Json& value);
// Adds an object as a line of CSV, its keys before it where the text is empty. RFC 4180.
void AddCsv(const Json& row, std::string* text);

template <class E>
concept HasNames = std::is_enum_v<E> && requires(E value) {
  Names(value);
};
template <class T>
concept HasAsList = requires(const T& value) {
  value.AsList();
};
template <class T>
concept IsMatrix = std::is_base_of_v<Eigen::MatrixBase<T>, T>;

namespace internal {
// Whether a field is in the JSON: `about` is what its line says beside key and member.
template <class T>
bool IsShown(const T& about) {
  if constexpr (requires { about.json; })
    return about.json;
  else
    return true;
}
}  // namespace internal
}  // namespace turbidock::report

namespace nlohmann {

template <turbidock::HasFields T>
struct adl_serializer<T> {
  static void to_json(ordered_json& json, const T& object) {
    json = ordered_json::object();
    T::Fields(object, [&json](const char* key, const auto& member, const auto&... about) {
      if ((turbidock::report::internal::IsShown(about) && ...)) json[key] = member;
    });
  }
  static void from_json(const ordered_json& json, T& object) {
    T::Fields(object, [&json](const char* key, auto& member, const auto&...) {
      json.at(key).get_to(member);
    });
  }
};

template <turbidock::report::HasNames E>
struct adl_serializer<E> {
  static void to_json(ordered_json& json, E value) { json = turbidock::NameOf(value); }
  static void from_json(const ordered_json& json, E& value) {
    for (const auto& [known, name] : turbidock::EnumNames<E>::kNames)
      if (json.get_ref<const std::string&>() == name) value = known;
  }
};

template <turbidock::report::HasAsList T>
struct adl_serializer<T> {
  static void to_json(ordered_json& json, const T& value) { json = value.AsList(); }
};

template <class T>
struct adl_serializer<std::optional<T>> {
  static void to_json(ordered_json& json, const std::optional<T>& value) {
    json = value ? ordered_json(*value) : ordered_json();
  }
  static void from_json(const ordered_json& json, std::optional<T>& value) {
    value = json.is_null() ? std::nullopt : std::optional(json.get<T>());
  }
};

template <turbidock::report::HasNames E, class T>
struct adl_serializer<std::map<E, T>> {
  static void to_json(ordered_json& json, const std::map<E, T>& map) {
    json = ordered_json::object();
    for (const auto& [key, value] : map) json[turbidock::NameOf(key)] = value;
  }
};

// A matrix is the list of its rows.
template <turbidock::report::IsMatrix M>
struct adl_serializer<M> {
  static void to_json(ordered_json& json, const M& m) {
    json = ordered_json::array();
    for (Eigen::Index i = 0; i < (M::IsVectorAtCompileTime ? m.size() : m.rows()); ++i)
      if constexpr (M::IsVectorAtCompileTime)
        json.push_back(m(i));
      else
        json.push_back(m.row(i).eval());
  }
  static void from_json(const ordered_json& json,
                        M& vector) requires(bool(M::IsVectorAtCompileTime)) {
    for (Eigen::Index i = 0; i < vector.size(); ++i)
      json.at(static_cast<size_t>(i)).get_to(vector(i));
  }
};

template <>
struct adl_serializer<Eigen::Quaterniond> {
  static void to_json(ordered_json& json, const Eigen::Quaterniond& q) {
    json = {q.w(), q.x(), q.y(), q.z()};
  }
  static void from_json(const ordered_json& json, Eigen::Quaterniond& q) {
    const auto wxyz = json.get<std::array<double, 4>>();
    q = {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
  }
};

}  // namespace nlohmann
