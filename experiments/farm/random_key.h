#pragma once
// The keys that a plan draws for each trial, and how the draws of a cell's trials are spread.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim/base/fields.h"
#include "sim/base/random.h"

namespace turbidock::config {
struct YamlNode;
}

namespace turbidock::farm {

// How the random keys of a cell's trials are spread. All keep each key's distribution.
enum class Design {
  kIndependent,     // each trial by itself
  kLatinHypercube,  // each key's range is cut into `seeds` equally likely parts, each met once
  kSobol,           // points of a Sobol sequence, shifted at random (digitally)
};
constexpr auto Names(Design) {
  using enum Design;
  return EnumList<Design>(
      {{kIndependent, "independent"}, {kLatinHypercube, "latin_hypercube"}, {kSobol, "sobol"}});
}

// A random key and how a number in (0, 1) becomes its value.
struct RandomKey {
  enum class Kind { kUniform, kNormal, kLogUniform, kChoice };

  std::string key;
  Kind kind = Kind::kUniform;
  double first = 0, second = 0;                     // low, high; mean, standard deviation
  std::optional<std::pair<double, double>> within;  // of a normal distribution: cut off there
  std::vector<std::string> choices;

  // Of a distribution as a plan's `random` has it: {normal: [15, 0.5], within: [13, 17]}.
  // ConfigError that names its line for any other.
  static RandomKey Read(const std::string& key, const config::YamlNode& distribution);
  // The distribution as Read takes it, in one line.
  std::string Text() const;
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

// Numbers in (0, 1) for `samples` trials of each group: a row a trial, group after group, a column
// a key. Each key and group has a stream of its own: a new key or group leaves the others' draws
// alone.
std::vector<double> DrawDesign(Design design, const std::vector<RandomKey>& keys, int64_t groups,
                               int64_t samples, const SeedTree& seeds);

}  // namespace turbidock::farm
