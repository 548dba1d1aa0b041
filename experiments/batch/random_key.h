#pragma once
// The keys that a plan draws for each trial.

#include <optional>
#include <string>
#include <utility>
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
  std::string text;  // the distribution as Read takes it, in one line
  Kind kind = Kind::kUniform;
  double first = 0, second = 0;                     // low, high; mean, standard deviation
  std::optional<std::pair<double, double>> within;  // of a normal distribution: cut off there
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

}  // namespace turbidock::batch
