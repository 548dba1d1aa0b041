#pragma once
// The keys of the scenario that a plan gives values: those that it draws, and which there are.

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sim/base/fields.h"

namespace turbidock::config {
struct YamlNode;
}

namespace turbidock::batch {

// A random key and how a number in (0, 1) becomes its value.
struct RandomKey {
  enum class Kind { kUniform, kNormal, kLogUniform, kChoice };

  std::string key;
  Kind kind = Kind::kUniform;
  std::array<double, 2> numbers{};              // low, high; mean, standard deviation
  std::optional<std::array<double, 2>> within;  // of a normal distribution: cut off there
  std::vector<std::string> choices;

  // Of a distribution as a plan's `random` has it: {normal: [15, 0.5], within: [13, 17]}.
  // ConfigError that names its line for any other.
  static RandomKey Read(const std::string& key, const config::YamlNode& distribution);
  // The value, as YAML, at u in (0, 1): the distribution's quantile, or one of the choices.
  std::string ValueAt(double u) const;
};

constexpr auto Names(RandomKey::Kind) {
  using enum RandomKey::Kind;
  return EnumList<RandomKey::Kind>({{kUniform, "uniform"},
                                    {kNormal, "normal"},
                                    {kLogUniform, "log_uniform"},
                                    {kChoice, "choice"}});
}

// Which keys of the scenario are given values, so that none is given them twice: by a plan's `set`,
// its cases, grid, strata and draws, or by a study's gains.
//
// A group of keys counts as each of its keys, an element of a list as a part of it: `start:
// {heading_rad: 0}` is `start.heading_rad`, `a[1]` is `a.1` and part of `a`. A part may be given
// after the whole, not the whole after the part, which would be lost.
class VariedKeys {
 public:
  void Add(const std::string& key, const config::YamlNode& value);
  // ConfigError about the first key of the value that is there already, or of which a part is:
  // where it is given before, or another problem with that.
  void RequireNew(const std::string& key, const config::YamlNode& value,
                  const std::string& problem = "") const;
  // Whether a key in dots is given, alone or in a group.
  bool Has(const std::string& key) const { return Find(key) != nullptr; }

 private:
  // Where a key in dots, or its first part, is given; null where it is not.
  const std::string* Find(const std::string& leaf) const;

  std::map<std::string, std::string> leaves_;  // by the key in dots, where it is given
};

}  // namespace turbidock::batch
