#pragma once
// One list of fields per parameter struct drives loading, saving, checking and documentation, so
// that they cannot drift apart. A struct takes part by having
//
//   struct GaOptions {
//     int population = 60;
//     static void Fields(auto& self, auto&& field) {
//       field("population", self.population, AtLeast(4), "individuals in a generation");
//     }
//   };
//
// Keys carry the unit (`baseline_m`). A member may be: bool, int, int64_t, double, std::string,
// InputFile, an enum with EnumNames, Eigen vectors and matrices of double of fixed size,
// std::array<double, N>, std::vector<double>, another such struct, or a std::vector of such
// structs. A struct may also have `void Check(const std::string& path) const`, which throws
// ConfigError for what one range cannot say.

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "sim/base/check.h"

namespace turbidock {

// Allowed values of a number (of each element of a vector). NaN and infinities never are.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;   // low itself is not allowed
  bool high_open = false;  // high itself is not allowed

  bool Contains(double x) const {
    return std::isfinite(x) && (low_open ? x > low : x >= low) &&
           (high_open ? x < high : x <= high);
  }
  // "must be in [0, 1]", "must be > 0", "must be finite".
  std::string Sentence() const;
};

// A file that what has this field reads. Whoever reads it from YAML makes it an absolute path; the
// name of a bundled model stays as it is. Empty: none.
struct InputFile {
  std::string path;

  InputFile() = default;
  InputFile(std::string given) : path(std::move(given)) {}  // NOLINT: is one
  InputFile(const char* given) : path(given) {}             // NOLINT: likewise
  operator const std::string&() const { return path; }      // NOLINT: likewise
  bool empty() const { return path.empty(); }
  bool operator==(const InputFile&) const = default;
};

inline Range Finite() { return {}; }
inline Range AtLeast(double low) { return {.low = low}; }
inline Range Above(double low) { return {.low = low, .low_open = true}; }
inline Range InRange(double low, double high) { return {.low = low, .high = high}; }
inline Range Between(double low, double high) {
  return {.low = low, .high = high, .low_open = true, .high_open = true};
}

// Names of an enum's values as users write them. An enum has them by a function beside it:
//
//   constexpr auto Names(Shape) {
//     using enum Shape;
//     return EnumList<Shape>({{kBall, "ball"}, {kBox, "box"}});
//   }
template <class E, size_t kCount>
constexpr auto EnumList(const std::pair<E, const char*> (&names)[kCount]) {
  return std::to_array(names);
}

template <class E>
struct EnumNames {
  static constexpr auto kNames = Names(E{});
};

template <class E>
const char* NameOf(E value) {
  for (const auto& [known, name] : EnumNames<E>::kNames)
    if (known == value) return name;
  return "?";
}

namespace internal {
struct NullVisitor {
  void operator()(const char*, auto&, const Range&, const char*) const {}
};
}  // namespace internal

template <class T>
concept HasFields = requires(T& t) {
  T::Fields(t, internal::NullVisitor{});
};

template <class T>
concept HasCheck = requires(const T& t) {
  t.Check(std::string());
};

template <class T>
struct IsVectorOfStructs : std::false_type {};
template <HasFields T>
struct IsVectorOfStructs<std::vector<T>> : std::true_type {};

std::string FormatNumber(double x);  // shortest text that reads back as x

// The dotted key of a member of the group `path`; empty: of the outermost.
std::string JoinKey(const std::string& path, const std::string& key);

namespace internal {
// Apart from the template below, which is compiled for every struct: throws for the first of
// `count` values that is outside the range.
void CheckNumbers(const double* values, size_t count, const Range& range, const std::string& path,
                  const char* key);
}  // namespace internal

// Throws ConfigError naming the first field (dotted, below `path`) whose value is outside its
// range.
template <HasFields T>
void CheckFields(const T& object, const std::string& path) {
  T::Fields(object, [&path](const char* key, const auto& value, const Range& range, const char*) {
    using V = std::remove_cvref_t<decltype(value)>;
    if constexpr (HasFields<V>) {
      CheckFields(value, JoinKey(path, key));
    } else if constexpr (IsVectorOfStructs<V>::value) {
      for (size_t i = 0; i < value.size(); ++i)
        CheckFields(value[i], JoinKey(path, key) + "[" + std::to_string(i) + "]");
    } else if constexpr (std::is_same_v<V, bool> || std::is_same_v<V, std::string> ||
                         std::is_same_v<V, InputFile> || std::is_enum_v<V>) {
    } else if constexpr (std::is_arithmetic_v<V>) {
      const auto number = static_cast<double>(value);
      internal::CheckNumbers(&number, 1, range, path, key);
    } else {
      internal::CheckNumbers(value.data(), static_cast<size_t>(value.size()), range, path, key);
    }
  });
  if constexpr (HasCheck<T>) object.Check(path);
}

}  // namespace turbidock
